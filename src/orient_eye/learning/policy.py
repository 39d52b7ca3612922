"""A learned policy as one file that is safe to load from a stranger: arrays, and a manifest in words.

    policy = Policy.load("runs/my-run")              # or a policy folder, or the name of a shipped one
    action = policy.act(start, target)               # (saccades, numbers), in units: B, D, k0
    task = policy.task()                             # the plant and the reward it learned on
    policy.require(task)                             # refuses another plant, pulse or reward
    module = policy.torch_module()                   # the same in torch

The networks are evaluated in NumPy: using a policy needs neither torch nor pickle, and loading one runs
no code. The format of the file is in docs/policies.md.
"""

import json
import math
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import safetensors.numpy
from numpy.typing import ArrayLike, NDArray

from orient_eye.errors import InputError
from orient_eye.files import digest, finite, parse_json, read_arrays, write_atomically
from orient_eye.learning.features import GAZE_INPUTS, QUATERNION_INPUTS, gaze_features
from orient_eye.plants import Plant
from orient_eye.resources import data_folder, printable, shipped_or_given
from orient_eye.task.actions import scale
from orient_eye.task.saccade import SaccadeTask
from orient_eye.words import in_words, plant_in_words

if TYPE_CHECKING:
    from orient_eye.learning.torch_policy import TorchPolicy

Array = NDArray[np.float64]
NAME = "policy.safetensors"
_FORMAT = "orient-eye policy 2"
_OLD_NAME = "policy.json"  # of format 1
_METADATA = "orient-eye"  # the one key: safetensors would write several in any order
_ALIKE = 0.05  # of a bound
_FITTED, _EDGE = 4096, 0.999  # saccades of a fit, and how near to the bounds of tanh it goes
_LARGEST_BYTES = 64 * 2**20  # the thesis' networks have 0.1 MB


@dataclass(frozen=True)
class Policy:
    """The mean of the learned policy.

    Attributes:
        weights: of the layers, (inputs, outputs) each; the first has 6 or 8 inputs (`learning.features`).
        biases: of the layers.
        low: lower bounds of the action's numbers, (numbers,).
        high: upper bounds.
        log: which numbers are on a logarithmic scale, (numbers,).
        manifest: plain values. `task`, the identity of plant, actions, targets and reward; `numbers`, their names and
            units; case, weights_from, config, versions, result, source where they are known.

    Raises:
        InputError: shapes that do not chain, numbers that are not finite, or bounds that are none.
    """

    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    low: Array
    high: Array
    log: NDArray[np.bool_]
    manifest: dict[str, Any]

    def __post_init__(self) -> None:
        for name in ("weights", "biases"):  # one memory layout: a policy from a file gives the very same numbers
            object.__setattr__(self, name, tuple(np.ascontiguousarray(a, dtype=float) for a in getattr(self, name)))
        for array in (*self.weights, *self.biases, self.low, self.high):
            if not np.isfinite(array).all():
                raise InputError("a policy needs finite numbers, this one holds NaN or infinity: its training diverged")
        shapes = {array.shape for array in (self.low, self.high, self.log)}
        if shapes != {(self.low.size,)} or not self.low.size:
            raise InputError(f"bounds have the shape (numbers of the action,), got {sorted(shapes)}")
        if not (self.low < self.high).all() or (self.low[self.log] <= 0).any():
            raise InputError("lower bounds must lie below upper bounds, and above 0 on a logarithmic scale")
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
            raise InputError(f"the last layer gives {size} numbers, the action has {self.low.size}")

    @classmethod
    def of_task(
        cls, task: SaccadeTask, weights: tuple[Array, ...], biases: tuple[Array, ...], **manifest: Any
    ) -> "Policy":
        """A policy for a task, from the layers of its network; the manifest's other entries as keywords."""
        actions = task.actions
        described = {
            "task": task.identity(),
            "weights_from": task.weights_from,
            "numbers": [
                {"name": name, "unit": number.unit} for name, number in zip(actions.names, actions.numbers, strict=True)
            ],
            **manifest,
        }
        return cls(weights, biases, actions.low, actions.high, actions.log, described)

    @property
    def inputs(self) -> int:
        """Inputs of the network."""
        return len(self.weights[0])

    def act(self, start: ArrayLike, target: ArrayLike) -> Array:
        """Actions in units, (saccades, numbers).

        Args:
            start: orientations, (saccades, 4).
            target: desired orientations, (saccades, 4).
        """
        start, target = np.asarray(start, float), np.asarray(target, float)
        x = self._hidden(start, target)
        return scale(np.tanh(x @ self.weights[-1] + self.biases[-1]), self.low, self.high, self.log)

    def _hidden(self, start: Array, target: Array) -> Array:
        """What goes into the last layer, (saccades, its inputs)."""
        x = gaze_features(start, target) if self.inputs == GAZE_INPUTS else np.concatenate([start, target], axis=-1)
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            x = np.maximum(x @ weight + bias, 0)
        return x

    def within(self, task: SaccadeTask, random: np.random.Generator) -> "Policy":
        """The same policy with its actions told in the bounds of a task: with its last layer fitted anew.

        It is itself where they differ by `_ALIKE` at most, as between an eye and its surrogate; then what it says is
        taken as shares of the task's bounds.

        The fit, by least squares over random saccades, is of what goes into the last tanh; actions beyond the bounds
        are at them.

        Args:
            task: with the same numbers.
            random: draws the saccades.
        """
        low, high, log = task.actions.low, task.actions.high, task.actions.log
        alike = all(np.allclose(*pair, rtol=_ALIKE) for pair in ((self.low, low), (self.high, high)))
        if alike and np.array_equal(self.log, log):
            return self
        start, target = task.targets.draw(_FITTED, random)
        inputs = np.column_stack([self._hidden(start.orientation, target), np.ones(_FITTED)])
        action = np.clip(self.act(start.orientation, target), low, high)
        wanted = np.arctanh(np.clip(task.actions.to_unit(action), -_EDGE, _EDGE))
        *weight, bias = np.linalg.lstsq(inputs, wanted, rcond=None)[0]
        return replace(
            self,
            weights=(*self.weights[:-1], np.array(weight)),
            biases=(*self.biases[:-1], bias),
            low=low,
            high=high,
            log=log,
        )

    def torch_module(self) -> "TorchPolicy":
        """The same as a torch module: start and target (batch, 4) to actions in units (batch, numbers)."""
        from orient_eye.learning.torch_policy import TorchPolicy

        return TorchPolicy(self)

    def task(self, plant: Plant | None = None) -> SaccadeTask:
        """The task the policy was trained on, made from its manifest.

        Args:
            plant: the same actions, targets and reward on this plant instead.

        Raises:
            InputError: the manifest does not describe a task of this version.
        """
        return SaccadeTask.restore(self.manifest["task"], plant)

    def require_actions(self, task: SaccadeTask) -> None:
        """Refuse a task whose actions mean something else, so that this policy would not do there what it does here.

        Bounds may differ, as those of D do between an eye and its surrogate (`within`).

        Raises:
            InputError: says what differs.
        """
        own, here = (
            {"names": list(t.actions.names), "targets": t.targets.name}
            | {key: t.actions.identity().get(key) for key in ("rule", "pulse", "C")}
            for t in (self.task(), task)
        )
        words = [f"{key} {in_words(own[key])}, not {in_words(here[key])}" for key in own if own[key] != here[key]]
        if self.inputs != GAZE_INPUTS:
            words.append("networks that see quaternions")
        if words:
            raise InputError(f"the policy to begin with has {'; '.join(words)}; begin with one of the same kind")

    def require(self, task: SaccadeTask, *, force: bool = False) -> list[str]:
        """Refuse a task the policy was not trained on.

        Args:
            task: where it shall be used.
            force: allow it, as long as its actions have as many numbers.

        Returns:
            What differs, in words; empty for the task it was trained on.

        Raises:
            InputError: plant (options, hash of its model, K and w0), actions (driven motors, pulse, C, bounds),
                targets, judge, weights, settling band or horizon differ, and it is not forced.
        """
        words = _differences(self.manifest["task"], task.identity())
        if len(task.actions.numbers) != len(self.low):
            raise InputError(
                f"the policy gives {len(self.low)} numbers an action, this task takes {len(task.actions.numbers)} "
                f"({', '.join(task.actions.names)}); train one for this task"
            )
        if words and not force:
            raise InputError(
                f"this policy was trained for {'; '.join(words)}. Train one for this task, or force it "
                "(--force; in Python force=True) to use it all the same"
            )
        return words

    def save(self, folder: str | Path) -> Path:
        """Write policy.safetensors into a folder; returns its path. The same policy gives the same bytes."""
        arrays: dict[str, NDArray[Any]] = {f"weight{i}": w.astype(np.float32) for i, w in enumerate(self.weights)}
        arrays |= {f"bias{i}": b.astype(np.float32) for i, b in enumerate(self.biases)}
        arrays |= {"low": self.low, "high": self.high, "log": self.log}
        manifest = finite(self.manifest)
        head = {"format": _FORMAT, "sha256": digest(arrays, manifest), **manifest}
        metadata = {_METADATA: json.dumps(head, indent=1, allow_nan=False)}
        content = safetensors.numpy.save(arrays, metadata)
        return write_atomically(Path(folder) / NAME, lambda temporary: temporary.write_bytes(content))

    @classmethod
    def load(cls, path: str | Path) -> "Policy":
        """Read a policy: a run directory, a policy folder, its policy.safetensors, or the name of a shipped one.

        Raises:
            InputError: it is missing, damaged, or of another format.
        """
        shipped = shipped_policies()
        hint = (
            f"give a run directory of orient-eye train, a folder with a {NAME}, or the name of a shipped policy: "
            f"{', '.join(shipped) or '(none)'}"
        )
        place = shipped_or_given(path, shipped, "policy", hint)
        folder = place.parent if place.name in (NAME, _OLD_NAME) else place
        file, old = folder / NAME, folder / _OLD_NAME
        if not os.path.exists(file):
            told = f"there is no {printable(file)}; {hint}"
            if os.path.exists(old):
                told = (
                    f"it is of format 1 ({_OLD_NAME} and policy.npz), which orient-eye 0.1 wrote and this version does "
                    "not read; train it again, or use it with that version"
                )
            if os.path.exists(folder / "run.json"):
                told = f"the run is not finished; go on with it by orient-eye train --resume {printable(folder)}"
            raise InputError(f"{printable(path)} is no policy: {told}")
        arrays, metadata = read_arrays(file, most=_LARGEST_BYTES, hint=hint)
        try:
            manifest = _manifest(arrays, metadata)
            policy = cls(*_layers(arrays), manifest=manifest)
            policy._check_manifest()
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(f"{printable(path)} is no policy: {_reason(error)}; {hint}") from error
        return policy

    def _check_manifest(self) -> None:
        """Raise KeyError, TypeError or ValueError unless it says what everybody asks it."""
        task, numbers = self.manifest["task"], self.manifest["numbers"]
        if not all(isinstance(part, dict) for part in (task, task["plant"], self.manifest.get("result", {}))):
            raise ValueError("its task, plant or result is not an object")
        if (task["actions"]["low"], task["actions"]["high"]) != (self.low.tolist(), self.high.tolist()):
            raise ValueError("the bounds in its manifest are not those in its arrays")
        named = [isinstance(number["name"], str) and isinstance(number["unit"], str) for number in numbers]
        if named != [True] * self.low.size:
            raise ValueError(f"it gives {self.low.size} numbers, but not as many names and units")


def shipped_policies() -> dict[str, Path]:
    """Names and folders of the policies that come with orient-eye."""
    return {file.parent.name: file.parent for file in sorted(data_folder("models").glob(f"policies/*/{NAME}"))}


_WORDS = {
    "eye": "eye",
    "model": "a model of the eye with the hash",
    "driven": "motors",
    "weights": "reward weights",
    "band": "settling band",
    "horizon_s": "horizon [s]",
    "speed_limit": "speed limit",
    "low": "lower bounds",
    "high": "upper bounds",
    "limit_deg": "range of the targets [deg]",
}
_FOLLOW_THE_PLANT = ("horizon_s", "low", "high", "limit_deg")


def _differences(trained: dict[str, Any], here: dict[str, Any]) -> list[str]:
    """What differs between two tasks' identities, in words: "pulse 1, not 2"."""
    words = []
    before, now = dict(trained.get("plant") or {}), dict(here["plant"])
    other_plant = before.get("plant") != now["plant"]
    if other_plant:
        words.append(f"plant {plant_in_words(before)}, not {plant_in_words(now)}")
    one, two = (_parts(task, skip="plant" if other_plant else "") for task in (trained, here))
    for part, key in dict.fromkeys((*one, *two)):
        first, second = one.get((part, key)), two.get((part, key))
        if not _same(first, second) and not (other_plant and key in _FOLLOW_THE_PLANT):
            name = f"motor's {_WORDS[key]}" if (part, key) == ("plant", "speed_limit") else _WORDS.get(key, key)
            words.append(f"{name} {in_words(first)}, not {in_words(second)}")
            if key == "model":
                words[-1] += " (the MJCF changed, or MuJoCo's version)"
    return words


def _same(one: Any, other: Any) -> bool:
    """Whether two plain values are the same, numbers to six digits: bounds that were solved differ from machine to
    machine in the last ones."""
    if isinstance(one, (list, tuple)) and isinstance(other, (list, tuple)):
        return len(one) == len(other) and all(_same(a, b) for a, b in zip(one, other, strict=True))
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=1e-6)
    return bool(one == other)


def _parts(identity: dict[str, Any], skip: str) -> dict[tuple[str, str], Any]:
    """The values of an identity by part (plant, actions, targets, or "") and name."""
    found: dict[tuple[str, str], Any] = {}
    for part, value in identity.items():
        if part == skip:
            continue
        nested = part in ("plant", "actions", "targets") and isinstance(value, dict)
        found |= {(part, name): inner for name, inner in value.items()} if nested else {("", part): value}
    return found


def _layers(arrays: dict[str, NDArray[Any]]) -> tuple[tuple[Array, ...], tuple[Array, ...], Array, Array, Any]:
    """Weights, biases, low, high and log of a policy."""
    layers = sum(name.startswith("weight") for name in arrays)
    weights, biases = (tuple(arrays[f"{kind}{i}"].astype(float) for i in range(layers)) for kind in ("weight", "bias"))
    return weights, biases, arrays["low"].astype(float), arrays["high"].astype(float), arrays["log"] != 0


def _manifest(arrays: dict[str, NDArray[Any]], metadata: dict[str, str]) -> dict[str, Any]:
    """The manifest in a file's metadata, if the file is whole."""
    manifest = parse_json(metadata.get(_METADATA) or "{}")
    if not isinstance(manifest, dict) or manifest.pop("format", None) != _FORMAT:
        raise ValueError(f"it is not of the format {_FORMAT!r}")
    if manifest.pop("sha256") != digest(arrays, manifest):
        raise ValueError("it is damaged: its SHA-256 differs")
    return manifest


def _reason(error: Exception) -> str:
    if isinstance(error, KeyError):
        return f"it has no {error.args[0]!r}"
    return str(error) or type(error).__name__
