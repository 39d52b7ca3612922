"""How long one waits before anything happens: whole processes, the least of several rounds.

    python benchmarks/startup.py [--rounds 5]

Imports, every command's --help, and making an environment. Then the commands that one gives once, beside a process
that does nothing but import the modules that the command imported: the ratio says how much of the waiting is work.
CPU time is that of user and system together, and says something on a busy machine too. The commands find our
cache empty, as a newcomer's is, and those of Numba and matplotlib as an earlier run of theirs left them.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from orient_eye.cli import COMMANDS

RUN = ["-m", "orient_eye"]
MAKE = "import gymnasium, orient_eye; gymnasium.make('OrientEye/Saccade-v0', plant='{}')"
WAITS = {
    "python, nothing else": ["-c", "pass"],
    "import numpy": ["-c", "import numpy"],
    "import gymnasium": ["-c", "import gymnasium"],
    "import orient_eye": ["-c", "import orient_eye"],
    "import gymnasium, orient_eye": ["-c", "import gymnasium, orient_eye"],
    "orient-eye --help": [*RUN, "--help"],
    **{f"orient-eye {name} --help": [*RUN, name, "--help"] for name in COMMANDS},
    **{f"gymnasium.make, plant {name}": ["-c", MAKE.format(name)] for name in ("lpf", "mujoco", "tavares")},
}
COMMAND, OUT = "{command}", "{out}"
ONCE = {
    "models": ["models"],
    "predict lpf-1": ["predict", "lpf-1", "--target", "10"],
    "predict mujoco-1": ["predict", "mujoco-1", "--target", "10"],
    "evaluate lpf-1": ["evaluate", "lpf-1", "--quiet", "--out", OUT],
    "evaluate mujoco-1": ["evaluate", "mujoco-1", "--quiet", "--out", OUT],
    "simulate, plant lpf": ["simulate", "--plant", "lpf", "--motor", COMMAND, "--out", OUT],
    "simulate, plant mujoco": ["simulate", "--motor", COMMAND, "--out", OUT],
    "simulate, plant tavares": ["simulate", "--plant", "tavares", "--motor", COMMAND, "--out", OUT],
}
ROWS = "t_s,tau2_deg\n0,0\n0.02,14\n0.06,10\n0.5,10\n"
RUN_AND_LIST = """
import sys
from orient_eye.cli import main
try:
    main(sys.argv[2:])
finally:
    with open(sys.argv[1], "w") as file:
        file.writelines(f"{name}\\n" for name in sys.modules)
"""
IMPORT = """
import contextlib, importlib, sys
for name in open(sys.argv[1]).read().splitlines():
    with contextlib.suppress(ImportError):  # of modules that another's code makes
        importlib.import_module(name)
"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="How long one waits before anything happens.")
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    print(f"{f'least of {rounds}':30} {'wall [s]':>9} {'CPU [s]':>9}")
    for words, arguments in WAITS.items():
        wall, cpu = (min(told) for told in zip(*(seconds(arguments) for _ in range(rounds)), strict=True))
        print(f"{words:30} {wall:9.2f} {cpu:9.2f}", flush=True)
    print(f"\n{'':30} {'wall [s]':>9} {'CPU [s]':>9} {'imports alone, CPU [s]':>23} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "command.csv").write_text(ROWS)
        modules = str(folder / "modules.txt")
        for words, told in ONCE.items():
            seconds(["-c", RUN_AND_LIST, modules, *placed(told, folder)], caches(folder))
            own = [seconds([*RUN, *placed(told, folder)], caches(folder)) for _ in range(rounds)]
            alone = min(seconds(["-c", IMPORT, modules])[1] for _ in range(rounds))
            wall, cpu = (min(told) for told in zip(*own, strict=True))
            print(f"{words:30} {wall:9.2f} {cpu:9.2f} {alone:23.2f} {cpu / alone:6.2f}", flush=True)


def placed(told: Sequence[str], folder: Path) -> list[str]:
    """A command's arguments with its file, and with a new folder."""
    place = {COMMAND: str(folder / "command.csv"), OUT: tempfile.mkdtemp(dir=folder)}
    return [place.get(word, word) for word in told]


def caches(folder: Path) -> dict[str, str]:
    """Environment variables: an empty cache of ours, and one each of Numba and matplotlib for all that is run here."""
    kept = {"NUMBA_CACHE_DIR": str(folder / "numba"), "MPLCONFIGDIR": str(folder / "matplotlib")}
    return {"XDG_CACHE_HOME": tempfile.mkdtemp(dir=folder), **kept}


def seconds(arguments: Sequence[str], variables: Mapping[str, str] | None = None) -> tuple[float, float]:
    """Wall and CPU time [s] of a Python process with these arguments, and these environment variables added."""
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, *arguments], check=True, capture_output=True, env={**os.environ, **(variables or {})}
    )
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
