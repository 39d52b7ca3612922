"""The low-pass surrogate of the eye: its two numbers and its file (thesis 3.11).

`surrogate.json` is what `orient-eye sysid` writes and `orient-eye train --plant lpf --surrogate FILE`
takes.
"""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from orient_eye.errors import InputError
from orient_eye.files import write_text
from orient_eye.resources import data_folder

_FORMAT = "orient-eye surrogate 1"


@dataclass(frozen=True)
class Surrogate:
    """theta' = w0 (K tau - theta).

    Attributes:
        K: static gain, deg of yaw per deg of motor.
        w0: cut-off frequency [rad/s].
        motor: name of the motor it describes.
        source: where it comes from, for people: plant and options, or recordings.
        details: what the identification found, plain values.
    """

    K: float
    w0: float
    motor: str = "motor2"
    source: str = ""
    details: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.K) and np.isfinite(self.w0) and self.K != 0 and self.w0 > 0):
            raise InputError(f"a surrogate needs a finite gain K != 0 and w0 > 0, got K = {self.K}, w0 = {self.w0}")

    def save(self, path: str | Path) -> Path:
        """Write the JSON file."""
        return write_text(path, json.dumps({"format": _FORMAT, **asdict(self)}, indent=2) + "\n")

    @classmethod
    def load(cls, path: str | Path) -> "Surrogate":
        """Read the JSON file, or a shipped surrogate by its name ("thesis").

        Raises:
            InputError: missing, or not a surrogate.
        """
        folder = data_folder("models") / "surrogates"
        names = sorted(f.stem for f in folder.glob("*.json"))
        file = folder / f"{path}.json" if str(path) in names else Path(path)
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            if content.pop("format") != _FORMAT:
                raise ValueError(f"its format is not {_FORMAT!r}")
            return cls(**content)
        except (OSError, KeyError, TypeError, ValueError, AttributeError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(
                f"{path} is no surrogate ({error}); give a surrogate.json written by orient-eye sysid, "
                f"or a shipped one: {', '.join(names)}"
            ) from error
