"""What train and evaluate say of a policy that was held against the searched optimum."""

from collections.abc import Callable, Sequence
from typing import Any

from orient_eye.cli.tables import Row, column, number, say, table


def say_result(result: dict[str, Any]) -> None:
    """The table, the gaps and the failures, of a training's or an evaluation's result."""
    title = f"Learned actions | the best actions that a search found, on plant {result['plant']}."
    columns = {"amplitude": column("amplitude_deg", ".0f", " deg")}
    if "direction" in result["table"][0]:  # rewards compare: B and k0 mean nothing of a motor that hardly moves
        columns = {"direction": lambda row: row["direction"], **columns}
    else:
        motors: dict[str, list[str]] = {}
        for told in result["numbers"]:
            motors.setdefault(f"{told['label']} [{told['unit']}]", []).append(told["key"])
        columns |= {heading: _beside(keys, ".4g") for heading, keys in motors.items()}
    columns |= {
        "reward": _beside(["reward"], ".0f"),
        "gap": column("gap", ".2f", " %", 100),
        "settles in": column("duration_ms", ".0f", " ms"),
        "peak velocity": column("peak_velocity_deg_s", ".0f", " deg/s"),
    }
    say(table(title, columns, result["table"], left=("direction",)))
    say(
        f"mean reward gap to the searched optimum over {result['pairs']} random saccades: "
        f"{100 * result['gap_mean']:.2f} % (95th percentile {100 * result['gap_p95']:.2f} %)"
    )
    if result["failed_saccades"]:
        say(f"{result['failed_saccades']} simulated saccades failed and got the worst reward", "red")


def say_gaze(result: dict[str, Any]) -> None:
    """In all directions: where the gaze ends, how it goes there, and torsion; in brackets those of the best actions."""

    def told(key: str, form: str = ".2f", scale: int = 1) -> str:
        ours, best = (column(name, form, scale=scale)(result) for name in (key, f"{key}_best"))
        return f"{ours} ({best})"

    percent = (".1f", 100)
    say(
        f"gaze ends off by {told('gaze_error_mean_deg')} deg in the mean, {told('gaze_error_max_deg')} at most, when "
        f"it settles by {told('gaze_error_at_settling_mean_deg')}, {told('gaze_error_at_settling_max_deg')} at most; "
        "in brackets: of the best actions"
    )
    say(
        f"paths bend by {told('path_deviation_median', *percent)} % of the amplitude in the median, "
        f"{told('path_deviation_p95', *percent)} % at the 95th percentile; velocities of the components correlate by "
        f"{told('component_correlation_median', '.3f')}, at least {told('component_correlation_least', '.3f')}"
    )
    say(
        f"Listing's plane of the ends: sd {told('listing_sd_deg')} deg, twist {told('listing_twist')}, tilt "
        f"{told('listing_tilt_left_deg', '.1f')} deg left, {told('listing_tilt_down_deg', '.1f')} deg down; torsion "
        f"beside the way: {told('torsion_blip_median_deg')} deg in the median, {told('torsion_blip_max_deg')} at most"
    )
    longer = (number(result[f"stretching_{name}_median"], ".2f") for name in ("horizontal", "vertical"))
    say("components of oblique saccades last {} (horizontal) and {} (vertical) times as long as alone".format(*longer))


def _beside(keys: Sequence[str], form: str) -> Callable[[Row], str]:
    """Learned and best, a line a motor."""
    told = [(column(key, form), column(f"{key}_best", form)) for key in keys]
    return lambda row: "\n".join(f"{learned(row)} | {best(row)}" for learned, best in told)
