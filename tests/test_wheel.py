"""What is built holds all that it needs and nothing else, and runs where no checkout, cache or home is.

The wheel is built from the unpacked source distribution, so both are tried. It is installed by pip into an environment
of its own, beside the libraries of this one.
"""

import ast
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import zipfile
from dataclasses import dataclass
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("src", "eye_mjcf", "models", "tests", "scripts", "benchmarks", "examples", "docs", ".ci")

SHIPPED = {
    "eye_mjcf/eye3.xml",
    "eye_mjcf/ball.xml",
    "eye_mjcf/meshes/sclera.stl",
    "models/weights.json",
    "models/policies/lpf-1/policy.safetensors",
    "models/policies/lpf-1/README.md",
    "models/policies/mujoco-1/policy.safetensors",
    "models/rigs/prototype.toml",
    "models/surrogates/thesis.json",
    "models/surrogates/mujoco.json",
    "models/surrogates_3d/thesis-3d.json",
    "models/human/main_sequence.csv",
    "models/author_simulator/trajectories.npz",
}

RUBBISH = (
    ".coverage.host.1",
    ".hypothesis/examples/1",
    ".mypy_cache/x.json",
    ".venv-lowest/pyvenv.cfg",
    "MUJOCO_LOG.TXT",
    "demo/train/run.json",
    "dist/orient_eye-0.0.0.tar.gz",
    "docs/_build/html/index.html",
    "docs/elsewhere/CONTRIBUTING.md",
    "docs/reference/commands/train.md",
    "docs/reference/python/plants.rst",
    "notes.txt",
    "old/docs/page.md",
    "runs/train-1/checkpoint.pt",
    "src/orient_eye/__pycache__/constants.cpython-39.pyc",
    "src/orient_eye.egg-info/PKG-INFO",
    "tests/.pytest_cache/README.md",
)
"""What lies about in a checkout that somebody works in."""
MADE = ("docs/_build/", "docs/elsewhere/", "docs/reference/commands/", "docs/reference/python/")
"""Of the site, by `make docs`."""

COMMANDS = """
models
simulate --motor command.csv --out simulated
sysid --plant lpf --amplitudes 5 10 --held-out 7 --out identified
train --surrogate identified/surrogate.json --updates 8 --warmup 64 --batch-size 16 --evaluation-pairs 3 --out trained
predict trained --target 10 --command saccade.csv
evaluate lpf-1 --pairs 3 --out evaluated
export mujoco-1 --onnx policy.onnx --sb3 policy.zip
view --help
validate --random-runs 1
"""

PROGRAM = """
import sys
from pathlib import Path
import orient_eye as oe
from orient_eye.cli import main
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
for line in sys.stdin.read().split("\\n"):
    try:
        main(line.split())
    except SystemExit as end:
        assert not end.code, (line, end.code)
"""


@dataclass(frozen=True)
class Built:
    """The unpacked source distribution, and the wheel built from it."""

    source: Path
    wheel: Path


def build(kind: str, source: Path, folder: Path) -> Path:
    command = [sys.executable, "-m", "build", f"--{kind}", "--no-isolation", "--outdir", str(folder), str(source)]
    subprocess.run(command, check=True, capture_output=True)
    (built,) = folder.glob("orient_eye-*")
    return built


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    folder = tmp_path_factory.mktemp("build")
    checkout = folder / "checkout"
    for name in FOLDERS:
        shutil.copytree(ROOT / name, checkout / name, ignore=shutil.ignore_patterns("__pycache__"))
    for path in ROOT.iterdir():
        if path.is_file():
            shutil.copy(path, checkout)
    for name in RUBBISH:
        (checkout / name).parent.mkdir(parents=True, exist_ok=True)
        (checkout / name).write_text("rubbish")
    with tarfile.open(build("sdist", checkout, folder / "sdist")) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    (source,) = (folder / "unpacked").iterdir()
    return Built(source, build("wheel", source, folder / "wheel"))


def files(folder: Path) -> set[str]:
    """Of a folder of the checkout or of the source distribution, without what Python leaves there."""
    found = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {path.relative_to(folder).as_posix() for path in found}


def packaged(root: Path) -> set[str]:
    """What travels inside the package, by its path from the top."""
    return {f"{folder}/{file}" for folder in ("eye_mjcf", "models") for file in files(root / folder)}


def test_the_checkout_has_what_is_shipped() -> None:
    assert packaged(ROOT) >= SHIPPED


def test_source_distribution_is_the_checkout(built: Built) -> None:
    named = {f"{folder}/{file}" for folder in FOLDERS for file in files(ROOT / folder)}
    wanted = {path for path in named if not path.startswith(MADE)}
    assert wanted
    assert wanted <= files(built.source)
    assert {name.split("/")[0] for name in files(built.source)} == {
        *FOLDERS,
        *(".gitignore", ".pre-commit-config.yaml", "Makefile", "pyproject.toml", "constraints.txt", "PKG-INFO"),
        *("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "CITATION.cff", "LICENSE"),
    }


def test_source_distribution_holds_no_rubbish(built: Built) -> None:
    assert files(built.source).isdisjoint(RUBBISH)


def test_wheel_holds_the_package_alone(built: Built) -> None:
    with zipfile.ZipFile(built.wheel) as archive:
        names = archive.namelist()
    assert len(names) == len(set(names))
    assert {f"orient_eye/_data/{file}" for file in packaged(ROOT)} <= set(names)
    assert {f"orient_eye/{file}" for file in files(ROOT / "src" / "orient_eye")} <= set(names)
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"orient_eye"}


@pytest.mark.slow
def test_commands_run_without_checkout_home_and_cache(built: Built, tmp_path: Path) -> None:
    """And nothing is written but where it was said and into the cache; the package may be read alone."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    python = tmp_path / "venv" / "bin" / "python"
    site = Path(sysconfig.get_path("purelib", vars={"base": str(tmp_path / "venv")}))
    install = ["install", "--quiet", "--no-deps", "--no-index", str(built.wheel)]
    subprocess.run([sys.executable, "-m", "pip", "--python", python, *install], check=True)
    # Path files in a folder that is named by a path file are not read, so the checkout stays hidden.
    (site / "libraries.pth").write_text(sysconfig.get_path("purelib"))
    for path in (site / "orient_eye").rglob("*"):
        path.chmod(0o555 if path.is_dir() else 0o444)
    package = files(site / "orient_eye")

    home, work = tmp_path / "home", tmp_path / "work"
    home.mkdir()
    work.mkdir()
    (work / "command.csv").write_text("t_s,tau2_deg\n0,0\n0.1,8\n0.4,8\n")

    def run(*arguments: str | Path) -> str:
        environment = {"HOME": str(home), "PATH": os.environ["PATH"]}
        done = subprocess.run(
            arguments, check=False, capture_output=True, text=True, cwd=work, env=environment, input=COMMANDS.strip()
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert run(python.with_name("orient-eye"), "--version").strip() in built.wheel.name
    run(python, "-c", PROGRAM, site)
    assert files(site / "orient_eye") == package
    assert {path.relative_to(home).as_posix() for path in home.glob("*/*")} == {".cache/orient-eye"}
    assert [path.name for path in home.iterdir()] == [".cache"]
    assert {path.name for path in work.iterdir()} == {
        *("command.csv", "simulated", "identified", "trained", "saccade.csv", "evaluated", "policy.onnx", "policy.zip")
    }


def test_every_library_that_is_imported_is_named() -> None:
    """None comes only because another library needs it."""
    imported = set()
    for file in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                imported |= {name.name.split(".")[0] for name in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                imported.add(node.module.split(".")[0])
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    required = [
        *project["dependencies"],
        *(r for extra in ("cluster", "onnx") for r in project["optional-dependencies"][extra]),
    ]
    named = {re.split(r"[^\w-]", requirement)[0].lower() for requirement in required}
    homes = packages_distributions()
    for module in imported - sys.stdlib_module_names - {"orient_eye"}:
        assert named & {home.lower().replace("_", "-") for home in homes[module]}, module
