"""orient-eye compare."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

if TYPE_CHECKING:
    from orient_eye.learning.compared import Compared

_USUAL = tyro.conf.arg(help_behavior_hint="(default: a usual name)")


@dataclass(frozen=True)
class Compare:
    """Hold a recording of gaze, a person's or another robot's, against the main sequence of a policy.

    TABLE is CSV, TSV or Parquet with columns of time and gaze in deg, or a recording by BIDS (NAME_physio.tsv.gz
    beside its NAME_physio.json). Its rate is found; missing samples are gaps. Saccades are what is faster than a
    threshold; the policy's, of the same amplitudes, are sampled and found alike. Leaves a run directory: result.json,
    saccades.csv and a picture, main_sequence.png.

    $ orient-eye compare gaze.csv --policy lpf-human --time t --x gaze_x --y gaze_y --time-unit ms

    $ orient-eye compare dataset/sub-01/beh/sub-01_task-saccade_recording-eye1_physio.tsv.gz --policy lpf-1
    """

    table: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="TABLE")]
    """Recording of gaze."""
    policy: str
    """Run directory, policy folder, or name of a shipped policy."""
    time: Annotated[str | None, _USUAL] = None
    """Column of time: t_s, timestamp, time or t."""
    x: Annotated[str | None, _USUAL] = None
    """Column of horizontal gaze, deg: x_coordinate, x_deg or x."""
    y: Annotated[str | None, tyro.conf.arg(help_behavior_hint="(default: a usual name, else horizontal)")] = None
    """Column of vertical gaze, deg: y_coordinate, y_deg or y."""
    time_unit: Literal["s", "ms", "us"] = "s"
    """Unit of time."""
    threshold: float = 30.0
    """Speed above which gaze makes a saccade, deg/s."""
    least: float = 1.0
    """Smaller saccades are left out, deg."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/compare-DATE-TIME)")] = None
    """Run directory, new or empty."""

    def run(self) -> dict[str, Any]:
        """Read, find, compare, and write the run directory."""
        from dataclasses import asdict

        from orient_eye.checks import real
        from orient_eye.cli.tables import say
        from orient_eye.exchange.eye_tables import GazeColumns, probably_radians, read_gaze
        from orient_eye.figures import save
        from orient_eye.figures.main_sequence import beside
        from orient_eye.files import write_table
        from orient_eye.human import REFERENCE
        from orient_eye.learning.compared import compare
        from orient_eye.learning.policy import Policy
        from orient_eye.run_directory import RunDirectory

        real("--threshold", self.threshold, 1, 1000, unit="deg/s", advice="30 is usual")
        real("--least", self.least, 0, 90, unit="deg")
        policy = Policy.load(self.policy)
        task = policy.task()
        record = read_gaze(self.table, GazeColumns(self.time, self.x, self.y, self.time_unit))
        if asked := probably_radians(record):
            say(f"note: {self.table}: {asked}", "yellow")
        found = compare(record, task, policy, self.threshold, self.least)
        run = RunDirectory.create(self.out, "compare", self)
        names = {"recording": self.table.name, "policy": self.policy, "people": f"people ({REFERENCE})"}
        recording = found.of["recording"]
        result = {
            "out": str(run.path),
            "table": str(self.table),
            "policy": self.policy,
            "rate_hz": record.rate_hz,
            "lasts_s": float(record.time[-1] - record.time[0]),
            "saccades": len(recording),
            "left_out": recording.left_out,
            "fits": {who: asdict(fit) for who, fit in found.fit.items()},
            "at": found.rows(),
        }
        write_table(run.path / "saccades.csv", found.saccade_rows())
        save(beside(found.of, found.fit, names), run.path / "main_sequence.png")
        run.write_json("result.json", result)
        left_out = "; ".join(f"{count} {why}" for why, count in recording.left_out.items() if count)
        say(
            f"{len(recording)} saccades in {result['lasts_s']:.1f} s at {record.rate_hz:.4g} Hz"
            + (f"; left out: {left_out}" if left_out else "")
        )
        _say(found, names)
        say(f"in {run.path}: result.json, saccades.csv, main_sequence.png")
        return result


def _say(found: "Compared", names: dict[str, str]) -> None:
    from orient_eye.cli.tables import column, number, say, table

    fits = [{"of": names[who], "fit": fit} for who, fit in found.fit.items()]
    columns = {
        "of": lambda row: row["of"],
        "V0 [deg/s]": lambda row: number(row["fit"].V0, ".0f"),
        "c [deg]": lambda row: number(row["fit"].c, ".1f"),
        "duration [ms]": lambda row: f"{row['fit'].D0_ms:.1f} + {row['fit'].d_ms:.2f} A",
        "V D / A": lambda row: number(row["fit"].k, ".2f"),
    }
    say(table("Main sequence: V = V0 (1 - exp(-A / c)), D = D0 + d A.", columns, fits, left=("of",)))
    rows = found.rows()
    if not rows:
        return
    told = {"amplitude": column("amplitude_deg", ".0f", " deg"), "recorded": column("recorded", "d")}
    for what, key in (("V [deg/s]", "peak_velocity_deg_s"), ("D [ms]", "duration_ms")):
        told |= {f"{what}, {who}": column(f"{who}_{key}", ".0f") for who in found.fit}
    say(table("Saccades of these amplitudes: medians of the recording, the policy's, people's fit.", told, rows))
