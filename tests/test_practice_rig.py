"""The walk-through of docs/rigs.md on the rig of scripts/practice_rig.py, up to what sysid finds there."""

from pathlib import Path

import numpy as np
import pytest

from orient_eye.cli.options import parse
from orient_eye.cli.sysid import Sysid
from orient_eye.errors import InputError
from orient_eye.surrogate import Surrogate
from practice_rig import Eye, main, perform

PAGE = Path(__file__).resolve().parents[1] / "docs" / "rigs.md"


def test_what_the_page_describes_plans_and_finds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = PAGE.read_text(encoding="utf-8")
    Path("rig.toml").write_text(page.split("```toml\n")[1].split("```")[0], encoding="utf-8")
    lines = [line.split() for line in page.splitlines() if line.startswith("    orient-eye sysid ")]
    planned = parse(Sysid, lines[0][2:]).run()
    assert [row["until_s"] for row in planned["steps"]] == pytest.approx([2.615] * 6)
    main(Path("recorded"), tuple(sorted(Path("plan").glob("step_*.csv"))))
    recorded = [str(path) for path in sorted(Path("recorded").glob("*.csv"))]
    told = [word for word in lines[1][2:] if word != "recorded/*.csv"]
    at = told.index("--recording") + 1
    parse(Sysid, [*told[:at], *recorded, *told[at:]]).run()
    found = Surrogate.load(Path("runs/bench/surrogate.json"))
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.count("|") == 4 and "±" in line]
    for (name, true, printed), number in zip(rows, ("K", "wn", "zeta", "dead_time"), strict=False):
        value, width = (float(x) for x in printed.split(" ± "))
        scale = 1e3 if number == "dead_time" else 1
        assert scale * getattr(found, number) == pytest.approx(
            value, abs=0.6 * 10 ** -len(printed.split()[0].split(".")[1])
        )
        low, high = found.intervals[number]
        assert scale * (high - low) / 2 == pytest.approx(width, rel=0.5), name
        assert (
            float(true) == {"K": Eye.gain, "wn": Eye.wn, "zeta": Eye.zeta, "dead_time": 1e3 * Eye.dead_time_s}[number]
        )


def test_another_rigs_command_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.csv").write_text("t_s,servo_deg\n0,0\n1,1\n")
    with pytest.raises(InputError, match="left_counts"):
        perform(tmp_path / "other.csv", Eye(), np.random.default_rng(0))
