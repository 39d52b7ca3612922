"""Human saccades to hold ours against: the numbers of models/human/main_sequence.csv, each with its source.

human_values("peak_velocity", "Andersson et al. 2017")
human_values("duration_slope")[0].value          # ms/deg
people().peak_velocity([5, 10, 20])              # deg/s, fitted
"""

import csv
from dataclasses import dataclass
from functools import cache

from orient_eye.movement.main_sequence import MainSequence, fit_main_sequence
from orient_eye.resources import data_folder

REFERENCE = "Andersson et al. 2017"
"""The study in models/human that tells peak velocity, duration and acceleration of the same saccades."""


@dataclass(frozen=True)
class HumanValue:
    """A number somebody measured.

    Attributes:
        quantity: "peak_velocity", "peak_velocity_vertical", "duration", "acceleration_fraction" (time to peak
            velocity / duration), or "duration_intercept" and "duration_slope" of a line over all amplitudes.
        amplitude_deg: of the saccades; NaN where it is of all.
        value: in `unit`.
        spread: standard deviation between people or saccades, NaN where none is told.
        unit: deg/s, ms, ms/deg or 1.
        population: whose saccades, and how they were recorded.
        study: short name, "Collewijn et al. 1988".
        source: reference in words.
    """

    quantity: str
    amplitude_deg: float
    value: float
    spread: float
    unit: str
    population: str
    study: str
    source: str


@cache
def _table() -> tuple[HumanValue, ...]:
    def number(cell: str) -> float:
        return float(cell) if cell else float("nan")

    with (data_folder("models") / "human" / "main_sequence.csv").open(encoding="utf-8") as file:
        return tuple(
            HumanValue(
                row["quantity"], number(row["amplitude_deg"]), float(row["value"]), number(row["spread_sd"]),
                row["unit"], row["population"], row["study"], row["source"],
            )
            for row in csv.DictReader(file)
        )  # fmt: skip


def human_values(quantity: str, study: str | None = None) -> tuple[HumanValue, ...]:
    """The values of a quantity, of one study or of all, in the order of the table."""
    return tuple(row for row in _table() if row.quantity == quantity and study in (None, row.study))


def studies(*quantities: str) -> tuple[str, ...]:
    """Studies that tell of one of these quantities, or of any, in the order of the table."""
    return tuple(dict.fromkeys(row.study for row in _table() if not quantities or row.quantity in quantities))


def people() -> MainSequence:
    """The main sequence of people, fitted to the values of the reference study."""
    peak, duration = human_values("peak_velocity", REFERENCE), human_values("duration", REFERENCE)
    amplitude = [row.amplitude_deg for row in peak]
    return fit_main_sequence(amplitude, [row.value for row in peak], [1e-3 * row.value for row in duration])
