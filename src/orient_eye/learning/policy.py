"""A learned policy as a file that is safe to load from a stranger: arrays and a JSON manifest.

    policy = Policy.load("runs/my-run")              # or policy.json itself
    action = policy.act(start, target)               # (saccades, driven, 3): B, D, k0

The networks are evaluated in NumPy: using a policy needs neither torch nor pickle.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.files import write_atomically, write_text
from orient_eye.rotations import rotation
from orient_eye.saccade import YAW_RANGE_DEG

Array = NDArray[np.float64]
_FORMAT = "orient-eye policy 1"


@dataclass(frozen=True)
class Policy:
    """The mean of the learned policy.

    Attributes:
        weights: of the layers, (inputs, outputs) each.
        biases: of the layers.
        low: lower bounds of B, D, k0, (driven, 3).
        high: upper bounds.
        manifest: plant and its identity, pulse, reward, versions, results.
    """

    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    low: Array
    high: Array
    manifest: dict[str, Any]

    def act(self, start: Array, target: Array) -> Array:
        """B [1/s], D [deg], k0 [1/s] of each driven motor, (saccades, driven, 3).

        Args:
            start: orientations, (saccades, 4).
            target: desired orientations, (saccades, 4).
        """
        turn = rotation(target) * rotation(start).inv()
        features = [rotation(start).as_rotvec(degrees=True), turn.as_rotvec(degrees=True)]
        x = np.concatenate(features, axis=-1) / YAW_RANGE_DEG[1]
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.maximum(x @ weight + bias, 0)
        shares = (np.tanh(x @ self.weights[-1] + self.biases[-1]) + 1) / 2
        return self.low + shares.reshape(len(shares), *self.low.shape) * (self.high - self.low)

    def save(self, folder: str | Path) -> Path:
        """Write policy.npz and policy.json into a folder; returns the path of the manifest."""
        folder = Path(folder)
        arrays: dict[str, Any] = {f"weight{i}": w.astype(np.float32) for i, w in enumerate(self.weights)}
        arrays |= {f"bias{i}": b.astype(np.float32) for i, b in enumerate(self.biases)}
        arrays |= {"low": self.low, "high": self.high}
        write_atomically(folder / "policy.npz", lambda temporary: np.savez(temporary, **arrays))
        manifest = {"format": _FORMAT, **self.manifest}
        return write_text(folder / "policy.json", json.dumps(manifest, indent=2) + "\n")

    @classmethod
    def load(cls, path: str | Path) -> "Policy":
        """Read a policy from its folder or its manifest.

        Raises:
            InputError: it is missing or damaged.
        """
        path = Path(path)
        folder = path if path.is_dir() else path.parent
        try:
            manifest = json.loads((folder / "policy.json").read_text(encoding="utf-8"))
            if manifest.pop("format") != _FORMAT:
                raise ValueError(f"its format is not {_FORMAT!r}")
            with np.load(folder / "policy.npz", allow_pickle=False) as file:
                layers = sum(name.startswith("weight") for name in file.files)
                weights = tuple(file[f"weight{i}"].astype(float) for i in range(layers))
                biases = tuple(file[f"bias{i}"].astype(float) for i in range(layers))
                return cls(weights, biases, file["low"], file["high"], manifest)
        except (OSError, KeyError, ValueError, AttributeError) as error:
            raise InputError(f"{path} holds no policy ({error}); give a run directory of orient-eye train") from error
