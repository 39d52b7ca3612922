"""A learned policy as a file that is safe to load from a stranger: arrays and a JSON manifest.

    policy = Policy.load("runs/my-run")              # or a policy folder, or the name of a shipped one
    action = policy.act(start, target)               # (saccades, driven, 3): B, D, k0
    task = policy.task()                             # the plant and the reward it learned on
    policy.require(task)                             # refuses another plant, pulse or reward

The networks are evaluated in NumPy: using a policy needs neither torch nor pickle, and loading one runs
no code. The format of the files is in docs/policies.md.
"""

import hashlib
import json
import math
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.commands.pulse_step import SPEED_LIMIT
from orient_eye.errors import InputError
from orient_eye.files import write_atomically, write_text
from orient_eye.plants import Plant, make_plant, plant_in_words, value_in_words
from orient_eye.plants.lpf import LowPassPlant
from orient_eye.resources import data_folder
from orient_eye.rotations import rotation
from orient_eye.surrogate import Surrogate
from orient_eye.task.reward import Weights
from orient_eye.task.saccade import YAW_RANGE_DEG, SaccadeTask

Array = NDArray[np.float64]
GAZE_INPUTS, QUATERNION_INPUTS = 6, 8
"""Inputs of the first layer: the rotation vectors of start and turn in units of 35 deg, or the two quaternions."""
_FORMAT = "orient-eye policy 1"
_MANIFEST, _ARRAYS = "policy.json", "policy.npz"
_LARGEST_BYTES = 64 * 2**20  # the thesis' networks have 0.1 MB
_PLANT_OPTIONS = {"lpf": {"K", "w0", "motor"}, "mujoco": {"eye", "accurate", "gravity"}}
_PLANT_OPTIONS["tavares"] = {"eye", "gravity", "as_published"}


@dataclass(frozen=True)
class Policy:
    """The mean of the learned policy.

    Attributes:
        weights: of the layers, (inputs, outputs) each; the first has 6 or 8 inputs (`GAZE_INPUTS`).
        biases: of the layers.
        low: lower bounds of B, D, k0, (driven, 3).
        high: upper bounds.
        manifest: case, task (the identity of plant, pulse and reward), config, versions, result.

    Raises:
        InputError: shapes that do not chain, numbers that are not finite, or bounds that are none.
    """

    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    low: Array
    high: Array
    manifest: dict[str, Any]

    def __post_init__(self) -> None:
        for name in ("weights", "biases"):  # one memory layout: a policy from a file gives the very same numbers
            object.__setattr__(self, name, tuple(np.ascontiguousarray(a, dtype=float) for a in getattr(self, name)))
        for array in (*self.weights, *self.biases, self.low, self.high):
            if not np.isfinite(array).all():
                raise InputError("a policy needs finite numbers, this one holds NaN or infinity: its training diverged")
        if self.low.shape != self.high.shape or self.low.ndim != 2 or self.low.shape[1] != 3 or not self.low.size:
            raise InputError(
                f"bounds have the shape (driven motors, 3: B, D, k0), got {self.low.shape}, {self.high.shape}"
            )
        if not (self.low < self.high).all() or (self.low[:, [0, 2]] <= 0).any():
            raise InputError("lower bounds must lie below upper bounds, those of B and k0 above 0")
        size = self.weights[0].shape[0] if self.weights and self.weights[0].ndim == 2 else 0
        if size not in (GAZE_INPUTS, QUATERNION_INPUTS) or len(self.weights) != len(self.biases):
            raise InputError(
                f"the first layer has {GAZE_INPUTS} inputs (rotation vectors of start and turn) or {QUATERNION_INPUTS} "
                f"(quaternions of start and target), got {size}"
            )
        for i, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            if weight.ndim != 2 or bias.ndim != 1 or weight.shape != (size, bias.size):
                raise InputError(f"layer {i} takes {size} numbers, but has weights {weight.shape}, biases {bias.shape}")
            size = bias.size
        if size != self.low.size:
            raise InputError(f"the last layer gives {size} numbers; B, D, k0 of each driven motor are {self.low.size}")

    @property
    def inputs(self) -> int:
        """Inputs of the network."""
        return len(self.weights[0])

    def act(self, start: Array, target: Array) -> Array:
        """B [1/s], D [deg], k0 [1/s] of each driven motor, (saccades, driven, 3).

        Args:
            start: orientations, (saccades, 4).
            target: desired orientations, (saccades, 4).
        """
        if self.inputs == GAZE_INPUTS:
            turn = rotation(target) * rotation(start).inv()
            features = [rotation(start).as_rotvec(degrees=True), turn.as_rotvec(degrees=True)]
            x = np.concatenate(features, axis=-1) / YAW_RANGE_DEG[1]
        else:
            x = np.concatenate([start, target], axis=-1)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.maximum(x @ weight + bias, 0)
        shares = (np.tanh(x @ self.weights[-1] + self.biases[-1]) + 1) / 2
        return self.low + shares.reshape(len(shares), *self.low.shape) * (self.high - self.low)

    def task(self, plant: Plant | None = None) -> SaccadeTask:
        """The task the policy was trained on, made from its manifest.

        Args:
            plant: the same pulse and reward on this plant instead.

        Raises:
            InputError: the manifest does not describe a task of this version.
        """
        identity = self.manifest["task"]
        try:
            speed_limit = SPEED_LIMIT if identity["speed_limit"] is None else float(identity["speed_limit"])
            horizon = {} if identity["horizon_s"] is None else {"horizon_s": float(identity["horizon_s"])}
            return SaccadeTask(
                _plant(identity["plant"]) if plant is None else plant,
                driven=tuple(identity["driven"]),
                variant=int(identity["variant"]),
                C=identity["C"],
                speed_limit=speed_limit,
                weights=Weights(**identity["weights"]),
                band=float(identity["band"]),
                **horizon,
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"the policy's manifest describes no task of this version ({error!r})") from error

    def require(self, task: SaccadeTask, *, force: bool = False) -> list[str]:
        """Refuse a task the policy was not trained on.

        Args:
            task: where it shall be used.
            force: allow it, as long as the same number of motors is driven.

        Returns:
            What differs, in words; empty for the task it was trained on.

        Raises:
            InputError: plant (options, hash of its model, K and w0), driven motors, pulse, C, reward weights,
                settling band, horizon or bounds differ, and it is not forced.
        """
        here = json.loads(json.dumps(task.identity()))
        words = _differences(self.manifest["task"], here)
        if len(here["driven"]) != len(self.low):
            raise InputError(f"the policy drives {len(self.low)} motors, this task {len(here['driven'])}")
        if words and not force:
            raise InputError(
                f"this policy was trained for {'; '.join(words)}. Train one for this task, or use --force "
                "(force=True) to use it all the same"
            )
        return words

    def save(self, folder: str | Path) -> Path:
        """Write policy.npz and policy.json into a folder; returns the path of the manifest.

        The same policy gives the same bytes.
        """
        folder = Path(folder)
        arrays: dict[str, NDArray[Any]] = {f"weight{i}": w.astype(np.float32) for i, w in enumerate(self.weights)}
        arrays |= {f"bias{i}": b.astype(np.float32) for i, b in enumerate(self.biases)}
        arrays |= {"low": self.low, "high": self.high}
        file = write_atomically(folder / _ARRAYS, lambda temporary: _write_arrays(temporary, arrays))
        manifest = {"format": _FORMAT, "sha256": _sha256(file.read_bytes()), **self.manifest}
        return write_text(folder / _MANIFEST, json.dumps(_finite(manifest), indent=2, allow_nan=False) + "\n")

    @classmethod
    def load(cls, path: str | Path) -> "Policy":
        """Read a policy: a run directory, a policy folder, its policy.json, or the name of a shipped one.

        Raises:
            InputError: it is missing or damaged.
        """
        shipped = shipped_policies()
        folder = shipped.get(str(path), Path(path))
        if folder.name in (_MANIFEST, _ARRAYS):
            folder = folder.parent
        try:
            manifest = _read_manifest(folder / _MANIFEST)
            policy = cls(*_read_arrays(folder / _ARRAYS, manifest.pop("sha256")), manifest)
            task = manifest["task"]
            if not all(isinstance(part, dict) for part in (task, task["plant"], manifest.get("result", {}))):
                raise ValueError("its task, plant or result is not an object")
            if (task["low"], task["high"]) != (policy.low.tolist(), policy.high.tolist()):
                raise ValueError(f"the bounds in {_MANIFEST} are not those in {_ARRAYS}")
        except (OSError, KeyError, TypeError, ValueError, MemoryError, RecursionError) as error:
            missing = isinstance(error, FileNotFoundError)
            reason = f"there is no {folder / _MANIFEST}" if missing else _reason(error)
            raise InputError(
                f"{path} is no policy: {reason}. Give a run directory of orient-eye train, a folder with "
                f"{_MANIFEST} and {_ARRAYS}, or the name of a shipped policy: {', '.join(shipped) or '(none)'}"
            ) from error
        return policy


def shipped_policies() -> dict[str, Path]:
    """Names and folders of the policies that come with orient-eye."""
    return {file.parent.name: file.parent for file in sorted(data_folder("models").glob(f"policies/*/{_MANIFEST}"))}


_WORDS = {
    "eye": "eye",
    "model": "a model of the eye with the hash",
    "driven": "motors",
    "variant": "pulse variant",
    "weights": "reward weights",
    "band": "settling band",
    "horizon_s": "horizon [s]",
    "speed_limit": "speed limit",
    "low": "lower bounds",
    "high": "upper bounds",
}


def _differences(trained: dict[str, Any], here: dict[str, Any]) -> list[str]:
    """What differs between two tasks' identities, in words: "pulse variant 1, not 2"."""
    words = []
    before, now = dict(trained.get("plant") or {}), dict(here["plant"])
    other_plant = before.get("plant") != now["plant"]
    if other_plant:
        words.append(f"plant {plant_in_words(before)}, not {plant_in_words(now)}")
    one, two = (
        {**identity, "plant": None, **({} if other_plant else plant)}
        for identity, plant in ((trained, before), (here, now))
    )
    for key in dict.fromkeys((*one, *two)):
        follows = other_plant and key in ("horizon_s", "low", "high")
        if one.get(key) != two.get(key) and not follows:
            words.append(f"{_WORDS.get(key, key)} {value_in_words(one.get(key))}, not {value_in_words(two.get(key))}")
            if key == "model":
                words[-1] += " (the MJCF changed, or MuJoCo's version)"
    return words


def _plant(identity: dict[str, Any]) -> Plant:
    """The plant of an identity."""
    options = {key: value for key, value in identity.items() if key not in ("plant", "model")}
    name = identity["plant"]
    unknown = set(options) - _PLANT_OPTIONS.get(name, set())
    if unknown:
        raise InputError(f"the policy's manifest names unknown options of plant {name!r}: {', '.join(sorted(unknown))}")
    if name == LowPassPlant.name:
        return LowPassPlant(Surrogate(float(options["K"]), float(options["w0"]), str(options["motor"])))
    return make_plant(name, **options)


def _read_manifest(path: Path) -> dict[str, Any]:
    if path.stat().st_size > _LARGEST_BYTES:
        raise ValueError(f"{path.name} is larger than any policy's")
    manifest = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(manifest, dict) or manifest.pop("format", None) != _FORMAT:
        raise ValueError(f"{path.name} is not of the format {_FORMAT!r}")
    return manifest


def _read_arrays(path: Path, sha256: str) -> tuple[tuple[Array, ...], tuple[Array, ...], Array, Array]:
    """Weights, biases, lower and upper bounds, if the file is the manifest's own."""
    if path.stat().st_size > _LARGEST_BYTES:
        raise ValueError(f"{path.name} is larger than any policy")
    if _sha256(path.read_bytes()) != sha256:
        raise ValueError(f"{path.name} is damaged, or not the file {_MANIFEST} was written with (SHA-256 differs)")
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(member.file_size for member in archive.infolist()) > _LARGEST_BYTES:
                raise ValueError(f"{path.name} is larger than any policy when unpacked")
        with np.load(path, allow_pickle=False) as file:
            layers = sum(name.startswith("weight") for name in file.files)
            arrays = {name: np.asarray(file[name], dtype=float) for name in file.files}
    except zipfile.BadZipFile as error:
        raise ValueError(f"{path.name} is no .npz file ({error})") from error
    weights, biases = (tuple(arrays[f"{kind}{i}"] for i in range(layers)) for kind in ("weight", "bias"))
    return weights, biases, arrays["low"], arrays["high"]


def _write_arrays(path: Path, arrays: dict[str, NDArray[Any]]) -> None:
    """An .npz file as NumPy's, without the time of day in it."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, array in arrays.items():
            with archive.open(zipfile.ZipInfo(f"{name}.npy"), "w") as file:
                np.lib.format.write_array(file, np.ascontiguousarray(array), allow_pickle=False)


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _finite(value: Any) -> Any:
    """The same plain value with None for numbers that JSON does not have."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _reason(error: Exception) -> str:
    if isinstance(error, KeyError):
        return f"it has no {error.args[0]!r}"
    return str(error) or type(error).__name__
