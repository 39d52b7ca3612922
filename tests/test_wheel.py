"""The wheel carries what the checkout has at its top: the MJCF, meshes and shipped models."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_wheel_runs_without_the_checkout(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path), str(ROOT)]
    subprocess.run(build, check=True, capture_output=True)
    wheel = next(tmp_path.glob("orient_eye-*.whl"))
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        archive.extractall(tmp_path / "site")
    for folder in ("eye_mjcf", "models"):
        for file in (ROOT / folder).rglob("*"):
            if file.is_file():
                assert f"orient_eye/_data/{folder}/{file.relative_to(ROOT / folder)}" in names
    assert "orient_eye/py.typed" in names
    assert not [name for name in names if name.startswith("tests")]

    (tmp_path / "command.csv").write_text("t_s,tau2_deg\n0,0\n0.1,8\n0.4,8\n")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    for arguments in (["simulate", "--motor", "command.csv", "--out", "run"], ["models"]):
        command = [sys.executable, "-m", "orient_eye", *arguments]
        subprocess.run(command, check=True, capture_output=True, cwd=tmp_path, env=environment)
    program = "import orient_eye.resources as r; print(r.data_folder('models'))"
    found = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True, cwd=tmp_path, env=environment
    )
    assert Path(found.stdout.strip()).is_relative_to(tmp_path)
