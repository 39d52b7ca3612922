"""What learning costs: from stock SAC to ours step by step, and what share of a whole training each part has.

    python benchmarks/learning.py [--batch 512] [--cpu-time] [--device cuda]
    python benchmarks/learning.py --profile [--plant mujoco] [--profile-updates 800]

The first prints a row for every step from stock Stable-Baselines3 SAC to OneStepSAC: same environment, networks
128-128-32, 8192 saccades in the replay buffer, learning rate, temperature and Adam's second moment as `orient-eye
train` has them (stock SAC keeps its own of the last two), blocks of updates in turn, ratios within one round. The
autograd twin makes the same updates as ours, by torch's autograd (docs/decisions/0003-networks-by-hand.md). Denormal
numbers come late in a training: Adam's moments of a unit that is silent shrink at every update and stick at the
smallest numbers there are, where a processor can be slow. So for the rows "a third silent" so many units are silenced,
and their moments shrunk as all updates of a training would; what that does to Adam's steps alone stands below the
table. Then come threads, twin critics and, on another device, the CPU; the last line is the time of the matrix products
alone that one update of ours needs. Threads of torch wait badly: measure on a machine with nothing else to do, or with
--cpu-time, and then read the rows of one thread only.

The second makes a real training in a fresh cache (`orient_eye.learning.training.train`) and says where its CPU time
goes; with the part that grows with the updates multiplied, also where that of a whole training goes.
"""

import argparse
import contextlib
import itertools
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast
from unittest import mock

import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.logger import Logger
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN
from torch import Tensor, nn

from orient_eye.environments.sb3_env import SaccadeVecEnv
from orient_eye.learning.config import TrainConfig
from orient_eye.learning.network import Network, flatten, take_step
from orient_eye.learning.replay_buffer import OneStepReplayBuffer
from orient_eye.learning.sac import GazeFeatures, OneStepSAC, falling_temperature

NETS = [128, 128, 32]
STOCK, DEFAULT = "stock SB3 SAC, 2 critics", "denormals flushed: OneStepSAC, the default"
SETTINGS = TrainConfig().resolved()
FALLING = falling_temperature(*cast(tuple[float, float], SETTINGS.temperature))
BETAS = (0.9, SETTINGS.second_moment)
SILENT = 3  # one unit in so many


class OneStepTarget(SAC):
    """Stock SAC without target network and second pass of the policy: the reward is the return."""

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Updates of the critics and the policy from the replay buffer, each as SB3 writes it."""
        self._update_learning_rate([self.actor.optimizer, self.critic.optimizer])
        assert self.replay_buffer is not None
        for _ in range(gradient_steps):
            data = self.replay_buffer.sample(batch_size)
            actions, log_density = self.actor.action_log_prob(data.observations)
            found = self.critic(data.observations, data.actions)
            loss = 0.5 * sum(nn.functional.mse_loss(value, data.rewards) for value in found)
            self.critic.optimizer.zero_grad()
            cast(Tensor, loss).backward()
            self.critic.optimizer.step()
            value = torch.cat(self.critic(data.observations, actions), dim=1).min(dim=1, keepdim=True).values
            self.actor.optimizer.zero_grad()
            (self.ent_coef_tensor * log_density.reshape(-1, 1) - value).mean().backward()
            self.actor.optimizer.step()


class AutogradTwin(SAC):
    """The updates of `OneStepSAC` with one critic, by autograd: no target network, features once a batch."""

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Updates of Q and policy from the replay buffer."""
        actor, q = self.actor, self.critic.q_networks[0]
        self._update_learning_rate([actor.optimizer, self.critic.optimizer])
        assert self.replay_buffer is not None
        weights = list(actor.parameters())
        for _ in range(gradient_steps):
            data = self.replay_buffer.sample(batch_size)
            with torch.no_grad():
                features = actor.extract_features(data.observations, actor.features_extractor)
            self.critic.optimizer.zero_grad()
            nn.functional.mse_loss(q(torch.cat([features, data.actions], dim=1)), data.rewards).backward()
            self.critic.optimizer.step()
            latent = actor.latent_pi(features)
            log_std = actor.log_std(latent).clamp(LOG_STD_MIN, LOG_STD_MAX)
            noise = torch.randn_like(log_std)
            actions = torch.tanh(actor.mu(latent) + log_std.exp() * noise)
            entropy = (log_std + 0.5 * noise**2 + torch.log(1 - actions**2 + 1e-6)).sum(dim=1).mean()
            value = q(torch.cat([features, actions], dim=1)).mean()
            actor.optimizer.zero_grad()
            (-self.ent_coef_tensor * entropy - value).backward(inputs=weights)
            actor.optimizer.step()


class Adam(torch.optim.Adam):
    """Adam that keeps its bookkeeping, as `take_step` does it away only of torch's own class."""


class ByHand(OneStepSAC):
    """The passes written out, with a head each for mean and spread, as SB3 has them; a tensor a layer."""

    flat = False

    def _create_aliases(self) -> None:
        SAC._create_aliases(self)
        mean, spread = cast(nn.Linear, self.actor.mu), cast(nn.Linear, self.actor.log_std)
        trunk = list(self.actor.latent_pi)[:-1]
        policy = nn.Sequential(*trunk, mean, spread)
        for part, module in ((self.actor, policy), (self.critic, self.critic)):
            parameters = list(module.parameters())
            for parameter in parameters:
                parameter.grad = torch.zeros_like(parameter)
            kind = torch.optim.Adam if self.flat else Adam
            parameters = [flatten(parameters)] if self.flat else parameters
            part.optimizer = kind(parameters, lr=self.lr_schedule(1), **self.policy.optimizer_kwargs)
        self._trunk, self._heads = Network(trunk), (Network([mean]), Network([spread]))
        self._one = torch.tensor(1 + 1e-6, device=self.device)
        self._q = [Network(cast(Any, q)) for q in self.critic.q_networks]

    def _update_policy(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """As `OneStepSAC` does, but for the two heads."""
        latent = self._trunk.forward(features)
        hidden = latent[-1].relu_()
        heads = [head.forward(hidden) for head in self._heads]
        mean, raw = heads[0][-1], heads[1][-1]
        log_std = raw.clamp(LOG_STD_MIN, LOG_STD_MAX)
        noise = torch.randn_like(log_std)
        spread = log_std.exp().mul_(noise)
        actions = (mean + spread).tanh_()
        n, size = actions.shape
        slope = torch.addcmul(self._one, actions, actions, value=-1)
        entropy = torch.addcmul(log_std, noise, noise, value=0.5).add_(slope.log()).sum() / n
        temperature = self.ent_coef_tensor
        values = self._q[0].forward(torch.cat([features, actions], dim=1))
        back = torch.full_like(values[-1], -1 / n)
        by_action = self._q[0].backward(values, back, of_parameters=False, of_input=True)[:, -size:]
        pull = temperature / n
        by_u = torch.ops.aten.tanh_backward((actions / slope).mul_(2 * pull).add_(by_action), actions)
        by_log_std = (by_u * spread).sub_(pull).mul_(raw == log_std)
        by_hidden = sum(
            head.backward(passed, by, of_parameters=True, of_input=True)
            for head, passed, by in zip(self._heads, heads, (by_u, by_log_std), strict=True)
        )
        by_hidden = torch.ops.aten.threshold_backward(cast(Tensor, by_hidden), hidden, 0)
        self._trunk.backward(latent, by_hidden, of_parameters=True, of_input=False)
        take_step(self.actor.optimizer)
        return -(temperature * entropy + values[-1].sum() / n), temperature


class ByHandInOneVector(ByHand):
    """The same with one vector of parameters an optimizer."""

    flat = True


@contextlib.contextmanager
def denormals_kept() -> Iterator[None]:
    """Training that leaves denormal numbers as they are."""
    with mock.patch.object(torch, "set_flush_denormal"):
        yield


class Contestant:
    """An algorithm that makes updates, at a number of torch's threads."""

    def __init__(self, model: SAC, threads: int = 1, *, denormals: bool = False) -> None:
        self.model, self.threads, self.denormals = model, threads, denormals

    def update(self, updates: int, batch: int) -> None:
        """Make updates."""
        torch.set_num_threads(self.threads)
        with denormals_kept() if self.denormals else contextlib.nullcontext():
            self.model.train(updates, batch)
        if self.model.device.type != "cpu":
            torch.cuda.synchronize()


def the_way(env: SaccadeVecEnv, batch: int, device: str) -> dict[str, Contestant]:
    """From stock to ours, one torch thread: each row is the one before with one thing more."""
    same = common(batch, device)
    nets = {"net_arch": NETS, "optimizer_kwargs": {"betas": BETAS}}
    plain: dict[str, Any] = {"ent_coef": FALLING(1.0), "policy_kwargs": nets}
    one_critic = {**plain, "policy_kwargs": {**nets, "n_critics": 1}}
    stock_buffer = unfused()
    del stock_buffer["replay_buffer_class"]
    rows: dict[str, SAC] = {
        STOCK: SAC("MlpPolicy", env, policy_kwargs={"net_arch": NETS}, **same),
        "no next state: no target, one pass": OneStepTarget("MlpPolicy", env, **plain, **same),
        "one critic": OneStepTarget("MlpPolicy", env, **one_critic, **same),
        "gaze features once a batch, density by formula": AutogradTwin(
            "MlpPolicy", env, ent_coef=FALLING(1.0), **stock_buffer, **same
        ),
        "a buffer of rows": AutogradTwin("MlpPolicy", env, ent_coef=FALLING(1.0), **unfused(), **same),
        "fused Adam: the autograd twin": AutogradTwin("MlpPolicy", env, ent_coef=FALLING(1.0), **alike(1), **same),
        "passes by hand": ByHand("MlpPolicy", env, temperature=FALLING, **alike(1), **same),
        "one vector": ByHandInOneVector("MlpPolicy", env, temperature=FALLING, **alike(1), **same),
    }
    found = {name: Contestant(model) for name, model in rows.items()}
    found["one head"] = Contestant(ours(env, 1, batch, device), denormals=True)
    found[DEFAULT] = Contestant(ours(env, 1, batch, device))
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Speed of the learning.")
    parser.add_argument("--batch", type=int, default=SETTINGS.batch_size)
    parser.add_argument("--updates", type=int, default=200, help="a block")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, help="of torch, beside one; 1 leaves these rows out; default: all cores")
    parser.add_argument("--cpu-time", action="store_true", help="count the CPU's time, not the clock's")
    parser.add_argument("--profile", action="store_true", help="the shares of a whole training instead")
    parser.add_argument("--plant", default="lpf", help="of --profile")
    parser.add_argument("--profile-updates", type=int, default=800, help="of --profile")
    options = parser.parse_args()
    if options.profile:
        profile(options.plant, options.profile_updates)
        return
    batch, device = options.batch, options.device
    env = SaccadeVecEnv(128, "lpf", log_reward=True, seed=0, infos=False)
    way = the_way(env, batch, device)
    aged = {f"{name}, a third silent": Contestant(ours(env, 1, batch, device), denormals=kept) for name, kept in AGED}
    beside = {"OneStepSAC, 2 critics": Contestant(ours(env, 2, batch, device))}
    threads = options.threads or torch.get_num_threads()
    if threads > 1:
        beside[f"{STOCK}, {threads} torch threads"] = Contestant(way[STOCK].model, threads)
        beside[f"OneStepSAC, {threads} torch threads"] = Contestant(way[DEFAULT].model, threads)
    if device != "cpu":
        beside["the default, but on the CPU"] = Contestant(ours(env, 1, batch, "cpu"))
    every = {**way, **aged, **beside}
    for model in {id(each.model): each.model for each in every.values()}.values():
        model.set_logger(Logger(folder=None, output_formats=[]))
        fill(model, env)
    for each in aged.values():
        fade(each.model, batch)
    clock = time.process_time if options.cpu_time else time.perf_counter
    times = measured(every, clock, options.updates, options.rounds, batch)
    clocked = "CPU time" if options.cpu_time else "wall time"
    print(f"batch {batch}, blocks of {options.updates} updates, {options.rounds} rounds, {device}, {clocked}; medians")
    print(f"{'':50} {'ms an update':>12} {'times stock':>12} {'and the row before':>19}")
    before = None
    for name, s in times.items():
        gain = f"{np.median(times[before] / s):19.2f}" if before is not None and name in way else ""
        print(f"{name:50} {1e3 * np.median(s):12.2f} {np.median(times[STOCK] / s):12.2f} {gain}")
        before = name
    torch.set_num_threads(1)
    kept = aged[f"{AGED[0][0]}, a third silent"].model
    print(f"Adam's steps alone, {100 * denormal(kept):.0f} % of its means denormal: ", end="")
    told = {"kept": adam_alone(kept, clock, flush=False), "flushed": adam_alone(kept, clock, flush=True)}
    print(", ".join(f"{words} {1e3 * s:.3f} ms" for words, s in told.items()))
    products, own = matrix_products(batch, device, clock), float(np.median(times[DEFAULT]))
    print(f"the matrix products of one such update alone: {1e3 * products:.2f} ms, {100 * products / own:.0f} % of it")


AGED = (("OneStepSAC, denormals kept", True), ("OneStepSAC, denormals flushed", False))


def measured(
    every: dict[str, Contestant], clock: Callable[[], float], updates: int, rounds: int, batch: int
) -> dict[str, Any]:
    """Seconds of an update of each, (rounds,), in turn; a first round warms up."""
    seconds: dict[str, list[float]] = {name: [] for name in every}
    for _ in range(rounds + 1):
        for name, each in every.items():
            began = clock()
            each.update(updates, batch)
            seconds[name].append((clock() - began) / updates)
    return {name: np.array(s[1:]) for name, s in seconds.items()}


def fade(model: SAC, batch: int) -> None:
    """Make some of the hidden units silent for good, and their moments what many updates make of them."""
    with torch.no_grad():
        for network in (model.actor.latent_pi, *model.critic.q_networks):
            for layer in list(cast(nn.Sequential, network))[: 2 * len(NETS)]:
                if isinstance(layer, nn.Linear):
                    layer.bias[::SILENT] = -1e3  # nothing that comes in reaches over it
        torch.set_flush_denormal(False)
        model.train(20, batch)
        for part in (model.actor, model.critic):
            for parameter, state in part.optimizer.state.items():
                still = parameter.grad == 0
                for name, decay in zip(("exp_avg", "exp_avg_sq"), part.optimizer.param_groups[0]["betas"], strict=True):
                    moment = torch.where(state[name][still] == 0, 1e-8, state[name][still])
                    for _ in range(SETTINGS.updates):
                        moment.mul_(decay)
                    state[name][still] = moment


def adam_alone(model: SAC, clock: Callable[[], float], *, flush: bool, rounds: int = 500) -> float:
    """Seconds of the two optimizers' steps of an update."""
    torch.set_flush_denormal(flush)
    began = clock()
    for _ in range(rounds):
        take_step(model.actor.optimizer)
        take_step(model.critic.optimizer)
    torch.set_flush_denormal(False)
    return (clock() - began) / rounds


def denormal(model: SAC) -> float:
    """Share of denormal numbers among Adam's means of gradients."""
    moments = [s["exp_avg"] for part in (model.actor, model.critic) for s in part.optimizer.state.values()]
    values = torch.cat([moment.flatten() for moment in moments]).cpu().numpy()
    return float(((values != 0) & (np.abs(values) < np.finfo(np.float32).tiny)).mean())


def common(batch: int, device: str) -> dict[str, Any]:
    """What all contestants have alike."""
    return {
        "buffer_size": SETTINGS.replay_size,
        "batch_size": batch,
        "seed": 0,
        "device": device,
        "learning_rate": SETTINGS.learning_rate,
    }


def ours(env: SaccadeVecEnv, critics: int, batch: int, device: str) -> OneStepSAC:
    """Ours, as `orient-eye train` makes it."""
    return OneStepSAC("MlpPolicy", env, temperature=FALLING, **alike(critics), **common(batch, device))


def alike(critics: int) -> dict[str, Any]:
    """What ours and its autograd twin have alike."""
    policy = {"net_arch": NETS, "features_extractor_class": GazeFeatures, "n_critics": critics}
    return {
        "replay_buffer_class": OneStepReplayBuffer,
        "policy_kwargs": {**policy, "optimizer_kwargs": {"fused": True, "betas": BETAS}},
    }


def unfused() -> dict[str, Any]:
    """What ours and its twin have alike, but for the optimizer."""
    settings = alike(1)
    settings["policy_kwargs"]["optimizer_kwargs"] = {"betas": BETAS}
    return settings


def fill(model: SAC, env: SaccadeVecEnv) -> None:
    """Put random saccades into the replay buffer."""
    random = np.random.default_rng(0)
    assert model.replay_buffer is not None
    observation = env.reset()
    for _ in range(64):
        action = random.uniform(-1, 1, (env.num_envs, env.action_space.shape[0])).astype(np.float32)
        following, reward, done, infos = env.step(action)
        model.replay_buffer.add(observation, following, action, reward, done, infos)
        observation = following


def matrix_products(batch: int, device: str, clock: Callable[[], float], rounds: int = 300) -> float:
    """Seconds of the products of one update: Q forward and backward, policy forward and backward through Q."""
    q, policy = [9, *NETS, 1], [6, *NETS, 6]
    x = {size: torch.randn(batch, size, device=device) for size in {*q, *policy}}
    pairs = [*itertools.pairwise(q), *itertools.pairwise(policy)]
    w = {pair: torch.randn(*pair, device=device) for pair in pairs}

    def forward(sizes: list[int]) -> None:
        for a, b in itertools.pairwise(sizes):
            x[a] @ w[a, b]

    def backward(sizes: list[int], *, of_weights: bool, of_input: bool) -> None:
        for layer, (a, b) in enumerate(itertools.pairwise(sizes)):
            if of_weights:
                x[a].T @ x[b]
            if of_input or layer:
                x[b] @ w[a, b].T

    began = 0.0
    for i in range(rounds + 20):
        if i == 20:
            began = clock()
        forward(q)
        backward(q, of_weights=True, of_input=False)
        forward(policy)
        forward(q)
        backward(q, of_weights=False, of_input=True)
        backward(policy, of_weights=True, of_input=False)
    if device != "cpu":
        torch.cuda.synchronize()
    return (clock() - began) / rounds


# --- a whole training -----------------------------------------------------------------------------

IMPORT = "import time; import orient_eye.learning.training; print(time.process_time())"
GROWS = "for every update"
ONCE = "once"


class Stopwatch:
    """CPU time of functions by name: that of others inside them is theirs."""

    def __init__(self) -> None:
        self.seconds: dict[tuple[str, str], float] = {}
        self.calls: dict[tuple[str, str], int] = {}
        self.running: list[tuple[str, str]] = []
        self.last = time.process_time()

    def switch(self) -> None:
        """Give the time since the last switch to what was running."""
        now = time.process_time()
        if self.running:
            key = self.running[-1]
            self.seconds[key] = self.seconds.get(key, 0.0) + now - self.last
        self.last = now

    @contextlib.contextmanager
    def of(self, part: str, when: str) -> Iterator[None]:
        """The part that runs inside."""
        self.switch()
        self.running.append((part, when))
        self.calls[part, when] = self.calls.get((part, when), 0) + 1
        try:
            yield
        finally:
            self.switch()
            self.running.pop()

    def wrap(self, owner: Any, name: str, part: str | Callable[[], str], when: str) -> Any:
        """A patch of a function or method that counts its time as a part's; `part` may depend on the instant."""
        function = getattr(owner, name)

        def timed(*args: Any, **keywords: Any) -> Any:
            told = part() if callable(part) else part
            with self.of(told, ONCE if told == "warm-up" else when):
                return function(*args, **keywords)

        return mock.patch.object(owner, name, timed)


def profile(plant: str, updates: int) -> None:
    """Train with a stopwatch at every part and print the shares."""
    imports = float(
        subprocess.run([sys.executable, "-c", IMPORT], check=True, capture_output=True, text=True).stdout.split()[-1]
    )
    with tempfile.TemporaryDirectory() as folder, mock.patch.dict(os.environ, {"XDG_CACHE_HOME": folder}):
        watch, whole = train_watched(plant, updates, Path(folder) / "run")
    watch.seconds["imports", ONCE] = imports
    report(watch, plant, updates, whole)


def train_watched(plant: str, updates: int, out: Path) -> tuple[Stopwatch, int]:
    """A training with a stopwatch, and how many updates it has where nobody says."""
    from orient_eye.learning import figures, stages, training
    from orient_eye.learning.loop import TrainingLoop
    from orient_eye.learning.policy import Policy

    watch, learning = Stopwatch(), [False]
    whole = SETTINGS.updates
    update = OneStepSAC.train

    def and_say(*args: Any, **keywords: Any) -> None:
        learning[0] = True
        with watch.of("the rest of an update: features, Python", GROWS):
            update(*args, **keywords)

    def once_it_learns(part: str) -> Callable[[], str]:
        return lambda: part if learning[0] else "warm-up"

    run = training._Run
    parts: list[tuple[Any, str, str | Callable[[], str], str]] = [
        (TrainConfig, "make_task", "plant, weights", ONCE),
        (run, "_env", "networks and buffer", ONCE),
        (run, "_model", "networks and buffer", ONCE),
        (run, "_yardsticks", "search of the optimum", ONCE),
        (SaccadeVecEnv, "step_wait", once_it_learns("performing saccades"), GROWS),
        (OneStepSAC, "_sample_action", once_it_learns("actions for them"), GROWS),
        (OneStepReplayBuffer, "add", once_it_learns("actions for them"), GROWS),
        (OneStepReplayBuffer, "sample", "sampling", GROWS),
        (OneStepSAC, "_update_q", "critic's update", GROWS),
        (OneStepSAC, "_update_policy", "policy's update", GROWS),
        (TrainingLoop, "_evaluate", "evaluations", ONCE),
        (TrainingLoop, "_record_stage", "stages kept for the recording", ONCE),
        (TrainingLoop, "_write_metrics", "metrics", ONCE),
        (TrainingLoop, "_save", "checkpoints", GROWS),
        (run, "_conclude", "last evaluation, table", ONCE),
        (Policy, "save", "last evaluation, table", ONCE),
        (figures, "draw_learning", "pictures", ONCE),
        (figures, "draw_policy", "pictures", ONCE),
        (stages, "record_stages", "recording", ONCE),
    ]
    with contextlib.ExitStack() as patches:
        for part in parts:
            patches.enter_context(watch.wrap(*part))
        patches.enter_context(mock.patch.object(OneStepSAC, "train", and_say))
        with watch.of("Stable-Baselines3's loop, progress", GROWS):
            training.train(TrainConfig(plant=plant, updates=updates), out, quiet=True)
    return watch, whole


def report(watch: Stopwatch, plant: str, updates: int, whole: int) -> None:
    """Print seconds and shares, of this run and of one with as many updates as the default has."""
    longer = {key: s * (whole / updates if key[1] == GROWS else 1) for key, s in watch.seconds.items()}
    totals = sum(watch.seconds.values()), sum(longer.values())
    print(f"a training on {plant} of {updates} updates, CPU time, and what follows for {whole}")
    print(f"{'':42} {'calls':>7} {'s':>8} {'share':>7} {f's of {whole}':>10} {'share':>7}")
    for key in sorted(longer, key=lambda each: -longer[each]):
        s, more = watch.seconds[key], longer[key]
        print(
            f"{key[0]:42} {watch.calls.get(key, 1):7} {s:8.2f} {100 * s / totals[0]:6.1f}% {more:10.2f} "
            f"{100 * more / totals[1]:6.1f}%  {key[1]}"
        )
    print(f"{'all':42} {'':7} {totals[0]:8.2f} {'':7} {totals[1]:10.2f}")


if __name__ == "__main__":
    main()
