"""A policy in the formats of other programs: ONNX, and the zip of Stable-Baselines3.

    export_onnx(policy, "policy.onnx")               # needs the extra: pip install "orient-eye[onnx]"
    export_sb3(policy, "policy.zip")
    policy = import_sb3("policy.zip", SaccadeTask.of_case(make_plant("lpf"), "1"))

The ONNX graph holds everything from the quaternions to actions in units, in float32. An SB3 zip holds
pickles: `SAC.load` runs the code of whoever wrote it, so load only files of people you trust.
`import_sb3` reads nothing but the tensors, which runs no code.
"""

import io
import json
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from orient_eye.errors import InputError
from orient_eye.files import parse_json, read_bytes, write_atomically
from orient_eye.learning.features import GAZE_INPUTS, UNIT_DEG
from orient_eye.learning.policy import Policy
from orient_eye.resources import printable
from orient_eye.run_directory import versions
from orient_eye.task.saccade import SaccadeTask

if TYPE_CHECKING:
    import onnx

_OPSET, _IR_VERSION = 17, 8  # read by onnxruntime 1.13 and later
_LARGEST_BYTES = 2**28  # of a zip, and of what is in it
_NO_SPREAD = -20.0  # log of the standard deviation, SB3's least


def export_onnx(policy: Policy, path: str | Path) -> Path:
    """Write an ONNX model: inputs start (n, 4) and target (n, 4), output action (n, numbers), in units.

    Args:
        policy: to export.
        path: the file.

    Raises:
        InputError: the optional packages are missing.
    """
    try:
        import onnx
    except ImportError as error:
        raise InputError('ONNX needs optional packages: pip install "orient-eye[onnx]"') from error
    model = _Graph(policy).model()
    onnx.checker.check_model(model)
    content = model.SerializeToString()
    return write_atomically(path, lambda temporary: temporary.write_bytes(content))


class _Graph:
    """The ONNX graph of a policy, node by node; each method returns the name of its result."""

    def __init__(self, policy: Policy) -> None:
        self.policy = policy
        self.nodes: list[Any] = []
        self.constants: list[Any] = []

    def model(self) -> "onnx.ModelProto":
        """The whole model, with the policy's manifest in its metadata."""
        from onnx import TensorProto, helper

        policy = self.policy
        numbers = ", ".join(f"{number['name']} [{number['unit']}]" for number in policy.manifest["numbers"])
        self._scale(self._network(self._features()))
        quaternion: list[str | int | None] = ["saccades", 4]
        action: list[str | int | None] = ["saccades", policy.low.size]
        graph = helper.make_graph(
            self.nodes,
            "orient_eye_policy",
            [helper.make_tensor_value_info(name, TensorProto.FLOAT, quaternion) for name in ("start", "target")],
            [helper.make_tensor_value_info("action", TensorProto.FLOAT, action)],
            self.constants,
            doc_string=f"Orientations (w, x, y, z) of start and target; action: {numbers}.",
        )
        opset = helper.make_opsetid("", _OPSET)
        model = helper.make_model(graph, opset_imports=[opset], ir_version=_IR_VERSION, producer_name="orient-eye")
        manifest = {key: value for key, value in policy.manifest.items() if key != "result"}
        helper.set_model_props(model, {"orient-eye": json.dumps(manifest)})
        return model

    def _constant(self, value: Any, dtype: Any = np.float32) -> str:
        from onnx import numpy_helper

        name = f"constant{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(value, dtype), name))
        return name

    def _node(self, kind: str, *inputs: str, name: str | None = None, **attributes: Any) -> str:
        from onnx import helper

        name = name or f"{kind.lower()}{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, inputs, [name], **attributes))
        return name

    def _columns(self, of: str, *which: int) -> str:
        return self._node("Gather", of, self._constant(which, np.int64), axis=1)

    def _features(self) -> str:
        """What the network sees; see `Policy.act`."""
        if self.policy.inputs != GAZE_INPUTS:
            return self._node("Concat", "start", "target", axis=1)
        aw, av = self._columns("start", 0), self._columns("start", 1, 2, 3)
        bw, bv = self._columns("target", 0), self._columns("target", 1, 2, 3)
        # turn = target start^-1
        along = self._node("ReduceSum", self._mul(av, bv), self._constant([1], np.int64), keepdims=1)
        w = self._node("Add", self._mul(aw, bw), along)
        v = self._node("Sub", self._mul(aw, bv), self._mul(bw, av))
        v = self._node("Add", v, self._cross(av, bv))
        both = self._node("Concat", self._rotation_vector(aw, av), self._rotation_vector(w, v), axis=1)
        return self._mul(both, self._constant(1 / np.deg2rad(UNIT_DEG)))

    def _mul(self, a: str, b: str) -> str:
        return self._node("Mul", a, b)

    def _cross(self, a: str, b: str) -> str:
        one = self._mul(self._columns(a, 1, 2, 0), self._columns(b, 2, 0, 1))
        two = self._mul(self._columns(a, 2, 0, 1), self._columns(b, 1, 2, 0))
        return self._node("Sub", one, two)

    def _rotation_vector(self, w: str, v: str) -> str:
        """Of a quaternion of any length and either sign [rad]: 2 atan(|v| / |w|) v / |v|, w turned positive."""
        size = self._node("ReduceL2", v, axes=[1], keepdims=1)
        size = self._node("Max", size, self._constant(1e-12))  # no turn: atan(x) / x is 1 there
        angle = self._node("Atan", self._node("Div", size, self._node("Abs", w)))
        negative = self._node("Less", w, self._constant(0.0))
        twice = self._node("Where", negative, self._constant(-2.0), self._constant(2.0))
        return self._mul(v, self._node("Div", self._mul(twice, angle), size))

    def _network(self, x: str) -> str:
        layers = list(zip(self.policy.weights, self.policy.biases, strict=True))
        for i, (weight, bias) in enumerate(layers):
            x = self._node("Gemm", x, self._constant(weight), self._constant(bias))
            x = self._node("Relu" if i < len(layers) - 1 else "Tanh", x)
        return x

    def _scale(self, x: str) -> str:
        """From -1 .. 1 to units, on a linear or a logarithmic scale."""
        log = self.policy.log
        low, high = (
            np.where(log, np.log(np.where(log, bound, 1)), bound) for bound in (self.policy.low, self.policy.high)
        )
        x = self._mul(x, self._constant((high - low) / 2))
        x = self._node("Add", x, self._constant((high + low) / 2))
        return self._node("Where", self._constant(log, bool), self._node("Exp", x), x, name="action")


def export_sb3(policy: Policy, path: str | Path) -> Path:
    """Write a Stable-Baselines3 zip: `OneStepSAC.load(path).predict(observation)` gives the scaled action.

    Observation and scaled action are those of `SaccadeEnv`; `task.actions.from_unit(scaled)` gives units. A
    policy file holds the mean only: the zip's spread is nil and its Q network untrained. Loading the zip
    needs orient-eye, and runs code (pickle).
    """
    import gymnasium
    import torch

    from orient_eye.learning.replay_buffer import OneStepReplayBuffer
    from orient_eye.learning.sac import GazeFeatures, OneStepSAC

    settings: dict[str, Any] = {"net_arch": [len(bias) for bias in policy.biases[:-1]], "n_critics": 1}
    if policy.inputs == GAZE_INPUTS:
        settings["features_extractor_class"] = GazeFeatures
    model = OneStepSAC(
        "MlpPolicy",
        None,
        replay_buffer_class=OneStepReplayBuffer,
        policy_kwargs=settings,
        target_entropy=-float(policy.low.size),  # SB3 would ask the environment
        seed=0,
        device="cpu",
        _init_setup_model=False,
    )
    model.observation_space = gymnasium.spaces.Box(-1, 1, (8,), np.float32)
    model.action_space = gymnasium.spaces.Box(-1, 1, (policy.low.size,), np.float32)
    model.n_envs = 1
    model._setup_model()
    actor = model.actor
    layers = [layer for layer in [*actor.latent_pi, actor.mu] if isinstance(layer, torch.nn.Linear)]
    with torch.no_grad():
        for layer, weight, bias in zip(layers, policy.weights, policy.biases, strict=True):
            layer.weight.copy_(torch.from_numpy(weight.T))
            layer.bias.copy_(torch.from_numpy(bias))
        spread = cast(torch.nn.Linear, actor.log_std)
        spread.weight.zero_()
        spread.bias.fill_(_NO_SPREAD)
    return write_atomically(path, lambda temporary: _save_sb3(model, temporary))


def _save_sb3(model: Any, path: Path) -> None:
    with path.open("wb") as file:  # of a path without .zip SB3 makes another name
        model.save(file)


def import_sb3(path: str | Path, task: SaccadeTask) -> Policy:
    """The policy of a Stable-Baselines3 SAC, stock or `OneStepSAC`, trained on `SaccadeEnv`.

    Only the tensors of the zip are read, and words beside them: no code of the file runs.

    Args:
        path: the zip that SAC's `save` wrote.
        task: what it was trained on; a zip does not say.

    Raises:
        InputError: no such file, or networks that a policy file cannot hold.
    """
    import torch

    hint = "give a zip that SAC's save wrote"
    content = read_bytes(path, most=_LARGEST_BYTES, hint=hint)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _LARGEST_BYTES:
                raise ValueError(f"it unpacks to more than {_LARGEST_BYTES // 2**20} MB")
            words = parse_json(archive.read("data"))
            with archive.open("policy.pth") as file:
                state = torch.load(file, map_location="cpu", weights_only=True)
        actor = {key.removeprefix("actor."): value for key, value in state.items() if key.startswith("actor.")}
        if sum(value.numel() for value in actor.values()) > _LARGEST_BYTES:  # which few bytes can repeat
            raise ValueError("its networks are larger than any policy's")
        _refuse_other_networks(words, actor)
        hidden = sorted({key.split(".")[1] for key in actor if key.startswith("latent_pi.")}, key=int)
        layers = [f"latent_pi.{i}" for i in hidden] + ["mu"]
        weights = tuple(actor[f"{layer}.weight"].numpy().T.astype(float) for layer in layers)
        biases = tuple(actor[f"{layer}.bias"].numpy().astype(float) for layer in layers)
    except Exception as error:  # whatever a stranger's file makes zipfile, json and torch raise
        if isinstance(error, InputError):
            raise
        raise InputError(f"{printable(path)} is no zip of a Stable-Baselines3 SAC: {error}; {hint}") from error
    source = f"imported from the Stable-Baselines3 zip {Path(path).name}"
    return Policy.of_task(task, weights, biases, case=None, config={}, versions=versions(), result={}, source=source)


def _class_name(written: Any) -> str:
    """The name of a class as SB3 writes it down: "<class 'torch.nn.modules.activation.ReLU'>"."""
    return str(written).removesuffix("'>").rsplit(".", 1)[-1]


def _refuse_other_networks(words: dict[str, Any], actor: dict[str, Any]) -> None:
    """Networks whose action would not come out the same.

    SB3 writes beside each pickle what is in it, in words: these are read, the pickle is not.
    """
    settings = words.get("policy_kwargs") or {}
    activation = _class_name(settings.get("activation_fn", "ReLU"))
    if activation != "ReLU":
        raise InputError(f"a policy file holds networks of ReLU layers, these have {activation}")
    features = _class_name(settings.get("features_extractor_class", "FlattenExtractor"))
    if features not in ("FlattenExtractor", "GazeFeatures"):
        raise InputError(f"a policy file's networks see the observation or GazeFeatures of it, these {features}")
    if words.get("use_sde") is not False:
        raise InputError("a policy file holds no state-dependent exploration (use_sde); train without it")
    others = [key for key in actor if key.split(".")[0] not in ("latent_pi", "mu", "log_std")]
    if others:
        raise InputError(f"a policy file holds no learned feature extractor, these networks have {others[0]}")
