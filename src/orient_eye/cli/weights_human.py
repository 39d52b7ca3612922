"""The `--human` of orient-eye weights: the weights whose best saccades have people's main sequence."""

from collections.abc import Sequence
from math import nan
from typing import TYPE_CHECKING, Any

from orient_eye.errors import InputError

if TYPE_CHECKING:
    from orient_eye.movement.main_sequence import MainSequence
    from orient_eye.plants import Plant
    from orient_eye.task.targets import Targets

_PULSES = (("1", None), ("2", None), ("2", "varying"), ("3", None), ("3", "varying"))
_JUDGES = ("orientation", "impatient")
_B = (18.0, 300.0)


def nearest_to_people(
    plant: "Plant", targets: "Targets", like: Sequence[float] | None, band: float, *, quiet: bool
) -> dict[str, Any]:
    """Search every pulse with the thesis' discount rate and with a larger one, and print the table.

    Args:
        plant: the eye.
        targets: about one axis.
        like: V0 [deg/s], c [deg], D0 [ms] and d [ms/deg] of the wanted main sequence; None for people's.
        band: settling band.
        quiet: show no progress bar.

    Raises:
        InputError: numbers of a main sequence that are none, or targets that are not about one axis.
    """
    import numpy as np

    from orient_eye.cli.tables import say, table
    from orient_eye.human import REFERENCE, people
    from orient_eye.progress import progress_bar
    from orient_eye.search.human_like import AT_DEG, nearest
    from orient_eye.task.cases import Case
    from orient_eye.task.judge import DISCOUNT, IMPATIENT_DISCOUNT
    from orient_eye.task.saccade import SaccadeTask

    wanted, whose = (people(), f"people ({REFERENCE})") if like is None else (_wanted(like), "the given one")
    rates = {"orientation": DISCOUNT, "impatient": IMPATIENT_DISCOUNT}
    tried = [(judge, Case(pulse, C, B=_B)) for judge in _JUDGES for pulse, C in _PULSES]
    rows = []
    with progress_bar("searching the weights", quiet=quiet) as advance:
        for i, (judge, case) in enumerate(tried):
            usual = SaccadeTask.of_case(plant, Case(case.pulse, case.C), targets=targets, band=band)
            weights = dict(usual.weights)
            weights["duration"] *= rates["orientation"] / rates[judge]  # the same for short saccades
            task = SaccadeTask.of_case(plant, case, targets=targets, judge=judge, weights=weights, band=band)

            def shown(share: float, done: int = i) -> None:
                advance((done + share) / len(tried))

            found = nearest(task, wanted, np.random.default_rng(0), progress=shown)
            rows.append(
                {
                    "pulse": case.pulse + ("" if case.C is None else ", C varying"),
                    "discount_1_s": rates[judge],
                    "judge": judge,
                    "weights": dict(found.task.weights),
                    "amplitude_deg": list(AT_DEG),
                    "peak_velocity_over_wanted": found.peak_velocity.tolist(),
                    "duration_over_wanted": found.duration.tolist(),
                    "acceleration_share": found.acceleration_share.tolist(),
                    "B": found.action[:, 0].tolist(),
                    "motor_speed_deg_s": found.motor_speed_deg_s,
                    "off": found.off,
                    "prevents": found.prevents,
                }
            )
    rows.sort(key=lambda row: row["off"])
    at = "/".join(f"{a:g}" for a in AT_DEG)

    def beside(key: str) -> Any:
        return lambda row: " / ".join(f"{value:.2f}" for value in row[key])

    columns = {
        "pulse": lambda row: row["pulse"],
        "discount\n[1/s]": lambda row: f"{row['discount_1_s']:g}",
        "lambda_a, _d, _o": lambda row: ", ".join(
            f"{row['weights'][name]:.2e}".replace("e+0", "e") for name in ("accuracy", "duration", "overshoot")
        ),
        f"V over wanted\nat {at} deg": beside("peak_velocity_over_wanted"),
        "D over wanted": beside("duration_over_wanted"),
        "share of\nacceleration": beside("acceleration_share"),
        "motor\n[deg/s]": lambda row: f"{row['motor_speed_deg_s']:.0f}",
        "what keeps it from being nearer": lambda row: row["prevents"],
    }
    title = (
        f"Weights whose best saccades on plant {plant.name} have the main sequence nearest to {whose}; lambda_e is "
        f"1, B from {_B[0]:g} to {_B[1]:g} 1/s."
    )
    say(table(title, columns, rows, left=("pulse", "what keeps it from being nearer")))
    if like is None:
        say("orient-eye train --case human trains with the best that was found on the thesis' eyes (docs/human.md)")
    told = {key: getattr(wanted, key) for key in ("V0", "c", "D0_ms", "d_ms")}
    return {"plant": plant.identity(), "wanted": told, "found": rows}


def _wanted(like: Sequence[float]) -> "MainSequence":
    from orient_eye.checks import real
    from orient_eye.movement.main_sequence import MainSequence

    if len(like) != 4:
        raise InputError(
            "--like takes four numbers, V0 [deg/s], c [deg], D0 [ms] and d [ms/deg] of your main sequence, got "
            f"{len(like)}"
        )
    V0 = real("V0 of --like", like[0], 1, 1e4, unit="deg/s")
    c = real("c of --like", like[1], 0.1, 1000, unit="deg")
    D0 = real("D0 of --like", like[2], 0, 1000, unit="ms")
    d = real("d of --like", like[3], 0, 100, unit="ms/deg")
    return MainSequence(V0, c, D0, d, k=nan, V_r2=nan, D_r2=nan, k_spread=nan)
