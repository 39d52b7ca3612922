"""The whole road on somebody's own rig: recorded steps, sysid, train, predict, and the command on the true rig.

The rigs are `tests/rig_simulator.py`, which shares no code with the plants. One of each kind here; `make rigs` tries
ten of each. "Predicted" is the settling time, at 2 % of the amplitude, of the saccade on the plant that was learned on.
What play leaves open widens the error that is granted, and by half of it to either side the band of settling.
"""

import csv
import json
import os
from pathlib import Path

import numpy as np
import pytest

from orient_eye.cli.options import parse
from orient_eye.cli.predict import Predict
from orient_eye.cli.sysid import Sysid
from orient_eye.cli.train import Train
from orient_eye.learning.policy import Policy
from orient_eye.sysid import report
from orient_eye.task.targets import saccades
from rig_simulator import KINDS, TrueRig, draw_rig

RIGS = int(os.environ.get("RIGS", "1"))
"""How many rigs of each kind."""
SIZES_DEG = (5.0, 10.0, 20.0, 30.0, 40.0)
QUICK = () if RIGS > 1 else ("--updates", "1500", "--evaluation-pairs", "6")


pytestmark = pytest.mark.usefixtures("private_cache", *(() if RIGS > 1 else ("plain", "no_sysid_pictures")))


@pytest.fixture
def no_sysid_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half of an identification; tests/test_prototype_road.py draws on its road."""
    monkeypatch.setattr(report, "_pictures", lambda *_: [])
    monkeypatch.setattr(report, "_recording", lambda *_: [])


def ends(limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Starts and targets [deg]: each size both ways around straight ahead, and from one end of the range."""
    pairs = []
    for k, size in enumerate(SIZES_DEG):
        far = limit - size if k % 2 else -limit
        pairs += [(-size / 2, size / 2), (size / 2, -size / 2), (far, far + size)]
    start, target = np.array(pairs).T
    return start, target


def learned(rig: TrueRig, folder: Path) -> Path:
    """The policy of a rig, from its recordings, by the commands that its owner would give."""
    description = rig.describe(folder / "rig.toml")
    recordings = [str(path) for path in rig.record(folder / "steps")]
    parse(
        Sysid,
        ["--recording", *recordings, "--rig", str(description), "--axis", rig.axis, "--out", str(folder / "sysid")],
    ).run()
    surrogate = str(folder / "sysid" / "surrogate.json")
    parse(Train, ["--surrogate", surrogate, "--out", str(folder / "run"), "--quiet", *QUICK]).run()
    return folder / "run"


def commands(rig: TrueRig, run: Path, start: np.ndarray, target: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Times and motor positions [deg] of the files that predict writes for the rig's driver."""
    folder = run.parent
    rows = "\n".join(f"{a},{b}" for a, b in zip(start, target, strict=True))
    pairs = folder / "pairs.csv"
    pairs.write_text(f"start_{rig.axis}_deg,target_{rig.axis}_deg\n{rows}\n", encoding="utf-8")
    options = ["--rig", str(folder / "rig.toml"), "--pairs", str(pairs), "--commands", str(folder / "commands")]
    parse(Predict, [str(run), *options]).run()
    files = sorted(path for path in (folder / "commands").glob("*.csv") if path.name != "index.csv")
    assert len(files) == len(start)
    found = []
    for file in files:
        with file.open(encoding="utf-8", newline="") as lines:
            table = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        numbers = np.array([float(row[rig.column]) for row in table])
        found.append((np.array([float(row["t_s"]) for row in table]), rig.from_driver(numbers)))
    return found


def fast_enough(rig: TrueRig, time: np.ndarray, motor: np.ndarray) -> bool:
    """Whether a command keeps the motor's limits, of a motor that stands before its first row."""
    step = time[1] - time[0]
    speed = np.diff(motor, prepend=motor[0]) / step
    hardest = np.inf if rig.acceleration is None else rig.acceleration
    slack = 1 + 1e-3  # files are rounded
    # Of a driver in counts to whole ones, each by half a count: up to two counts in a second difference.
    count = 0.0 if rig.counts_per_deg is None else 1 / rig.counts_per_deg
    acceleration = np.abs(np.diff(speed, prepend=0.0)).max() / step
    return bool(
        np.abs(motor).max() <= rig.reach * slack
        and np.abs(speed).max() <= rig.speed * slack
        and acceleration <= hardest * slack + 2 * count / step**2
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(RIGS))
@pytest.mark.parametrize("kind", KINDS)
def test_from_recorded_steps_to_a_command_that_a_true_rig_performs(kind: str, seed: int, tmp_path: Path) -> None:
    """What play leaves open is open at both ends: where the eye is held, and the gain that steps over it tell."""
    rig = draw_rig(kind, seed)
    run = learned(rig, tmp_path)
    task = Policy.load(run).task()
    start, target = ends(task.targets.limit_deg)
    state, wanted = saccades(task.targets, start[:, None], target[:, None])
    action = Policy.load(run).act(state.orientation, wanted)
    predicted = task.perform(state, action, wanted).movement.measure(0.02).settling_time_s
    result = json.loads((run / "result.json").read_text())
    worst = np.zeros(3)
    left_open = rig.K * rig.play
    failures = []
    for k, (time, motor) in enumerate(commands(rig, run, start, target)):
        at, _, eye = rig.perform(time, motor, k, time[-1] + 0.5)
        size, way = abs(target[k] - start[k]), eye[-1] - eye[0]
        error = abs(eye[-1] - target[k])
        overshoot = ((eye - eye[-1]) * np.sign(way)).max() / abs(way)
        outside = np.abs(eye - eye[-1]) > 0.02 * abs(way) + left_open / 2
        settling = at[np.flatnonzero(outside)[-1] + 1]
        worst = np.maximum(worst, [error, overshoot, settling / predicted[k]])
        told = f"{start[k]:g} to {target[k]:g} deg"
        if error > max(0.5, 0.03 * size) + left_open:
            failures.append(f"{told}: ends {error:.2f} deg off")
        if overshoot > 0.03:
            failures.append(f"{told}: overshoots by {overshoot:.1%}")
        if settling > 1.3 * predicted[k]:
            failures.append(f"{told}: settles in {1e3 * settling:.0f} ms, predicted {1e3 * predicted[k]:.0f}")
        if not fast_enough(rig, time, motor):
            failures.append(f"{told}: breaks a limit of the motor")
    print(
        f"{rig.name}: gap {result['gap_mean']:.1%}; at worst {worst[0]:.2f} deg off, overshoot {worst[1]:.1%}, "
        f"settles in {worst[2]:.2f} of what was predicted"
    )
    assert not failures, f"{rig}: {failures}"
