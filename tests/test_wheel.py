"""What is built carries what the checkout has at its top: the MJCF, meshes and shipped models."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

SHIPPED = {
    "eye_mjcf/eye3.xml",
    "eye_mjcf/ball.xml",
    "eye_mjcf/meshes/sclera.stl",
    "models/weights.json",
    "models/policies/lpf-1/policy.safetensors",
    "models/policies/mujoco-1/policy.safetensors",
    "models/rigs/prototype.toml",
    "models/surrogates/thesis.json",
    "models/surrogates/mujoco.json",
    "models/surrogates_3d/thesis-3d.json",
    "models/human/main_sequence.csv",
    "models/author_simulator/trajectories.npz",
}

PROGRAM = """
import sys
from pathlib import Path
import orient_eye as oe
from orient_eye.eyes.model import ball
from orient_eye.resources import data_folder
from orient_eye.rig import Rig

site = Path(sys.argv[1])
assert Path(oe.__file__).is_relative_to(site)
for folder in ("eye_mjcf", "models"):
    assert data_folder(folder).is_relative_to(site), data_folder(folder)
assert ball().nbody > 1
assert oe.build_model().nmesh > 0
Rig.load("prototype")
for name in ("thesis", "mujoco"):
    assert oe.Surrogate.load(name).w0 > 0
assert oe.ModalSurrogate.load("thesis-3d").modes["yaw"].w0 > 0
policies = sorted(folder.name for folder in data_folder("models").glob("policies/*"))
assert len(policies) > 1
for name in policies:
    oe.Policy.load(name)
print("all of it")
"""


def build(kind: str, folder: Path) -> Path:
    command = [sys.executable, "-m", "build", f"--{kind}", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    (built,) = folder.glob("orient_eye-*")
    return built


def files(folder: str) -> set[str]:
    """Of a folder of the checkout, without what Python leaves there."""
    found = (path for path in (ROOT / folder).rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {path.relative_to(ROOT).as_posix() for path in found}


def test_the_checkout_has_what_is_shipped() -> None:
    assert files("eye_mjcf") | files("models") >= SHIPPED


def test_wheel_runs_without_the_checkout(tmp_path: Path) -> None:
    with zipfile.ZipFile(build("wheel", tmp_path / "dist")) as archive:
        names = archive.namelist()
        archive.extractall(tmp_path / "site")
    assert len(names) == len(set(names))
    assert {f"orient_eye/_data/{file}" for file in files("eye_mjcf") | files("models") | SHIPPED} <= set(names)
    assert "orient_eye/py.typed" in names
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"orient_eye"}

    (tmp_path / "command.csv").write_text("t_s,tau2_deg\n0,0\n0.1,8\n0.4,8\n")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    for arguments in (
        ["-m", "orient_eye", "simulate", "--motor", "command.csv", "--out", "run"],
        ["-m", "orient_eye", "models"],
        ["-c", PROGRAM, str(tmp_path / "site")],
    ):
        done = subprocess.run(
            [sys.executable, *arguments], check=False, capture_output=True, text=True, cwd=tmp_path, env=environment
        )
        assert done.returncode == 0, done.stderr
    assert done.stdout == "all of it\n"


@pytest.mark.parametrize("folder", ["src", "eye_mjcf", "models", "tests", "scripts", "benchmarks", "examples", "docs"])
def test_source_distribution_is_the_checkout(folder: str, source: set[str]) -> None:
    assert files(folder)
    assert files(folder) <= source


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    with tarfile.open(build("sdist", tmp_path_factory.mktemp("sdist"))) as archive:
        return {name.split("/", 1)[1] for name in archive.getnames() if "/" in name}
