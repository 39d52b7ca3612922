"""How human saccades are: the main sequence of each policy over that of people, both by a velocity threshold."""

from dataclasses import dataclass
from typing import Any

import altair as alt
import numpy as np
from numpy.typing import NDArray

from orient_eye.human import REFERENCE, human_values, people, studies
from orient_eye.movement.main_sequence import MainSequence, fit_main_sequence
from orient_eye.report.evidence import Evidence, Judged
from orient_eye.report.exhibit import Drawn, Exhibit
from orient_eye.report.page import Table
from orient_eye.search.human_like import AT_DEG

Array = NDArray[np.float64]
_CLOSE, _NEAR = 0.1, 0.25


@dataclass(frozen=True)
class Likeness:
    """A policy's main sequence beside people's.

    Attributes:
        name: plant and case.
        fit: of its saccades around straight ahead, by a velocity threshold.
        peak_velocity: over people's at `AT_DEG`, 1 for the same.
        duration: the same, by the velocity threshold.
        acceleration_share: of the duration, at `AT_DEG`.
        settling_ms: the thesis' duration at `AT_DEG`.
    """

    name: str
    fit: MainSequence
    peak_velocity: Array
    duration: Array
    acceleration_share: Array
    settling_ms: Array

    @classmethod
    def of(cls, judged: Judged) -> "Likeness":
        """Of a policy."""
        made, bout, human = judged.sizes, judged.bout, people()
        size, measures = made.size_deg, judged.measures

        def at(values: Array) -> Array:
            return np.interp(AT_DEG, size, values, right=np.nan)

        return cls(
            judged.title,
            fit_main_sequence(measures.amplitude_deg, bout.peak_velocity_deg_s, bout.duration_s),
            at(bout.peak_velocity_deg_s) / human.peak_velocity(AT_DEG),
            at(1e3 * bout.duration_s) / human.duration_ms(AT_DEG),
            at(bout.acceleration_share),
            at(1e3 * measures.settling_time_s),
        )

    @property
    def off(self) -> float:
        """The largest factor by which it is off, as a logarithm; of the amplitudes that there are."""
        return float(np.nanmax(np.abs(np.log([*self.peak_velocity, *self.duration]))))

    @property
    def verdict(self) -> str:
        """Where it is like people and where not, in words."""
        found = []
        for what, ratio in (("fast", self.peak_velocity), ("long", self.duration)):
            off = np.abs(ratio[np.isfinite(ratio)] - 1)
            if (off <= _CLOSE).all():
                found.append(f"as {what} as people")
            elif (off <= _NEAR).all():
                found.append(f"nearly as {what} as people")
            else:
                worst = int(np.nanargmax(np.abs(np.log(ratio))))
                found.append(f"{ratio[worst]:.2g} times as {what} as people at {AT_DEG[worst]:g} deg")
        at_10 = float(self.acceleration_share[AT_DEG.index(10.0)])
        return "; ".join([*found, f"accelerates for {at_10:.2f} of it (people 0.41 to 0.29)"])

    def row(self) -> dict[str, Any]:
        """Plain values, for a table."""
        told = {"policy": self.name, "V0_deg_s": self.fit.V0, "c_deg": self.fit.c, "D0_ms": self.fit.D0_ms}
        told |= {"d_ms_per_deg": self.fit.d_ms, "k": self.fit.k}
        for key in ("peak_velocity", "duration"):
            told |= {f"{key}_over_people_{a:g}_deg": float(v) for a, v in zip(AT_DEG, getattr(self, key), strict=True)}
        for key in ("acceleration_share", "settling_ms"):
            told |= {f"{key}_{a:g}_deg": float(v) for a, v in zip(AT_DEG, getattr(self, key), strict=True)}
        return told | {"verdict": self.verdict}


def likenesses(evidence: Evidence) -> list[Likeness]:
    """Of all policies."""
    return [Likeness.of(evidence.judged(name)) for name in evidence.names()]


def _rows(evidence: Evidence) -> list[dict[str, Any]]:
    """Peak velocity and duration of policies and of people, one row a value."""
    rows = []
    for name in evidence.names():
        judged = evidence.judged(name)
        values = zip(judged.sizes.size_deg, judged.bout.peak_velocity_deg_s, 1e3 * judged.bout.duration_s, strict=True)
        rows += [{"who": judged.title, "deg": a, "velocity": v, "ms": d} for a, v, d in values]
    return rows


def _main_sequences(evidence: Evidence) -> Drawn:
    """All main sequences over those of people; a click in the legend shows one alone."""
    ours = {"values": _rows(evidence)}
    human = [
        {"who": f"people: {study}", "deg": row.amplitude_deg, key: row.value, "source": row.source}
        for study in studies("peak_velocity", "duration")
        for quantity, key in (("peak_velocity", "velocity"), ("duration", "ms"))
        for row in human_values(quantity, study)
    ]
    chosen = alt.selection_point(fields=["who"], bind="legend")
    panels = []
    for key, title in (("velocity", "peak velocity [deg/s]"), ("ms", "duration above 30 deg/s [ms]")):
        x = alt.X("deg:Q", title="amplitude [deg]", scale=alt.Scale(domain=[0, 60]))
        y = alt.Y(f"{key}:Q", title=title)
        shade = alt.condition(chosen, alt.value(1.0), alt.value(0.08))
        tooltip = [
            alt.Tooltip("who:N"),
            alt.Tooltip("deg:Q", format=".3g"),
            alt.Tooltip(f"{key}:Q", format=".3g", title=title),
        ]
        lines = (
            alt.Chart(ours)
            .mark_line(point=True, clip=True)
            .encode(x=x, y=y, color=alt.Color("who:N", title="policy"), opacity=shade, tooltip=tooltip)
        )
        points = (
            alt.Chart({"values": [row for row in human if key in row]})
            .mark_point(size=60, filled=True, color="#555")
            .encode(x=x, y=y, shape=alt.Shape("who:N", title="people"), tooltip=[*tooltip, alt.Tooltip("source:N")])
        )
        panels.append((lines + points).properties(width=520, height=300))
    panels[0] = panels[0].add_params(chosen)
    chart = alt.vconcat(*panels).resolve_scale(shape="shared", color="shared")
    near = min(likenesses(evidence), key=lambda one: one.off)
    return Drawn(chart, f"From 5 to 20 deg nearest to people is {near.name}: {near.verdict}.")


def human_table(rows: list[dict[str, Any]]) -> list[Table]:
    """The rows of all policies and of people as a table of the page; none of no rows."""
    if not rows:
        return []
    human = people()
    at = [f"{a:g}" for a in AT_DEG]
    share = human_values("acceleration_fraction", REFERENCE)
    ends = (
        f"{share[0].value:.2f} at {share[0].amplitude_deg:g} deg, {share[-1].value:.2f} at {share[-1].amplitude_deg:g}"
    )

    def beside(row: dict[str, Any], key: str, end: str, form: str) -> str:
        return " / ".join(f"{row[f'{key}{end}_{a}_deg']:{form}}" for a in at)

    cells = [
        [
            row["policy"], f"{row['V0_deg_s']:.0f}", f"{row['c_deg']:.1f}",
            f"{row['D0_ms']:.0f} + {row['d_ms_per_deg']:.1f} A",
            f"{row['k']:.2f}", beside(row, "peak_velocity", "_over_people", ".2f"),
            beside(row, "duration", "_over_people", ".2f"),
            beside(row, "acceleration_share", "", ".2f"), beside(row, "settling_ms", "", ".0f"), row["verdict"],
        ]
        for row in rows
    ]  # fmt: skip
    cells.insert(0, [
        f"people ({REFERENCE})", f"{human.V0:.0f}", f"{human.c:.1f}", f"{human.D0_ms:.0f} + {human.d_ms:.1f} A",
        f"{human.k:.2f}", "1", "1", ends, "-", "",
    ])  # fmt: skip
    columns = [
        "policy", "V0 [deg/s]", "c [deg]", "D [ms]", "V D / A", f"V over people's at {'/'.join(at)} deg",
        f"D over people's at {'/'.join(at)} deg", "share of acceleration", "settles in [ms]", "verdict",
    ]  # fmt: skip
    note = (
        "V = V0 (1 - exp(-A/c)) and D are fitted to saccades around straight ahead, both measured above 30 deg/s; "
        "'settles in' is the thesis' duration, until the eye stays within 1 % of its end. The verdict is of 5 to 20 "
        "deg. People differ: Hopf et al. (2018) measured 352 deg/s at 15 deg in 100 people by video at 220 Hz, "
        "Andersson et al. (2017) 460 at 13.5 deg at 500 Hz, Collewijn et al. (1988) 502 at 40 deg."
    )
    return [Table(EXHIBITS["human"].chapter, columns, cells, note)]


EXHIBITS = {
    "human": Exhibit(
        "How human they are",
        "Main sequences of all policies over those of people",
        "Speed and duration are measured as those of people are: while the eye is faster than 30 deg/s. Click a name "
        "in the legend to see it alone, point at a mark for its numbers and its source. The table below tells the "
        "same in numbers.",
        _main_sequences,
    )
}
