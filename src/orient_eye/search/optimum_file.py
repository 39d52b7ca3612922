"""An optimum in a file, with its saccades: remembered by the cache, or taken along with a policy.

    write_optimum(path, Found(key, start, target, optimum))
    read_optimum(path)                               # None where there is none, or a damaged one

A safetensors file, as a policy's: arrays and a hash of them, nothing that could run.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import safetensors.numpy
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from orient_eye.checks import whole
from orient_eye.files import digest, parse_json, read_arrays, write_atomically
from orient_eye.search.optimum import Optimum
from orient_eye.state import State

Array = NDArray[np.float64]
NAME = "optimum.safetensors"
"""Of the file beside a policy."""
_FORMAT = "orient-eye optimum 1"
_METADATA = "orient-eye"
_LARGEST_BYTES = 64 * 2**20  # of 300 saccades: 40 kB
_SAME = 1e-6  # of quaternions, motor positions and velocities: where another machine's root finder puts them


@dataclass(frozen=True)
class Found:
    """Saccades and their optimum.

    Attributes:
        key: hash of all that it depends on but the saccades.
        start: where each begins, of (saccades,).
        target: desired orientations, (saccades, 4).
        optimum: of each.
    """

    key: str
    start: State
    target: Array
    optimum: Optimum

    def of(self, start: State, target: Array) -> Optimum | None:
        """The optimum of some of the saccades, in any order; None where one is not among them."""
        known, asked = _ends(self.start, self.target), _ends(start, target)
        if known.shape[1] != asked.shape[1] or not len(known):
            return None
        off, which = cKDTree(known).query(asked, p=np.inf)
        if (off > _SAME).any():
            return None
        return Optimum(self.optimum.action[which], self.optimum.reward[which], self.optimum.evaluations)


def _ends(start: State, target: Array) -> Array:
    return np.concatenate([start.orientation, start.motor, start.angular_velocity, target], axis=1)


def write_optimum(path: Path, found: Found) -> Path:
    """Write a file; the same optimum gives the same bytes.

    Raises:
        InputError: it cannot be written.
    """
    arrays = {
        "orientation": found.start.orientation,
        "motor": found.start.motor,
        "angular_velocity": found.start.angular_velocity,
        "target": found.target,
        "action": found.optimum.action,
        "reward": found.optimum.reward,
    }
    arrays = {name: np.ascontiguousarray(array, dtype=float) for name, array in arrays.items()}
    told = {"format": _FORMAT, "key": found.key, "evaluations": found.optimum.evaluations}
    head = json.dumps({**told, "sha256": digest(arrays, told)}, sort_keys=True)
    content = safetensors.numpy.save(arrays, {_METADATA: head})
    return write_atomically(path, lambda temporary: temporary.write_bytes(content))


def read_optimum(path: Path) -> Found | None:
    """Read a file; None where there is none, or one that is damaged or of another format."""
    try:
        arrays, metadata = read_arrays(path, most=_LARGEST_BYTES, hint="search it again")
        told = parse_json(metadata[_METADATA])
        if told.pop("sha256") != digest(arrays, told) or told["format"] != _FORMAT:
            return None
        if not all(array.dtype == float and np.isfinite(array).all() for array in arrays.values()):
            return None
        action, reward, target = (arrays[name] for name in ("action", "reward", "target"))
        start = State(*(arrays[name] for name in ("orientation", "motor", "angular_velocity")))
        count = len(start)
        if (len(action), action.ndim, reward.shape, target.shape) != (count, 2, (count,), (count, 4)):
            return None
        optimum = Optimum(action, reward, whole("evaluations", told["evaluations"], 0))
        return Found(str(told["key"]), start, target, optimum)
    except (ValueError, KeyError, TypeError, AttributeError):
        return None  # an InputError is a ValueError
