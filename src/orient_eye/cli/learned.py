"""What train and evaluate say of a policy that was held against the searched optimum."""

from typing import Any

from orient_eye.cli.tables import column, say, table


def say_result(result: dict[str, Any]) -> None:
    """The table, the gaps and the failures, of a training's or an evaluation's result."""
    title = f"Learned actions | the best actions that a search found, on plant {result['plant']}."
    columns = {"amplitude": column("amplitude_deg", ".0f", " deg")}
    for told in result["numbers"]:
        columns[f"{told['label']} [{told['unit']}]"] = _beside(told["key"], ".4g")
    columns |= {
        "reward": _beside("reward", ".0f"),
        "gap": column("gap", ".2f", " %", 100),
        "settles in": column("duration_ms", ".0f", " ms"),
        "peak velocity": column("peak_velocity_deg_s", ".0f", " deg/s"),
    }
    say(table(title, columns, result["table"]))
    say(
        f"mean reward gap to the searched optimum over {result['pairs']} random saccades: "
        f"{100 * result['gap_mean']:.2f} % (95th percentile {100 * result['gap_p95']:.2f} %)"
    )
    if result["failed_saccades"]:
        say(f"{result['failed_saccades']} simulated saccades failed and got the worst reward", "red")


def _beside(key: str, form: str) -> Any:
    learned, best = column(key, form), column(f"{key}_best", form)
    return lambda row: f"{learned(row)} | {best(row)}"
