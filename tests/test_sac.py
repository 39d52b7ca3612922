"""OneStepSAC: hand-written gradients against autograd, the replay buffer, and SB3's interface."""

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.errors import InputError
from orient_eye.learning.network import Network, flatten, take_step
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.sac import GazeFeatures, OneStepSAC, falling_temperature
from orient_eye.rotations import from_euler, rotation


def make_model(env: VecEnv, critics: int = 1, **settings: object) -> OneStepSAC:
    model = OneStepSAC(
        "MlpPolicy",
        env,
        replay_buffer_class=OneStepReplayBuffer,
        replay_buffer_kwargs={"seed": 1},
        batch_size=64,
        buffer_size=1000,
        learning_starts=32,
        train_freq=1,
        gradient_steps=1,
        seed=0,
        policy_kwargs={"net_arch": [16, 8], "features_extractor_class": GazeFeatures, "n_critics": critics},
        **{"temperature": falling_temperature(1.0, 1e-3), "device": "cpu", **settings},
    )
    model.set_logger(Logger(folder=None, output_formats=[]))
    return model


@pytest.fixture
def env() -> SaccadeVecEnv:
    return SaccadeVecEnv(16, "lpf", log_reward=True, seed=0)


def test_network_passes_are_those_of_autograd() -> None:
    torch.manual_seed(0)
    layers = [torch.nn.Linear(5, 7), torch.nn.ReLU(), torch.nn.Linear(7, 4), torch.nn.ReLU(), torch.nn.Linear(4, 3)]
    module = torch.nn.Sequential(*layers).double()
    x = torch.randn(20, 5, dtype=torch.float64, requires_grad=True)
    upstream = torch.randn(20, 3, dtype=torch.float64)
    (module(x) * upstream).sum().backward()
    expected = [p.grad.clone() for p in module.parameters() if p.grad is not None]
    flatten(module.parameters())
    network = Network(module)
    with torch.no_grad():
        values = network.forward(x)
        by_input = network.backward(values, upstream, of_parameters=True, of_input=True)
    torch.testing.assert_close(values[-1], module(x))
    torch.testing.assert_close(by_input, x.grad)
    for ours, autograd in zip(module.parameters(), expected, strict=True):
        torch.testing.assert_close(ours.grad, autograd)


def test_network_refuses_other_layers() -> None:
    for modules in ([], [torch.nn.Linear(2, 2), torch.nn.Tanh(), torch.nn.Linear(2, 2)], [torch.nn.ReLU()]):
        with pytest.raises(InputError, match="ReLU between"):
            Network(modules)


@pytest.mark.parametrize(
    "settings",
    [{"fused": True}, {"foreach": False}, {"amsgrad": True, "weight_decay": 0.1, "decoupled_weight_decay": True}],
)
def test_step_of_a_flat_vector_is_that_of_torchs_adam(settings: dict[str, Any]) -> None:
    torch.manual_seed(0)
    flat, plain = torch.nn.Linear(5, 3), torch.nn.Linear(5, 3)
    plain.load_state_dict(flat.state_dict())
    ours = torch.optim.Adam([flatten(flat.parameters())], lr=0.01, **settings)
    torchs = torch.optim.Adam(plain.parameters(), lr=0.01, **settings)
    for _ in range(5):
        for mine, other in zip(flat.parameters(), plain.parameters(), strict=True):
            assert mine.grad is not None
            other.grad = torch.randn_like(other)
            mine.grad.copy_(other.grad)
        take_step(ours)
        torchs.step()
    for mine, other in zip(flat.parameters(), plain.parameters(), strict=True):
        torch.testing.assert_close(mine, other)


DEVICES = [
    "cpu",
    pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no GPU")),
]


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("critics", [1, 2])
def test_update_is_that_of_autograd_on_sb3s_own_networks(env: SaccadeVecEnv, critics: int, device: str) -> None:
    model = make_model(env, critics, device=device)
    model.learn(64)
    assert model.replay_buffer is not None
    data = model.replay_buffer.sample(64)
    temperature = torch.tensor(0.3, device=device)
    model.ent_coef_tensor = temperature
    features = model.actor.extract_features(data.observations, model.actor.features_extractor)
    # Autograd, through SB3's own critic and squashed Gaussian.
    q_loss = sum(torch.nn.functional.mse_loss(q, data.rewards) for q in model.critic(data.observations, data.actions))
    assert isinstance(q_loss, torch.Tensor)
    by_q = torch.autograd.grad(q_loss, list(model.critic.parameters()))
    torch.manual_seed(5)
    actions, log_probability = model.actor.action_log_prob(data.observations)
    q = torch.cat(model.critic(data.observations, actions), dim=1).amin(dim=1)
    policy_loss = (temperature * log_probability - q).mean()
    by_policy = torch.autograd.grad(policy_loss, list(model.actor.parameters()))
    # Ours, without taking the steps.
    for optimizer in (model.critic.optimizer, model.actor.optimizer):
        for group in optimizer.param_groups:
            group["lr"] = 0.0
    with torch.no_grad():
        ours_q = model._update_q(features, data.actions, data.rewards)
        torch.manual_seed(5)
        ours_policy, _ = model._update_policy(features)
    torch.testing.assert_close(ours_q, q_loss.detach())
    torch.testing.assert_close(ours_policy, policy_loss.detach(), rtol=1e-4, atol=1e-5)
    for parameter, gradient in zip(model.critic.parameters(), by_q, strict=True):
        torch.testing.assert_close(parameter.grad, gradient, rtol=1e-4, atol=1e-6)
    for parameter, gradient in zip(model.actor.parameters(), by_policy, strict=True):
        torch.testing.assert_close(parameter.grad, gradient, rtol=1e-3, atol=1e-6)


def test_features_are_rotation_vectors() -> None:
    random = np.random.default_rng(0)
    a, b = (from_euler(*random.uniform(-35, 35, (3, 50))) for _ in range(2))
    b[:5] = a[:5]  # no turn at all
    space = SaccadeVecEnv(1, "lpf").observation_space
    got = GazeFeatures(space)(torch.from_numpy(np.concatenate([a, b], axis=1))).numpy() * 35
    turn = rotation(b) * rotation(a).inv()
    expected = np.concatenate([rotation(a).as_rotvec(degrees=True), turn.as_rotvec(degrees=True)], axis=1)
    np.testing.assert_allclose(got, expected, atol=1e-6)


def test_temperature_falls_geometrically_then_stays() -> None:
    temperature = falling_temperature(1.0, 0.01, until=0.8)
    assert temperature(1.0) == 1.0
    assert temperature(0.6) == pytest.approx(0.1)
    assert temperature(0.2) == pytest.approx(0.01)
    assert temperature(0.0) == pytest.approx(0.01)


def test_replay_buffer_is_a_ring_of_the_newest(env: SaccadeVecEnv) -> None:
    buffer = OneStepReplayBuffer(10, env.observation_space, env.action_space, "cpu", n_envs=4, seed=0)
    for i in range(4):  # 16 rows into 10 places
        rewards = np.arange(4.0) + 4 * i
        rows = np.full((4, 8), i, np.float32)
        buffer.add(rows, rows, np.zeros((4, 3), np.float32), rewards, np.ones(4), [{}] * 4)
    assert buffer.size() == 10
    assert set(buffer.rows[:, -1].tolist()) == set(range(6, 16))
    sample = buffer.sample(500)
    assert set(sample.rewards[:, 0].tolist()) == set(range(6, 16))
    assert torch.equal(sample.observations[:, 0], (sample.rewards[:, 0] // 4))
    again = OneStepReplayBuffer(10, env.observation_space, env.action_space, "cpu", n_envs=4, seed=0)
    again.rows, again.pos, again.full = buffer.rows, buffer.pos, buffer.full
    assert torch.equal(again.sample(500).rewards, sample.rewards)


def test_learning_gets_better_and_keeps_sb3s_interface(env: SaccadeVecEnv, tmp_path: Path) -> None:
    model = make_model(env, learning_rate=3e-3)
    seen: list[int] = []
    model.learn(16 * 300, callback=lambda locals_, globals_: bool(seen.append(1)) or True)
    assert len(seen) == 300
    model.save(tmp_path / "model.zip")
    loaded = OneStepSAC.load(tmp_path / "model.zip", env=env)
    observation = env.reset()
    assert isinstance(observation, np.ndarray)
    expected, _ = model.predict(observation, deterministic=True)
    np.testing.assert_array_equal(loaded.predict(observation, deterministic=True)[0], expected)
    loaded.set_logger(Logger(folder=None, output_formats=[]))
    assert loaded.temperature is not None
    assert loaded.temperature(0.0) == pytest.approx(1e-3)
    loaded.learn(64)  # it goes on learning

    def mean_reward(which: OneStepSAC) -> float:
        trial = SaccadeVecEnv(200, "lpf", log_reward=True, seed=3)
        first = trial.reset()
        assert isinstance(first, np.ndarray)
        return float(trial.step(which.predict(first, deterministic=True)[0])[1].mean())

    assert mean_reward(model) > mean_reward(make_model(env)) + 0.3  # half a decade of the reward


def test_automatic_temperature_moves_as_sb3s_own_rule(env: SaccadeVecEnv) -> None:
    model = make_model(env, temperature=None, ent_coef="auto_0.5", learning_rate=1e-2)
    model.learn(64)
    before = float(model.log_ent_coef.detach())
    assert before != pytest.approx(np.log(0.5))
    model.ent_coef_optimizer = torch.optim.SGD([model.log_ent_coef], lr=1.0)  # a step is the gradient
    data = model.replay_buffer.sample(64)
    torch.manual_seed(5)
    _, log_probability = model.actor.action_log_prob(data.observations)
    loss = -(model.log_ent_coef * (log_probability + model.target_entropy).detach()).mean()  # of SB3's SAC
    (gradient,) = torch.autograd.grad(loss, model.log_ent_coef)
    with torch.no_grad():
        torch.manual_seed(5)
        _, temperature = model._update_policy(model.actor.features_extractor(data.observations))
    assert float(temperature) == pytest.approx(np.exp(before))  # the one before the step, as SB3 has it
    assert float(model.log_ent_coef.detach()) == pytest.approx(before - float(gradient), rel=1e-4)


def test_normalised_observations_and_rewards_reach_the_updates(env: SaccadeVecEnv) -> None:
    normalised = VecNormalize(env)
    model = make_model(normalised)
    model.learn(64)
    buffer = model.replay_buffer
    state = buffer.random.bit_generator.state
    plain = buffer.sample(64)
    buffer.random.bit_generator.state = state
    sample = buffer.sample(64, env=normalised)
    np.testing.assert_allclose(sample.observations, normalised.normalize_obs(plain.observations.numpy()), rtol=1e-6)
    np.testing.assert_allclose(sample.rewards, normalised.normalize_reward(plain.rewards.numpy()), rtol=1e-6)
    asked: list[object] = []
    buffer.sample = lambda size, env=None: asked.append(env) or sample
    model.train(1, 64)
    assert asked == [normalised]


def test_replay_buffer_is_saved_and_loaded(env: SaccadeVecEnv, tmp_path: Path) -> None:
    model = make_model(env)
    model.learn(64)
    model.save_replay_buffer(tmp_path / "buffer.pkl")
    other = make_model(env)
    other.load_replay_buffer(tmp_path / "buffer.pkl")
    np.testing.assert_array_equal(other.replay_buffer.rows, model.replay_buffer.rows)
    other.learn(64)


class Learned(GazeFeatures):
    """Features with a parameter."""

    def __init__(self, observation_space: Any) -> None:
        super().__init__(observation_space)
        self.scale = torch.nn.Parameter(torch.ones(6))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"ent_coef": 0.5}, "not both"),
        ({"use_sde": True}, "exploration"),
        ({"policy_kwargs": {"features_extractor_class": Learned}}, "without parameters"),
        ({"policy_kwargs": {"activation_fn": torch.nn.Tanh}}, "ReLU"),
    ],
)
def test_refuses_what_it_would_train_wrongly(env: SaccadeVecEnv, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        OneStepSAC("MlpPolicy", env, **{"temperature": falling_temperature(1.0, 1e-3), **settings})


def test_the_example_with_a_stock_algorithm_learns(capsys: pytest.CaptureFixture[str]) -> None:
    example = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "stock_sb3.py"))
    threads = torch.get_num_threads()
    before, after = example["main"](steps=400, judged=40)
    torch.set_num_threads(threads)
    assert after > before + 0.1
    assert f"after 400 saccades: {after:.3f}" in capsys.readouterr().out
