"""orient-eye models."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True)
class Models:
    """List the policies and surrogates that come with orient-eye.

    Their names are taken by `predict`, `evaluate` and `export`, and by `train --surrogate`.
    """

    def run(self) -> dict[str, Any]:
        """Read every manifest and print the tables."""
        from rich.table import Table

        from orient_eye.cli import say
        from orient_eye.learning.policy import shipped_policies
        from orient_eye.resources import data_folder

        policies = [_policy(name, folder) for name, folder in shipped_policies().items()]
        surrogates = [_surrogate(file.stem) for file in sorted(data_folder("models").glob("surrogates/*.json"))]
        table = Table("policy", "case", "plant", title="policies")
        for name in ("updates", "mean gap", "95th percentile", "k0 at 30 deg", "best k0"):
            table.add_column(name, justify="right")
        for row in policies:
            table.add_row(*(_text(row, key) for key in ("name", "case", "plant_in_words", "updates")), *_gaps(row))
        say(table if policies else "no policies are shipped; orient-eye train makes one")
        table = Table("surrogate", "K", r"w0 \[rad/s]", "motor", "source", title="surrogates")
        for row in surrogates:
            table.add_row(*(_text(row, key) for key in ("name", "K", "w0", "motor", "source")))
        say(table)
        for row in (*policies, *surrogates):
            if "error" in row:
                say(f"[red]{row['name']} is damaged[/red]: {row['error']}")
        return {"policies": policies, "surrogates": surrogates}


def _policy(name: str, folder: "Path") -> dict[str, Any]:
    from orient_eye.errors import InputError
    from orient_eye.learning.policy import Policy
    from orient_eye.plants import plant_in_words

    try:
        manifest = Policy.load(folder).manifest
    except InputError as error:
        return {"name": name, "error": str(error)}
    result = manifest.get("result", {})
    return {
        "name": name,
        "case": manifest.get("case"),
        "plant": manifest["task"]["plant"],
        "plant_in_words": plant_in_words(manifest["task"]["plant"]),
        **{key: result.get(key) for key in ("updates", "saccades", "pairs", "gap_mean", "gap_p95", "gap_max", "table")},
    }


def _surrogate(name: str) -> dict[str, Any]:
    from orient_eye.errors import InputError
    from orient_eye.surrogate import Surrogate

    try:
        found = Surrogate.load(name)
    except InputError as error:
        return {"name": name, "error": str(error)}
    return {"name": name, "K": found.K, "w0": found.w0, "motor": found.motor, "source": found.source}


def _text(row: dict[str, Any], key: str) -> str:
    value = row.get(key)
    return "" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _gaps(row: dict[str, Any]) -> list[str]:
    """Mean gap, its 95th percentile, and k0 of the 30 deg saccade beside the optimum's."""
    gaps = [row.get("gap_mean"), row.get("gap_p95")]
    at_30 = [(f"{r['k0']:.2f}", f"{r['k0_best']:.2f}") for r in row.get("table") or [] if r["amplitude_deg"] == 30]
    return [*("" if gap is None else f"{100 * gap:.2f} %" for gap in gaps), *(at_30[0] if at_30 else ())]
