"""How long one waits before anything happens: whole processes, medians.

python benchmarks/startup.py
"""

import statistics
import subprocess
import sys
import time

ROUNDS = 7
MAKE = "import gymnasium, orient_eye; gymnasium.make('OrientEye/Saccade-v0', plant='{}')"
WAITS = {
    "python, nothing else": ["-c", "pass"],
    "import gymnasium": ["-c", "import gymnasium"],
    "import orient_eye": ["-c", "import orient_eye"],
    "orient-eye --help": ["-m", "orient_eye", "--help"],
    "orient-eye train --help": ["-m", "orient_eye", "train", "--help"],
    "gymnasium.make, plant lpf": ["-c", MAKE.format("lpf")],
    "gymnasium.make, plant mujoco": ["-c", MAKE.format("mujoco")],
}


def main() -> None:
    """Measure and print."""
    for words, arguments in WAITS.items():
        taken = []
        for _ in range(ROUNDS):
            began = time.perf_counter()
            subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
            taken.append(time.perf_counter() - began)
        print(f"{words:30} {statistics.median(taken):6.2f} s   {min(taken):.2f} to {max(taken):.2f}")


if __name__ == "__main__":
    main()
