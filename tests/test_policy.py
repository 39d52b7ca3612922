"""Policy files: what is saved comes back, whatever is damaged is refused, and other formats say the same."""

import builtins
import hashlib
import itertools
import json
import pickle
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import pytest
import safetensors.numpy
import torch
from scipy.spatial.transform import Rotation
from stable_baselines3 import SAC

from orient_eye.environments.batch import observe
from orient_eye.environments.saccade_env import SaccadeEnv
from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.errors import InputError
from orient_eye.learning.features import GAZE_INPUTS, QUATERNION_INPUTS
from orient_eye.learning.policy import Policy, shipped_policies
from orient_eye.learning.policy_export import export_onnx, export_sb3, import_sb3
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.sac import GazeFeatures, OneStepSAC
from orient_eye.listing import with_torsion
from orient_eye.movement.oblique import toward
from orient_eye.plants import make_plant
from orient_eye.plants.linear import LinearPlant
from orient_eye.resources import data_folder
from orient_eye.rotations import from_yaw, to_euler
from orient_eye.surrogate import Surrogate
from orient_eye.task.cases import Case
from orient_eye.task.saccade import SaccadeTask

WEIGHTS = {"accuracy": 1.0, "energy": 2.0, "duration": 3.0, "overshoot": 4.0}


def make_policy(task: SaccadeTask, seed: int = 0, sizes: tuple[int, ...] = (GAZE_INPUTS, 32, 16)) -> Policy:
    """Random networks of float32 numbers, as trained ones are."""
    random = np.random.default_rng(seed)
    sizes = (*sizes, len(task.actions.numbers))
    weights, biases = [], []
    for a, b in itertools.pairwise(sizes):
        weights.append(random.normal(0, 1.4 / np.sqrt(a), (a, b)).astype(np.float32).astype(float))
        biases.append(random.normal(0, 0.3, b).astype(np.float32).astype(float))
    manifest = {"case": "1", "config": {}, "versions": {}, "result": {"gap_mean": 0.01}}
    return Policy.of_task(task, tuple(weights), tuple(biases), **manifest)


def logarithmic(policy: Policy) -> Policy:
    """The same network with B and k0 on a logarithmic scale."""
    return replace(policy, log=np.array([True, False, True]))


def orientations(count: int, random: np.random.Generator) -> np.ndarray:
    turn = Rotation.from_rotvec(random.uniform(-35, 35, (count, 3)), degrees=True)
    return turn.as_quat(scalar_first=True)


def saccades(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Starts and targets: anywhere, the same, a tiny turn apart; quaternions of either sign, some of length 2."""
    random = np.random.default_rng(seed)
    start, target = orientations(400, random), orientations(400, random)
    target[:50] = start[:50]
    tiny = Rotation.from_rotvec(10 ** random.uniform(-14, -2, (100, 1)) * random.normal(size=(100, 3)))
    target[50:150] = (tiny * Rotation.from_quat(start[50:150], scalar_first=True)).as_quat(scalar_first=True)
    start[::3] *= -1
    target[::5] *= -1
    start[::7] *= 2
    return start, target


def largest_difference(policy: Policy, one: np.ndarray, two: np.ndarray) -> float:
    """Share of the range of each part of the action."""
    assert one.shape == two.shape
    return float((np.abs(one - two) / (policy.high - policy.low)).max())


@pytest.fixture(scope="module")
def task() -> SaccadeTask:
    return SaccadeTask.of_case(make_plant("lpf"), "1")


@pytest.fixture
def policy(task: SaccadeTask) -> Policy:
    return make_policy(task)


# --- files ----------------------------------------------------------------------------------------------


def test_what_is_saved_comes_back(policy: Policy, tmp_path: Path) -> None:
    for name, saved in (("linear", policy), ("log", logarithmic(policy))):
        file = saved.save(tmp_path / name)
        assert file == tmp_path / name / "policy.safetensors"
        for path in (file.parent, file, str(file.parent)):
            again = Policy.load(path)
            start, target = saccades()
            assert np.array_equal(again.act(start, target), saved.act(start, target))
            assert again.manifest == saved.manifest
            assert np.array_equal(again.low, saved.low)
            assert np.array_equal(again.log, saved.log)


def test_the_scale_of_each_number_is_the_actions_own(policy: Policy) -> None:
    """Where tanh of the network's output is s, a linear number is the middle plus s half ranges; a log one in logs."""
    start, target = saccades()
    linear, log = policy.act(start, target), logarithmic(policy).act(start, target)
    s = ((linear - (policy.high + policy.low) / 2) / ((policy.high - policy.low) / 2))[:, [0, 2]]
    low, high = np.log(policy.low[[0, 2]]), np.log(policy.high[[0, 2]])
    np.testing.assert_allclose(np.log(log[:, [0, 2]]), (high + low) / 2 + s * (high - low) / 2, rtol=1e-12)
    np.testing.assert_array_equal(log[:, 1], linear[:, 1])


def test_the_same_policy_gives_the_same_bytes(policy: Policy, tmp_path: Path) -> None:
    one = policy.save(tmp_path / "one").read_bytes()
    assert Policy.load(tmp_path / "one").save(tmp_path / "two").read_bytes() == one
    turned = replace(policy, weights=tuple(np.asfortranarray(w) for w in policy.weights))
    assert turned.save(tmp_path / "three").read_bytes() == one


def test_the_file_is_what_the_documentation_says(policy: Policy, tmp_path: Path) -> None:
    content = policy.save(tmp_path).read_bytes()
    head = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])  # of the format safetensors
    manifest = json.loads(head.pop("__metadata__")["orient-eye"])
    assert manifest["format"] == "orient-eye policy 2"
    assert manifest["numbers"] == [
        {"name": "B", "unit": "1/s"},
        {"name": "D", "unit": "deg"},
        {"name": "k0", "unit": "1/s"},
    ]
    assert manifest["weights_from"].startswith("shipped: thesis 4.4.5")
    told = {name: (tuple(entry["shape"]), entry["dtype"]) for name, entry in head.items()}
    assert told["weight0"] == ((6, 32), "F32")
    assert told["bias2"] == ((3,), "F32")
    assert told["high"] == ((3,), "F64")
    assert told["log"] == ((3,), "BOOL")


def test_numbers_that_json_does_not_have_become_null(policy: Policy, tmp_path: Path) -> None:
    file = replace(policy, manifest={**policy.manifest, "result": {"table": [{"skewness": float("nan")}]}}).save(
        tmp_path
    )
    assert b"NaN" not in file.read_bytes()
    assert Policy.load(tmp_path).manifest["result"] == {"table": [{"skewness": None}]}


def rewrite(file: Path, arrays: dict[str, Any] | None = None, **manifest: Any) -> None:
    """Another file with its hash made right: damage that the hash does not show. None leaves an entry out."""
    held = {**safetensors.numpy.load_file(file), **(arrays or {})}
    held = {name: array for name, array in held.items() if array is not None}
    with safetensors.safe_open(file, "numpy") as opened:
        words = {**json.loads(opened.metadata()["orient-eye"]), **manifest}
    words = {key: value for key, value in words.items() if value is not None}
    if "sha256" not in manifest:
        hashed = {key: value for key, value in words.items() if key not in ("format", "sha256")}
        digest = hashlib.sha256(json.dumps(hashed, sort_keys=True).encode())
        for name in sorted(held):
            digest.update(f"{name} {held[name].dtype} {held[name].shape}".encode())
            digest.update(held[name].tobytes())
        words["sha256"] = digest.hexdigest()
    safetensors.numpy.save_file(held, file, {"orient-eye": json.dumps(words)})


def spoil(file: Path, damage: str) -> None:
    whole = file.read_bytes()
    with safetensors.safe_open(file, "numpy") as opened:
        task = json.loads(opened.metadata()["orient-eye"])["task"]
    bounds = {**task, "actions": {**task["actions"], "low": [1, 2, 3]}}
    actions = {
        "truncated": lambda: file.write_bytes(whole[: len(whole) // 2]),
        "one bit of the arrays": lambda: file.write_bytes(whole[:-99] + bytes([whole[-99] ^ 1]) + whole[-98:]),
        "one digit of the manifest": lambda: file.write_bytes(whole.replace(b"26600000.0", b"26600001.0", 1)),
        "nothing in it": lambda: file.write_bytes(b""),
        "no file": file.unlink,
        "text": lambda: file.write_text("weights: 1"),
        "a huge header": lambda: file.write_bytes((2**60).to_bytes(8, "little") + whole[8:]),
        "no metadata": lambda: safetensors.numpy.save_file(safetensors.numpy.load(whole), file),
        "a deep manifest": lambda: safetensors.numpy.save_file({}, file, {"orient-eye": "[" * 100_000}),
        "a list": lambda: safetensors.numpy.save_file({}, file, {"orient-eye": "[]"}),
        "another format": lambda: rewrite(file, format="orient-eye policy 3"),
        "no hash": lambda: rewrite(file, sha256=None),
        "no task": lambda: rewrite(file, task=None),
        "a strange task": lambda: rewrite(file, task={**task, "plant": "lpf"}),
        "strange actions": lambda: rewrite(file, task={**task, "actions": "pulse-step"}),
        "a number beyond floats": lambda: rewrite(file, result=10**400),
        "NaN in words": lambda: rewrite(file, result={"gap_mean": float("nan")}),
        "a name too few": lambda: rewrite(file, numbers=[]),
        "a strange result": lambda: rewrite(file, result=[1]),
        "other bounds": lambda: rewrite(file, task=bounds),
        "NaN": lambda: rewrite(file, {"weight1": np.full((32, 16), np.nan)}),
        "a missing layer": lambda: rewrite(file, {"weight1": None}),
        "no scale": lambda: rewrite(file, {"log": None}),
        "layers that do not chain": lambda: rewrite(file, {"weight1": np.zeros((31, 16))}),
        "a bias too long": lambda: rewrite(file, {"bias1": np.zeros(17)}),
        "strange inputs": lambda: rewrite(file, {"weight0": np.zeros((7, 32))}),
        "too many outputs": lambda: rewrite(file, {"weight2": np.zeros((16, 4)), "bias2": np.zeros(4)}),
        "no layers": lambda: rewrite(file, {f"{k}{i}": None for k in ("weight", "bias") for i in range(3)}),
        "bounds the wrong way": lambda: rewrite(file, {"low": np.array([90.0, -80, 5])}),
        "a logarithm of nothing": lambda: rewrite(file, {"log": np.ones(3, bool)}),
    }  # fmt: skip
    actions[damage]()


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ("truncated", "cannot read"),
        ("one bit of the arrays", "SHA-256"),
        ("one digit of the manifest", "SHA-256"),
        ("nothing in it", "cannot read"),
        ("no file", "there is no"),
        ("text", "cannot read"),
        ("a huge header", "cannot read"),
        ("no metadata", "not of the format"),
        ("a deep manifest", "is no policy"),
        ("a list", "not of the format"),
        ("another format", "not of the format"),
        ("no hash", "'sha256'"),
        ("no task", "'task'"),
        ("a strange task", "not an object"),
        ("strange actions", "is no policy"),
        ("a number beyond floats", "is no finite number"),
        ("NaN in words", "NaN is no finite number"),
        ("a name too few", "gives 3 numbers, but not as many names"),
        ("a strange result", "not an object"),
        ("other bounds", "bounds"),
        ("NaN", "finite"),
        ("a missing layer", "weight"),
        ("no scale", "'log'"),
        ("layers that do not chain", "layer 1 takes 32"),
        ("a bias too long", "layer 1"),
        ("strange inputs", "6 inputs"),
        ("too many outputs", "gives 4 numbers"),
        ("no layers", "6 inputs"),
        ("bounds the wrong way", "below"),
        ("a logarithm of nothing", "above 0"),
    ],
)
def test_a_damaged_policy_is_refused(policy: Policy, tmp_path: Path, damage: str, words: str) -> None:
    spoil(policy.save(tmp_path), damage)
    with pytest.raises(InputError, match=words):
        Policy.load(tmp_path)


def test_a_policy_of_the_old_format_says_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "policy.json").write_text('{"format": "orient-eye policy 1"}')
    for path in (tmp_path, tmp_path / "policy.json"):
        with pytest.raises(InputError, match=r"format 1 .* train it again, or use it with that version"):
            Policy.load(path)


def test_a_file_larger_than_any_policy_is_not_read(policy: Policy, tmp_path: Path) -> None:
    file = policy.save(tmp_path)
    with file.open("r+b") as opened:
        opened.truncate(2**40)  # a hole: it takes no room
    with pytest.raises(InputError, match=r"policy\.safetensors: it is larger than 64 MB; give a run directory"):
        Policy.load(tmp_path)


class Bomb:
    """Unpickling it writes a file."""

    def __init__(self, trace: Path) -> None:
        self.trace = trace

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.write_text, (self.trace, "code ran")


def test_a_pickle_in_place_of_a_policy_does_not_run(policy: Policy, tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    policy.save(tmp_path).write_bytes(pickle.dumps(Bomb(trace)))
    with pytest.raises(InputError, match=r"^cannot read .*policy\.safetensors: .*; give a run directory"):
        Policy.load(tmp_path)
    assert not trace.exists()


# --- shipped policies -----------------------------------------------------------------------------------


def test_the_name_of_no_policy_lists_the_shipped_ones(
    policy: Policy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "surrogates").mkdir()
    policy.save(tmp_path / "policies" / "a-name")
    monkeypatch.setattr("orient_eye.learning.policy.data_folder", lambda name: tmp_path)
    assert Policy.load("a-name").manifest == policy.manifest
    with pytest.raises(InputError, match="a-name") as error:
        Policy.load("another-name")
    assert "another-name is no policy" in str(error.value)


def test_shipped_policies_keep_what_their_manifests_say() -> None:
    folders = {file.parent.name for file in data_folder("models").glob("policies/*/policy.safetensors")}
    assert set(shipped_policies()) == folders
    for name in folders:
        shipped = Policy.load(name)
        task = shipped.task()
        assert shipped.require(task) == []
        result = shipped.manifest["result"]
        assert "out" not in result
        if task.targets.name == "horizontal":
            half = np.array([row["amplitude_deg"] for row in result["table"]]) / 2
            start, target = task.targets.rest(from_yaw(-half)), from_yaw(half)
        else:
            around = {"left": 0.0, "left and up": 45.0, "up": 90.0, "left and down": -45.0}
            ways = np.deg2rad([around[row["direction"]] for row in result["table"]])
            half = np.array([row["amplitude_deg"] for row in result["table"]])[:, None] / 2
            ends = half * np.stack([np.cos(ways), np.sin(ways)], axis=1)
            angles = [np.stack(to_euler(with_torsion(toward(way), 0.0))[:2], axis=-1) for way in (-ends, ends)]
            start, target = task.targets.rest(task.targets.orientation(angles[0])), task.targets.orientation(angles[1])
        action = shipped.act(start.orientation, target)
        outcome = task.perform(start, action, target)
        names, told = task.actions.plain.names, task.actions.as_plain(start, target, action)
        for row, numbers, reward in zip(result["table"], told, outcome.reward.total, strict=True):
            rates = {name: value for name, value in zip(names, numbers, strict=True) if not name.startswith("D")}
            assert rates == pytest.approx({name: row[name] for name in rates}, rel=1e-4)
            assert reward == pytest.approx(row["reward"], rel=1e-3)


# --- the task of a policy -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("plant", "case", "options"),
    [
        ("lpf", "1", {}),
        ("lpf", "2-varying", {"speed_limit": 5000.0, "band": 0.02}),
        ("lpf", "3-fixed", {"weights": WEIGHTS}),
        ("lpf", "1", {"targets": "horizontal", "judge": "gaze", "weights": {**WEIGHTS, "force": 0.0}}),
        ("tavares", "1", {"targets": "vertical", "weights": WEIGHTS}),
        ("mujoco", "2-fixed", {"horizon_s": 0.4}),
        ("tavares", "3-varying", {}),
    ],
)
def test_the_task_is_made_again_from_the_manifest(
    tmp_path: Path, plant: str, case: str, options: dict[str, Any]
) -> None:
    own = make_plant(plant) if plant != "lpf" else LinearPlant(Surrogate(1.5123456789, 16.25))
    task = SaccadeTask.of_case(own, case, **options)
    make_policy(task).save(tmp_path)
    loaded = Policy.load(tmp_path)
    assert loaded.task().identity() == task.identity()
    assert loaded.require(task) == []


def test_options_of_the_eye_are_made_again(tmp_path: Path) -> None:
    plant = make_plant("mujoco", eye="eve_v3", gravity=True, accurate=True)
    task = SaccadeTask.of_case(plant, "1", weights=WEIGHTS)
    make_policy(task).save(tmp_path)
    assert Policy.load(tmp_path).task().identity() == task.identity()


def of_case(task: SaccadeTask, case: Case) -> SaccadeTask:
    return SaccadeTask.of_case(task.plant, case, weights=task.weights)


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (lambda t: replace(t, plant=LinearPlant(Surrogate(1.5, 17.5))), "K 1.4758, not 1.5"),
        (lambda t: of_case(t, Case("2")), "pulse 1, not 2; C none, not 85"),
        (lambda t: of_case(t, Case("3", "varying")), "C none, not varying; speed limit none, not 7200"),
        (lambda t: replace(t, weights=WEIGHTS), "reward weights"),
        (lambda t: replace(t, judge="gaze", weights={**t.weights, "force": 0.0}), "judge orientation, not gaze"),
        (lambda t: replace(t, band=0.02), "settling band 0.01, not 0.02"),
        (lambda t: replace(t, plant=make_plant("mujoco")), r"plant lpf \(K = 1.4758, w0 = 17.5\), not mujoco"),
    ],
)  # fmt: skip
def test_another_task_is_refused_unless_forced(task: SaccadeTask, policy: Policy, other: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        policy.require(other(task))
    assert policy.require(other(task), force=True)
    assert policy.require(task, force=True) == []


def test_another_model_of_the_eye_is_refused() -> None:
    task = SaccadeTask.of_case(make_plant("mujoco"), "1")
    identity = task.identity()
    identity["plant"]["model"] = "0123456789abcdef"
    changed = replace(make_policy(task), manifest={"task": identity})
    with pytest.raises(InputError, match="0123456789abcdef, not"):
        changed.require(task)


def test_motors_that_are_not_driven_cannot_be_forced(policy: Policy) -> None:
    task = SaccadeTask.of_case(make_plant("mujoco"), "1", driven=("motor1", "motor2"), weights=WEIGHTS)
    with pytest.raises(InputError, match=r"gives 3 numbers.*takes 6 \(B_motor1, D_motor1"):
        policy.require(task, force=True)
    both = make_policy(task)
    assert both.act(*saccades()).shape == (400, 6)
    assert both.require(task) == []


@pytest.mark.parametrize(
    "change",
    [
        {"actions": None},
        {"actions": {"actions": "pulse-step", "driven": ["motor2"], "pulse": "7"}},
        {"actions": {"actions": "pulse-step", "driven": ["motor2"], "pulse": "2", "C": "sometimes"}},
        {"actions": {"actions": "pulse-step", "driven": ["motor9"], "pulse": "1"}},
        {"actions": {"actions": "telepathy", "driven": ["motor2"]}},
        {"targets": {"targets": "nowhere"}},
        {"targets": {"targets": "horizontal", "limit_deg": 1e9}},
        {"judge": "friendly"},
        {"weights": {"colour": 1}},
        {"plant": {"plant": "lpf", "K": "x", "w0": 1, "motor": "motor2"}},
        {"plant": {"plant": "clay"}},
        {"plant": {"plant": "mujoco", "eye": ["thesis"]}},
        {"plant": {"plant": "mujoco", "eye": "thesis", "threads": 10**6}},
        {"band": 7},
    ],
)
def test_a_task_that_this_version_cannot_make_is_refused(policy: Policy, change: dict[str, Any]) -> None:
    strange = replace(policy, manifest={"task": {**policy.manifest["task"], **change}})
    with pytest.raises(InputError):
        strange.task()


# --- other formats --------------------------------------------------------------------------------------


def run_onnx(path: Path, start: np.ndarray, target: np.ndarray) -> np.ndarray:
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    return session.run(None, {"start": start.astype(np.float32), "target": target.astype(np.float32)})[0]


@pytest.mark.parametrize("inputs", [GAZE_INPUTS, QUATERNION_INPUTS])
@pytest.mark.parametrize("driven", [("motor2",), ("motor1", "motor2", "motor3")])
def test_onnx_gives_the_same_actions(tmp_path: Path, inputs: int, driven: tuple[str, ...]) -> None:
    plant = make_plant("lpf") if driven == ("motor2",) else make_plant("tavares")
    task = SaccadeTask.of_case(plant, "1", driven=driven, weights=WEIGHTS)
    policy = make_policy(task, sizes=(inputs, 128, 128, 32))
    path = export_onnx(policy, tmp_path / "policy.onnx")
    start, target = saccades()
    assert largest_difference(policy, run_onnx(path, start, target), policy.act(start, target)) < 1e-4
    one = slice(0, 1)
    assert (
        largest_difference(policy, run_onnx(path, start[one], target[one]), policy.act(start[one], target[one])) < 1e-4
    )
    model = onnx.load(path)
    about = {entry.key: json.loads(entry.value) for entry in model.metadata_props}
    assert about["orient-eye"]["task"] == policy.manifest["task"]


def test_onnx_of_horizontal_saccades_has_the_sign_of_the_turn(policy: Policy, tmp_path: Path) -> None:
    start, target = (from_yaw(yaw) for yaw in ([0, 0, -35, 35, 1e-5], [20, -20, 35, -35, 0]))
    path = export_onnx(policy, tmp_path / "policy.onnx")
    assert largest_difference(policy, run_onnx(path, start, target), policy.act(start, target)) < 1e-5


def test_onnx_of_a_logarithmic_scale(policy: Policy, tmp_path: Path) -> None:
    log = logarithmic(policy)
    start, target = saccades()
    acted = run_onnx(export_onnx(log, tmp_path / "policy.onnx"), start, target)
    assert largest_difference(policy, acted, log.act(start, target)) < 1e-4


@pytest.mark.parametrize("inputs", [GAZE_INPUTS, QUATERNION_INPUTS])
@pytest.mark.parametrize("log", [False, True])
def test_the_torch_module_gives_the_same_actions(task: SaccadeTask, inputs: int, log: bool) -> None:
    policy = make_policy(task, sizes=(inputs, 128, 128, 32))
    policy = logarithmic(policy) if log else policy
    start, target = saccades()
    for dtype, within in ((torch.float32, 1e-4), (torch.float64, 1e-7)):
        module = policy.torch_module().to(dtype)
        acted = module(torch.tensor(start, dtype=dtype), torch.tensor(target, dtype=dtype))
        assert acted.dtype == dtype
        assert largest_difference(policy, acted.detach().numpy(), policy.act(start, target)) < within


def test_the_torch_module_can_be_trained_and_leaves_the_policy_alone(policy: Policy) -> None:
    module = policy.torch_module()
    start, target = (torch.tensor(q, dtype=torch.float32) for q in saccades())
    before = policy.act(*saccades())
    module(start, target).sum().backward()
    torch.optim.SGD(module.parameters(), lr=1e-3).step()
    assert all(bool(p.grad.abs().sum() > 0) for p in module.parameters() if p.grad is not None)
    assert not np.allclose(module(start, target).detach().numpy(), before, rtol=1e-3)
    np.testing.assert_array_equal(policy.act(*saccades()), before)


def test_onnx_without_its_packages_says_what_to_install(
    policy: Policy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = builtins.__import__

    def no_onnx(name: str, *rest: Any, **more: Any) -> Any:
        if name == "onnx":
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", no_onnx)
    with pytest.raises(InputError, match=r'pip install "orient-eye\[onnx\]"'):
        export_onnx(policy, tmp_path / "policy.onnx")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("inputs", [GAZE_INPUTS, QUATERNION_INPUTS])
def test_an_sb3_zip_gives_the_same_actions_and_comes_back(task: SaccadeTask, tmp_path: Path, inputs: int) -> None:
    policy = make_policy(task, sizes=(inputs, 32, 16))
    path = export_sb3(policy, tmp_path / "policy.zip")
    assert [file.name for file in tmp_path.iterdir()] == ["policy.zip"]
    model = OneStepSAC.load(path, device="cpu")
    start, target = saccades()
    start /= np.linalg.norm(start, axis=1, keepdims=True)
    for deterministic in (True, False):
        scaled, _ = model.predict(observe(start, target), deterministic=deterministic)
        assert largest_difference(policy, task.actions.from_unit(scaled), policy.act(start, target)) < 1e-5
    again = import_sb3(path, task)
    assert np.array_equal(again.act(start, target), policy.act(start, target))
    assert again.manifest["task"] == task.identity()


def test_the_zip_of_a_trained_model_is_imported(task: SaccadeTask, tmp_path: Path) -> None:
    env = SaccadeVecEnv(32, task, log_reward=True, seed=0)
    model = OneStepSAC(
        "MlpPolicy",
        env,
        replay_buffer_class=OneStepReplayBuffer,
        buffer_size=1000,
        batch_size=32,
        learning_starts=32,
        gradient_steps=1,
        seed=0,
        device="cpu",
        policy_kwargs={"net_arch": [16, 8], "features_extractor_class": GazeFeatures},
    )
    model.learn(320)
    model.save(tmp_path / "trained.zip")
    imported = import_sb3(tmp_path / "trained.zip", task)
    imported.save(tmp_path / "policy")
    start, target = (from_yaw(np.random.default_rng(i).uniform(-35, 35, 50)) for i in (1, 2))
    scaled, _ = model.predict(observe(start, target), deterministic=True)
    acted = Policy.load(tmp_path / "policy").act(start, target)
    assert largest_difference(imported, task.actions.from_unit(scaled), acted) < 1e-5


def stock(tmp_path: Path, task: SaccadeTask, **settings: Any) -> Path:
    options = {"policy_kwargs": {"net_arch": [16, 8]}, "buffer_size": 10, "device": "cpu", **settings}
    SAC("MlpPolicy", SaccadeEnv(task), **options).save(tmp_path / "stock.zip")
    return tmp_path / "stock.zip"


def test_stock_sac_is_imported(task: SaccadeTask, tmp_path: Path) -> None:
    path = stock(tmp_path, task)
    model = SAC.load(path, device="cpu")
    imported = import_sb3(path, task)
    assert imported.inputs == QUATERNION_INPUTS
    start, target = (from_yaw(np.random.default_rng(i).uniform(-35, 35, 50)) for i in (1, 2))
    scaled, _ = model.predict(observe(start, target), deterministic=True)
    assert largest_difference(imported, task.actions.from_unit(scaled), imported.act(start, target)) < 1e-5


def test_networks_that_would_act_otherwise_are_not_imported(task: SaccadeTask, tmp_path: Path) -> None:
    for other in (torch.nn.Tanh, torch.nn.ReLU6, torch.nn.LeakyReLU):
        with pytest.raises(InputError, match=f"have {other.__name__}$"):
            import_sb3(stock(tmp_path, task, policy_kwargs={"net_arch": [8], "activation_fn": other}), task)
    with pytest.raises(InputError, match="use_sde"):
        import_sb3(stock(tmp_path, task, use_sde=True), task)
    two = SaccadeTask.of_case(make_plant("tavares"), "1", driven=("motor1", "motor2"), weights=WEIGHTS)
    with pytest.raises(InputError, match="gives 3 numbers"):
        import_sb3(stock(tmp_path, task), two)
    for content in (b"", b"no zip", b"[" * 100_000, b"10" * 300, b"NaN     NaN"):
        (tmp_path / "bad.zip").write_bytes(content[:1000])
        if len(content) > 10:
            with zipfile.ZipFile(tmp_path / "bad.zip", "w", zipfile.ZIP_DEFLATED) as archive:
                archive.writestr("data", content)
                archive.writestr("policy.pth", b"")
        with pytest.raises(
            InputError, match=r"no zip of a Stable-Baselines3 SAC: .*; give a zip that SAC's save wrote"
        ):
            import_sb3(tmp_path / "bad.zip", task)
    with pytest.raises(InputError, match=r"cannot read .*nowhere\.zip: No such file or directory; give a zip"):
        import_sb3(tmp_path / "nowhere.zip", task)


def test_importing_a_zip_runs_none_of_its_code(task: SaccadeTask, tmp_path: Path) -> None:
    import base64

    trace, evil = tmp_path / "trace", tmp_path / "evil.zip"
    with zipfile.ZipFile(stock(tmp_path, task)) as good, zipfile.ZipFile(evil, "w") as bad:
        words = json.loads(good.read("data"))
        bomb = base64.b64encode(pickle.dumps(Bomb(trace))).decode()
        words["lr_schedule"] = {":type:": "function", ":serialized:": bomb}
        bad.writestr("data", json.dumps(words))
        for name in good.namelist():
            if name != "data":
                bad.writestr(name, good.read(name))
    import_sb3(evil, task)
    assert not trace.exists()
    SAC.load(evil, device="cpu")  # the same file does run code when SB3 loads it: the warning is no empty one
    assert trace.exists()
