"""orient-eye models."""

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

_NUMBERS = {"K": "", "w0": "[rad/s]", "wn": "[rad/s]", "zeta": "", "dead_time": "[s]"}


@dataclass(frozen=True)
class Models:
    """List the policies and surrogates that come with orient-eye.

    Their names are taken by `predict`, `evaluate`, `listing` and `export`, and by `--surrogate`.
    """

    def run(self) -> dict[str, Any]:
        """Read every manifest and print the tables."""
        from orient_eye.cli.tables import column, number, say, table
        from orient_eye.learning.policy import shipped_policies
        from orient_eye.modal_surrogate import shipped_modal_surrogates
        from orient_eye.surrogate import shipped_surrogates

        policies = [_policy(name, folder) for name, folder in shipped_policies().items()]
        surrogates = [_surrogate(name) for name in shipped_surrogates()]
        in_3d = [_in_3d(name) for name in shipped_modal_surrogates()]
        words = {
            key: (lambda row, key=key: str(row.get(key) or ""))
            for key in ("name", "targets", "case", "motor", "source")
        }
        columns = {
            "policy": words["name"],
            "targets": words["targets"],
            "case": words["case"],
            "plant": lambda row: row.get("plant_in_words", ""),
            "updates": column("updates", "d"),
            "mean gap": column("gap_mean", ".2f", " %", 100),
            "95th percentile": column("gap_p95", ".2f", " %", 100),
            "k0 at 30 deg": lambda row: number(_at_30(row).get("k0"), ".2f"),
            "best k0": lambda row: number(_at_30(row).get("k0_best"), ".2f"),
        }
        if policies:
            title = "Policies, and how far their reward is from that of the best actions a search finds."
            say(table(title, columns, policies, left=("policy", "targets", "case", "plant")))
        else:
            say("no policies are shipped; orient-eye train makes one")
        given = [key for key in _NUMBERS if any(row.get(key) for row in surrogates)]
        columns = {
            "surrogate": words["name"],
            **{f"{key} {_NUMBERS[key]}".strip(): column(key, "g") for key in given},
            "motor": words["motor"],
            "source": words["source"],
        }
        title = "Surrogates: gain and frequency of the linear eye."
        say(table(title, columns, surrogates, left=("surrogate", "motor", "source")))
        columns = {
            "surrogate": words["name"],
            **{f"w {axis} [rad/s]": partial(_rate, axis=axis) for axis in ("roll", "pitch", "yaw")},
            "source": words["source"],
        }
        title = "Surrogates of all motors (plant modal): frequencies of the modes."
        say(table(title, columns, in_3d, left=("surrogate", "source")))
        for row in (*policies, *surrogates, *in_3d):
            if "error" in row:
                say(f"{row['name']} is damaged: {row['error']}", "red")
        return {"policies": policies, "surrogates": surrogates, "surrogates_3d": in_3d}


def _policy(name: str, folder: "Path") -> dict[str, Any]:
    from orient_eye.errors import InputError
    from orient_eye.learning.policy import Policy
    from orient_eye.words import plant_in_words

    try:
        manifest = Policy.load(folder).manifest
    except InputError as error:
        return {"name": name, "error": str(error)}
    result = manifest.get("result", {})
    return {
        "name": name,
        "targets": manifest["task"]["targets"]["targets"],
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
    return {"name": name, **{key: getattr(found, key) for key in (*_NUMBERS, "motor", "source")}}


def _in_3d(name: str) -> dict[str, Any]:
    from orient_eye.errors import InputError
    from orient_eye.modal_surrogate import ModalSurrogate

    try:
        return {"name": name, **ModalSurrogate.load(name).to_plain()}
    except InputError as error:
        return {"name": name, "error": str(error)}


def _rate(row: dict[str, Any], axis: str) -> str:
    """Cut-off or natural frequency of a mode."""
    from orient_eye.cli.tables import number

    mode = row.get("modes", {}).get(axis, {})
    return number(mode.get("w0", mode.get("wn")), "g")


def _at_30(row: dict[str, Any]) -> dict[str, Any]:
    """The saccade of 30 deg in the table of a policy's result."""
    return next((found for found in row.get("table") or [] if found["amplitude_deg"] == 30), {})
