"""The MuJoCo eye held against three witnesses: the thesis author's own runs, the compiled reference, and a
converged solution of the equations of motion.

    report = validate(random_runs=20, seed=0)
    report.passed, report.rows
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from orient_eye.checks import whole
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.plants import Plant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.resources import data_folder
from orient_eye.rotations import FORWARD, angle_between, rotation
from orient_eye.state import State

Array = NDArray[np.float64]
AUTHOR_LIMIT_DEG = 0.02
HORIZONTAL_LIMIT_DEG = 0.001
REFERENCE_LIMIT_DEG = 1e-4
ACCURATE_LIMIT_DEG = 0.05
MOST_RUNS = 10_000
"""Random ones, which are simulated at once: 0.5 GB."""


@dataclass(frozen=True)
class Check:
    """One comparison: the largest angle between two orientations over a run.

    Attributes:
        run: what was run.
        against: the witness.
        error_deg: largest angle [deg].
        limit_deg: what is allowed.
    """

    run: str
    against: str
    error_deg: float
    limit_deg: float

    @property
    def passed(self) -> bool:
        """Within the limit; NaN is not."""
        return bool(self.error_deg <= self.limit_deg)


def validate(*, random_runs: int = 20, seed: int = 0) -> list[Check]:
    """All comparisons.

    Args:
        random_runs: random pulse-steps of all three motors, beside the author's runs.
        seed: of those.

    Raises:
        InputError: a number of runs or a seed that is none.
    """
    whole("the number of random runs", random_runs, 0, MOST_RUNS, advice="20 are usual")
    whole("the seed", seed, 0)
    return [*against_author(), *against_reference(random_runs, np.random.default_rng(seed)), *against_truth()]


def author_runs() -> tuple[list[str], Array, Array]:
    """Names, motor commands [deg] (12, 601, 3) and orientations (12, 601, 4) of the author's runs."""
    with np.load(data_folder("models") / "author_simulator" / "trajectories.npz", allow_pickle=False) as file:
        names, motor, eye = file["names"], file["motor_deg"], file["eye_wxyz"].astype(float)
    motor = np.concatenate([motor, motor[:, -1:]], axis=1)  # a row for the last state
    eye /= np.linalg.norm(eye, axis=-1, keepdims=True)
    return [str(n) for n in names], motor, eye


def against_author() -> list[Check]:
    """MuJoCo, and the reference as the author published it, against the author's runs."""
    names, motor, eye = author_runs()
    horizontal = np.abs(motor[..., [0, 2]]).max(axis=(1, 2)) == 0
    limit = np.where(horizontal, HORIZONTAL_LIMIT_DEG, AUTHOR_LIMIT_DEG)
    checks = []
    for against, plant in (("author: MuJoCo", MujocoPlant()), ("author: reference", TavaresPlant(as_published=True))):
        error = _largest_angle(_run(plant, motor), eye)
        if against == "author: reference":
            limit = np.full(len(names), HORIZONTAL_LIMIT_DEG)
        checks += [Check(n, against, float(e), float(b)) for n, e, b in zip(names, error, limit, strict=True)]
    return checks


def against_reference(count: int, random: np.random.Generator) -> list[Check]:
    """MuJoCo against the reference with viscous friction: the author's commands, and random ones of his kind."""
    names, motor, _ = author_runs()
    if count:
        D = random.uniform(-18, 18, (count, 3))
        B, k0 = random.uniform(30, 70, (count, 3)), random.uniform(12, 21, (count, 3))
        motor = np.concatenate([motor, PulseStep(np.zeros((count, 3)), B, D, k0).sample(0.001, motor.shape[1])])
        names = names + [f"random pulse-steps {i + 1} of all motors" for i in range(count)]
    error = _largest_angle(_run(MujocoPlant(), motor), _run(TavaresPlant(), motor))
    return [Check(n, "reference: MuJoCo", float(e), REFERENCE_LIMIT_DEG) for n, e in zip(names, error, strict=True)]


def against_truth() -> list[Check]:
    """Both settings of MuJoCo against the equations of motion solved by DOP853 at tight tolerance.

    The thesis' step of 1 ms is what it is: its row says how far off, and has no limit.
    """
    step = np.zeros((1, 601, 3))
    step[..., 1] = 20.0
    pulse = PulseStep(F=np.zeros((1, 1)), B=np.full((1, 1), 53.14), D=np.full((1, 1), 14.14), k0=np.full((1, 1), 14.75))
    pulsed = np.zeros((1, 601, 3))
    pulsed[..., 1:2] = pulse.sample(0.001, 601)
    cases: list[tuple[str, Array, Callable[[float], float]]] = [
        ("step m2 20 deg", step, lambda t: 20.0),
        ("pulse-step m2 D=14.14 B=53.14 k0=14.75", pulsed, lambda t: float(pulse.position([t])[0, 0, 0])),
    ]
    checks = []
    for name, command, motor2 in cases:
        truth = _solve(TavaresPlant(), motor2, np.linspace(0, 0.6, 601))
        for accurate in (False, True):
            found = _run(MujocoPlant(accurate=accurate), command)[0]
            error, limit = float(angle_between(found, truth).max()), ACCURATE_LIMIT_DEG if accurate else np.inf
            checks.append(Check(name, f"DOP853: MuJoCo {'accurate' if accurate else '1 ms'}", error, limit))
    return checks


def _solve(plant: TavaresPlant, motor2: Callable[[float], float], times: Array) -> Array:
    """Orientations (time, 4) of the full rigid body under a continuous command of motor 2 [deg]."""
    e = plant.elastics

    def derivative(t: float, state: Array) -> Array:
        q, omega = state[:4], state[4:]
        turn = rotation(q).as_matrix()
        torque = plant.elastic_torque(turn[None], np.array([[0.0, motor2(t), 0.0]]))[0][0] - e.friction * omega
        inertia = turn @ e.inertia @ turn.T
        rate = 0.5 * np.concatenate([[-omega @ q[1:]], q[0] * omega + np.cross(omega, q[1:])])
        return np.concatenate([rate, np.linalg.solve(inertia, torque - np.cross(omega, inertia @ omega))])

    start = np.concatenate([FORWARD, np.zeros(3)])
    solution = solve_ivp(derivative, times[[0, -1]], start, "DOP853", times, rtol=1e-10, atol=1e-12)
    q: Array = solution.y[:4].T
    unit: Array = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return unit


def _run(plant: Plant, motor: Array) -> Array:
    """Orientations (saccades, time, 4) under motor commands (saccades, time, motors), from straight ahead."""
    start = State(np.tile(FORWARD, (len(motor), 1)), motor[:, 0])
    return plant.move(motor, start).trajectory().orientation


def _largest_angle(a: Array, b: Array) -> Array:
    return np.asarray(angle_between(a, b).max(axis=1))


def passed(checks: list[Check]) -> bool:
    """All within their limits."""
    return all(check.passed for check in checks)
