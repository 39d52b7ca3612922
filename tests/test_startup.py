"""What is imported when: help pages and commands load only what they need, and gymnasium knows the environment.

How long that takes is in `benchmarks/startup.py`; what is imported is the same on any machine.
"""

import subprocess
import sys

import pytest

from orient_eye.cli import COMMANDS

COMPUTING = {
    "numpy",
    "scipy",
    "gymnasium",
    "mujoco",
    "numba",
    "torch",
    "stable_baselines3",
    "matplotlib",
    "rerun",
    "pyarrow",
}
GIVE = """
import sys
from orient_eye.cli import main
for arguments in {commands}:
    try:
        main(arguments)
    except SystemExit as end:
        assert not end.code, (arguments, end.code)
"""
LISTED = "\nimport sys; print(*sys.modules, file=sys.stderr)"


def run(program: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)


def computing(program: str) -> set[str]:
    """Which of the libraries that compute a program imports."""
    return COMPUTING & set(run(program + LISTED).stderr.splitlines()[-1].split())


def test_no_help_page_waits_for_what_computes() -> None:
    pages = [["--help"], ["--version"], *([name, "--help"] for name in COMMANDS)]
    assert computing(GIVE.format(commands=pages)) == set()


@pytest.mark.parametrize(
    ("command", "needed"),
    [
        (["models"], set()),
        (["predict", "lpf-1", "--target", "10"], set()),
        (["predict", "mujoco-1", "--target", "10"], {"mujoco"}),
    ],
)
def test_a_command_imports_only_what_it_needs(command: list[str], needed: set[str]) -> None:
    assert computing(GIVE.format(commands=[command])) == {"numpy", "scipy", *needed}


def test_numba_waits_for_the_plant_that_it_compiles() -> None:
    for plant, imports in (("mujoco", set()), ("tavares", {"numba"})):
        assert {"numba"} & computing(f"import orient_eye; orient_eye.make_plant({plant!r})") == imports


@pytest.mark.parametrize(
    "imports",
    [
        "import gymnasium, orient_eye",
        "import orient_eye, gymnasium",
        "import orient_eye; from gymnasium.envs.registration import spec; import gymnasium",
        "import orient_eye; from orient_eye import SaccadeEnv; import gymnasium",
        "import orient_eye, importlib.util; importlib.util.find_spec('gymnasium'); import gymnasium",
        "import gymnasium; gymnasium.make('orient_eye:OrientEye/Saccade-v0')",
    ],
)
def test_gymnasium_knows_the_environment_whoever_is_imported_first(imports: str) -> None:
    told = "; print(gymnasium.make('OrientEye/Saccade-v0').reset(seed=0)[0].shape)"
    done = run(f"import sys; before = len(sys.meta_path); {imports}{told}; assert len(sys.meta_path) == before")
    assert done.stdout.strip() == "(8,)"
    assert not done.stderr  # gymnasium would say that it is registered twice


def test_gymnasium_can_be_missing() -> None:
    """A finder that says no more than there is: an import that fails fails as ever."""
    missing = "import sys; sys.path[:] = [p for p in sys.path if 'site-packages' not in p]\n"
    program = f"import orient_eye\n{missing}try:\n    import gymnasium\nexcept ModuleNotFoundError as e:\n    print(e)"
    assert run(program).stdout.strip() == "No module named 'gymnasium'"
