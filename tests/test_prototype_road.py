"""The prototype's road up to the command: its logs, sysid, train, and what the motors' drivers are sent.

With logs that a simulated rig made in the prototype's form, and with its own, which have no licence and are no part of
this project.
"""

import csv
from pathlib import Path

import numpy as np
import pytest

from make_prototype_log import Rig as MadeRig
from make_prototype_log import make_logs, text
from orient_eye.cli.options import parse
from orient_eye.cli.predict import Predict
from orient_eye.cli.simulate import Simulate
from orient_eye.cli.sysid import Sysid
from orient_eye.cli.train import Train
from orient_eye.surrogate import Surrogate

PROTOTYPE = Path(__file__).resolve().parents[2] / "shared" / "data" / "prototype_steps"
COUNT_DEG = 90 / 1024


def logs(source: str, folder: Path) -> list[Path]:
    if source == "the prototype's":
        return sorted(PROTOTYPE.glob("*.txt"))
    paths = []
    for step, table in zip(
        (17.5, 35.0, 52.5), make_logs(MadeRig(), (17.5, 35.0, 52.5), np.random.default_rng(0), 100, 0), strict=True
    ):
        paths.append(folder / f"made_{step:g}.txt")
        paths[-1].write_text(text(table), encoding="utf-8")
    return paths


@pytest.mark.slow
@pytest.mark.parametrize(
    ("source", "K"),
    [
        ("made", (0.745, 0.755)),
        pytest.param(
            "the prototype's",
            (0.73, 0.755),
            marks=pytest.mark.skipif(not PROTOTYPE.is_dir(), reason="the prototype's logs are not here"),
        ),
    ],
)
def test_from_the_logs_to_a_command(
    source: str, K: tuple[float, float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    files = [str(path) for path in logs(source, tmp_path)]
    surrogate = tmp_path / "sysid" / "surrogate.json"
    parse(Sysid, ["--recording", *files, "--rig", "prototype", "--out", str(surrogate.parent)]).run()
    eye = Surrogate.load(surrogate)
    assert K[0] < eye.K < K[1]
    assert (eye.motor, eye.axis, eye.range, eye.speed_limit) == ("motor1 + motor3", "pitch", (-90, 90), 698)
    assert 60 < (eye.wn or 0) < 120
    assert 0.003 < eye.dead_time < 0.02

    run, command = tmp_path / "run", tmp_path / "up.csv"
    quick = ["--updates", "20", "--warmup", "256", "--evaluation-pairs", "2", "--quiet"]
    parse(Train, ["--surrogate", str(surrogate), "--out", str(run), *quick]).run()
    asked = [str(run), "--rig", "prototype", "--target", "-15", "--command", str(command)]
    (told,) = parse(Predict, asked).run()["saccades"]
    with command.open(encoding="utf-8", newline="") as rows:
        table = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(rows)]
    assert list(table[0]) == ["t_s", "motor1_counts", "motor2_counts", "motor3_counts"]
    time, first, second, third = np.array([list(row.values()) for row in table]).T
    np.testing.assert_allclose(np.diff(time), 0.01)
    assert (second == 512).all()
    np.testing.assert_array_equal(first - 512, 512 - third)  # motor 1 counts the other way, and both turn the eye
    drive = (512 - first) * COUNT_DEG + (third - 512) * COUNT_DEG
    for counts in (first, third):
        np.testing.assert_array_equal(counts, counts.round())
        assert (np.abs(np.diff(counts)) * COUNT_DEG / 0.01 <= 349 + 1e-6).all()
    assert drive[0] == 0
    assert drive[-1] == pytest.approx(told["D_deg"], abs=COUNT_DEG + 1e-6)

    back = ["--motor", str(command), "--plant", "lpf", "--surrogate", str(surrogate), "--rig", "prototype"]
    moved = parse(Simulate, [*back, "--horizon", "1.5", "--out", str(tmp_path / "sim")]).run()
    assert moved["final_yaw_pitch_roll_deg"][1] == pytest.approx(eye.K * drive[-1], abs=0.02)
    assert moved["final_yaw_pitch_roll_deg"][1] == pytest.approx(told["final_pitch_deg"], abs=0.3)
