"""Policy files: what is saved comes back, whatever is damaged is refused, and other formats say the same."""

import builtins
import hashlib
import io
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
from scipy.spatial.transform import Rotation
from stable_baselines3 import SAC

from orient_eye.environments.saccade_env import SaccadeEnv, SaccadeVecEnv, observe, to_action
from orient_eye.errors import InputError
from orient_eye.learning.policy import GAZE_INPUTS, QUATERNION_INPUTS, Policy, shipped_policies
from orient_eye.learning.policy_export import export_onnx, export_sb3, import_sb3
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.sac import GazeFeatures, OneStepSAC
from orient_eye.plants import make_plant
from orient_eye.plants.lpf import LowPassPlant
from orient_eye.resources import data_folder
from orient_eye.surrogate import Surrogate
from orient_eye.task.reward import Weights
from orient_eye.task.saccade import SaccadeTask, horizontal


def make_policy(task: SaccadeTask, seed: int = 0, sizes: tuple[int, ...] = (GAZE_INPUTS, 32, 16)) -> Policy:
    """Random networks of float32 numbers, as trained ones are."""
    random = np.random.default_rng(seed)
    sizes = (*sizes, task.action_low.size)
    weights, biases = [], []
    for a, b in itertools.pairwise(sizes):
        weights.append(random.normal(0, 1.4 / np.sqrt(a), (a, b)).astype(np.float32).astype(float))
        biases.append(random.normal(0, 0.3, b).astype(np.float32).astype(float))
    manifest = {"case": "1", "task": task.identity(), "config": {}, "versions": {}, "result": {"gap_mean": 0.01}}
    return Policy(tuple(weights), tuple(biases), task.action_low, task.action_high, manifest)


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
    manifest = policy.save(tmp_path / "new")
    assert manifest == tmp_path / "new" / "policy.json"
    for path in (manifest.parent, manifest, manifest.with_suffix(".npz"), str(manifest.parent)):
        again = Policy.load(path)
        start, target = saccades()
        assert np.array_equal(again.act(start, target), policy.act(start, target))
        assert again.manifest == policy.manifest
        assert np.array_equal(again.low, policy.low)


def test_the_same_policy_gives_the_same_bytes(policy: Policy, tmp_path: Path) -> None:
    policy.save(tmp_path / "one")
    Policy.load(tmp_path / "one").save(tmp_path / "two")
    for name in ("policy.npz", "policy.json"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_the_files_are_what_the_documentation_says(policy: Policy, tmp_path: Path) -> None:
    policy.save(tmp_path)
    manifest = json.loads((tmp_path / "policy.json").read_text())
    assert manifest["format"] == "orient-eye policy 1"
    assert manifest["sha256"] == hashlib.sha256((tmp_path / "policy.npz").read_bytes()).hexdigest()
    with np.load(tmp_path / "policy.npz", allow_pickle=False) as arrays:
        shapes = {name: (arrays[name].shape, arrays[name].dtype) for name in arrays.files}
    assert shapes["weight0"] == ((6, 32), np.float32)
    assert shapes["bias2"] == ((3,), np.float32)
    assert shapes["high"] == ((1, 3), np.float64)


def test_numbers_that_json_does_not_have_become_null(policy: Policy, tmp_path: Path) -> None:
    replace(policy, manifest={**policy.manifest, "result": {"table": [{"skewness": float("nan")}]}}).save(tmp_path)
    assert "NaN" not in (tmp_path / "policy.json").read_text()
    assert Policy.load(tmp_path).manifest["result"] == {"table": [{"skewness": None}]}


def edit_manifest(folder: Path, **changes: Any) -> None:
    path = folder / "policy.json"
    content = {**json.loads(path.read_text()), **changes}
    path.write_text(json.dumps({key: value for key, value in content.items() if value is not None}))


def replace_arrays(folder: Path, change: dict[str, Any], *, pickled: bool = False) -> None:
    """Another policy.npz, with the manifest's hash made right: damage the hash does not show."""
    with np.load(folder / "policy.npz") as file:
        arrays = {**dict(file), **change}
    arrays = {name: array for name, array in arrays.items() if array is not None}
    np.savez(folder / "policy.npz", allow_pickle=pickled, **arrays)
    edit_manifest(folder, sha256=hashlib.sha256((folder / "policy.npz").read_bytes()).hexdigest())


def spoil(folder: Path, damage: str) -> None:
    npz, manifest = folder / "policy.npz", folder / "policy.json"
    whole = npz.read_bytes()
    task = json.loads(manifest.read_text())["task"]
    actions = {
        "truncated arrays": lambda: npz.write_bytes(whole[: len(whole) // 2]),
        "one bit": lambda: npz.write_bytes(whole[:2000] + bytes([whole[2000] ^ 1]) + whole[2001:]),
        "no arrays": npz.unlink,
        "empty arrays": lambda: npz.write_bytes(b""),
        "no manifest": manifest.unlink,
        "truncated manifest": lambda: manifest.write_bytes(manifest.read_bytes()[:300]),
        "not json": lambda: manifest.write_text("weights: 1"),
        "binary manifest": lambda: manifest.write_bytes(b"\xff\xfe\x00"),
        "deep manifest": lambda: manifest.write_text("[" * 100_000),
        "a list": lambda: manifest.write_text("[]"),
        "another format": lambda: edit_manifest(folder, format="orient-eye policy 2"),
        "no hash": lambda: edit_manifest(folder, sha256=None),
        "no task": lambda: edit_manifest(folder, task=None),
        "a strange task": lambda: edit_manifest(folder, task={**task, "plant": "lpf"}),
        "a strange result": lambda: edit_manifest(folder, result=[1]),
        "other bounds": lambda: edit_manifest(folder, task={**task, "low": [[1, 2, 3]]}),
        "NaN": lambda: replace_arrays(folder, {"weight1": np.full((32, 16), np.nan)}),
        "a missing layer": lambda: replace_arrays(folder, {"weight1": None}),
        "layers that do not chain": lambda: replace_arrays(folder, {"weight1": np.zeros((31, 16))}),
        "a bias too long": lambda: replace_arrays(folder, {"bias1": np.zeros(17)}),
        "strange inputs": lambda: replace_arrays(folder, {"weight0": np.zeros((7, 32))}),
        "too many outputs": lambda: replace_arrays(folder, {"weight2": np.zeros((16, 4)), "bias2": np.zeros(4)}),
        "no layers": lambda: replace_arrays(folder, {f"{k}{i}": None for k in ("weight", "bias") for i in range(3)}),
        "bounds the wrong way": lambda: replace_arrays(folder, {"low": np.array([[90.0, -80, 5]])}),
        "negative B": lambda: replace_arrays(folder, {"low": np.array([[-1.0, -80, 5]])}),
        "words for numbers": lambda: replace_arrays(folder, {"bias0": np.array(["a"] * 32)}),
        "no zip": lambda: (npz.write_bytes(b"-"), edit_manifest(folder, sha256=hashlib.sha256(b"-").hexdigest())),
    }  # fmt: skip
    actions[damage]()


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ("truncated arrays", "damaged"),
        ("one bit", "SHA-256"),
        ("no arrays", "policy.npz"),
        ("empty arrays", "damaged"),
        ("no manifest", "there is no"),
        ("truncated manifest", "is no policy"),
        ("not json", "is no policy"),
        ("binary manifest", "is no policy"),
        ("deep manifest", "is no policy"),
        ("a list", "not of the format"),
        ("another format", "not of the format"),
        ("no hash", "'sha256'"),
        ("no task", "'task'"),
        ("a strange task", "not an object"),
        ("a strange result", "not an object"),
        ("other bounds", "bounds"),
        ("NaN", "finite"),
        ("a missing layer", "weight"),
        ("layers that do not chain", "layer 1 takes 32"),
        ("a bias too long", "layer 1"),
        ("strange inputs", "6 inputs"),
        ("too many outputs", "gives 4 numbers"),
        ("no layers", "6 inputs"),
        ("bounds the wrong way", "below"),
        ("negative B", "above 0"),
        ("words for numbers", "is no policy"),
        ("no zip", "no .npz file"),
    ],
)
def test_a_damaged_policy_is_refused(policy: Policy, tmp_path: Path, damage: str, words: str) -> None:
    policy.save(tmp_path)
    spoil(tmp_path, damage)
    with pytest.raises(InputError, match=words):
        Policy.load(tmp_path)


class Bomb:
    """Unpickling it writes a file."""

    def __init__(self, trace: Path) -> None:
        self.trace = trace

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.write_text, (self.trace, "code ran")


def test_a_pickle_in_the_arrays_does_not_run(policy: Policy, tmp_path: Path) -> None:
    policy.save(tmp_path)
    trace = tmp_path / "trace"
    replace_arrays(tmp_path, {"weight0": np.array([Bomb(trace)], dtype=object)}, pickled=True)
    with pytest.raises(InputError, match="allow_pickle"):
        Policy.load(tmp_path)
    assert not trace.exists()


def test_a_small_file_that_unpacks_to_a_large_one_is_refused(policy: Policy, tmp_path: Path) -> None:
    policy.save(tmp_path)
    file = io.BytesIO()
    np.lib.format.write_array(file, np.zeros((6, 2_000_000), np.float64))
    with zipfile.ZipFile(tmp_path / "policy.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("weight0.npy", file.getvalue())
    edit_manifest(tmp_path, sha256=hashlib.sha256((tmp_path / "policy.npz").read_bytes()).hexdigest())
    with pytest.raises(InputError, match="unpacked"):
        Policy.load(tmp_path)


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
    folders = {file.parent.name for file in data_folder("models").glob("policies/*/policy.json")}
    assert set(shipped_policies()) == folders
    for name in folders:
        shipped = Policy.load(name)
        task = shipped.task()
        assert shipped.require(task) == []
        result = shipped.manifest["result"]
        assert "out" not in result
        for row in result["table"]:
            half = row["amplitude_deg"] / 2
            start = task.fixate(horizontal(-half))
            action = shipped.act(start.orientation, horizontal(half))
            outcome = task.perform(start, action, horizontal(half))
            assert action[0, 0, [0, 2]] == pytest.approx([row["B"], row["k0"]], rel=1e-4)
            assert outcome.reward.total[0] == pytest.approx(row["reward"], rel=1e-3)


# --- the task of a policy -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("plant", "case", "options"),
    [
        ("lpf", "1", {}),
        ("lpf", "2-varying", {"speed_limit": 5000.0, "band": 0.02}),
        ("lpf", "3-fixed", {"weights": Weights(1.0, 2.0, 3.0, 4.0)}),
        ("mujoco", "2-fixed", {"horizon_s": 0.4}),
        ("tavares", "3-varying", {}),
    ],
)
def test_the_task_is_made_again_from_the_manifest(
    tmp_path: Path, plant: str, case: str, options: dict[str, Any]
) -> None:
    own = make_plant(plant) if plant != "lpf" else LowPassPlant(Surrogate(1.5123456789, 16.25))
    task = SaccadeTask.of_case(own, case, **options)
    make_policy(task).save(tmp_path)
    loaded = Policy.load(tmp_path)
    assert loaded.task().identity() == task.identity()
    assert loaded.require(task) == []


def test_options_of_the_eye_are_made_again(tmp_path: Path) -> None:
    task = SaccadeTask.of_case(make_plant("mujoco", eye="eve_v3", gravity=True, accurate=True), "1")
    make_policy(task).save(tmp_path)
    assert Policy.load(tmp_path).task().identity() == task.identity()


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (lambda t: replace(t, plant=LowPassPlant(Surrogate(1.5, 17.5))), "K 1.4758, not 1.5"),
        (lambda t: replace(t, variant=2, C=None), "pulse variant 1, not 2; C none, not 85"),
        (lambda t: replace(t, variant=3, C="varying"), "C none, not varying"),
        (lambda t: replace(t, weights=Weights(1.0, 1.0, 1.0, 1.0)), "reward weights"),
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
    task = SaccadeTask(make_plant("mujoco"), driven=("motor1", "motor2"))
    with pytest.raises(InputError, match="drives 1 motors"):
        policy.require(task, force=True)
    both = make_policy(task)
    assert both.act(*saccades()).shape == (400, 2, 3)
    assert both.require(task) == []


@pytest.mark.parametrize(
    "change",
    [
        {"variant": None},
        {"weights": {"colour": 1}},
        {"C": "sometimes"},
        {"driven": ["motor9"]},
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
    policy = make_policy(SaccadeTask(plant, driven=driven), sizes=(inputs, 128, 128, 32))
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
    start, target = (horizontal(yaw) for yaw in ([0, 0, -35, 35, 1e-5], [20, -20, 35, -35, 0]))
    path = export_onnx(policy, tmp_path / "policy.onnx")
    assert largest_difference(policy, run_onnx(path, start, target), policy.act(start, target)) < 1e-5


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
        assert largest_difference(policy, to_action(task, scaled), policy.act(start, target)) < 1e-5
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
    start, target = (horizontal(np.random.default_rng(i).uniform(-35, 35, 50)) for i in (1, 2))
    scaled, _ = model.predict(observe(start, target), deterministic=True)
    acted = Policy.load(tmp_path / "policy").act(start, target)
    assert largest_difference(imported, to_action(task, scaled), acted) < 1e-5


def stock(tmp_path: Path, task: SaccadeTask, **settings: Any) -> Path:
    options = {"policy_kwargs": {"net_arch": [16, 8]}, "buffer_size": 10, "device": "cpu", **settings}
    SAC("MlpPolicy", SaccadeEnv(task), **options).save(tmp_path / "stock.zip")
    return tmp_path / "stock.zip"


def test_stock_sac_is_imported(task: SaccadeTask, tmp_path: Path) -> None:
    path = stock(tmp_path, task)
    model = SAC.load(path, device="cpu")
    imported = import_sb3(path, task)
    assert imported.inputs == QUATERNION_INPUTS
    start, target = (horizontal(np.random.default_rng(i).uniform(-35, 35, 50)) for i in (1, 2))
    scaled, _ = model.predict(observe(start, target), deterministic=True)
    assert largest_difference(imported, to_action(task, scaled), imported.act(start, target)) < 1e-5


def test_networks_that_would_act_otherwise_are_not_imported(task: SaccadeTask, tmp_path: Path) -> None:
    import torch

    for other in (torch.nn.Tanh, torch.nn.ReLU6, torch.nn.LeakyReLU):
        with pytest.raises(InputError, match=f"have {other.__name__}$"):
            import_sb3(stock(tmp_path, task, policy_kwargs={"net_arch": [8], "activation_fn": other}), task)
    with pytest.raises(InputError, match="use_sde"):
        import_sb3(stock(tmp_path, task, use_sde=True), task)
    two = SaccadeTask(make_plant("tavares"), driven=("motor1", "motor2"))
    with pytest.raises(InputError, match="gives 3 numbers"):
        import_sb3(stock(tmp_path, task), two)
    for content in (b"", b"no zip"):
        (tmp_path / "bad.zip").write_bytes(content)
        with pytest.raises(InputError, match="no zip of a Stable-Baselines3"):
            import_sb3(tmp_path / "bad.zip", task)


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
