"""The MuJoCo eyes held against three witnesses: the thesis author's own runs, the compiled reference, and a
converged solution of the equations of motion.

    report = validate(random_runs=20, seed=0)
    report.passed, report.rows
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from orient_eye.checks import whole
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.eyes.model import build_model, motors
from orient_eye.motor import names, rests
from orient_eye.plants import Plant
from orient_eye.plants.mujoco import MujocoPlant
from orient_eye.plants.tavares import TavaresPlant
from orient_eye.resources import data_folder
from orient_eye.rotations import FORWARD, angle_between, from_euler, rotation
from orient_eye.state import State

Array = NDArray[np.float64]
AUTHOR_LIMIT_DEG = 0.02
HORIZONTAL_LIMIT_DEG = 0.001
REFERENCE_LIMIT_DEG = {"thesis": 1e-4, "six": 1e-5}
"""By eye: the servos of arms yield a little, spindles do not."""
ACCURATE_LIMIT_DEG = 0.05
MOST_RUNS = 10_000
"""Random ones of an eye, which are simulated at once: 0.5 GB."""
_PRETENSIONS = (1, 2)


@dataclass(frozen=True)
class Check:
    """One comparison: the largest angle between two orientations over a run.

    Attributes:
        run: what was run.
        against: the witness.
        error_deg: largest angle [deg].
        limit_deg: what is allowed.
        eye: that moved, one of `orient_eye.eyes.EYES`.
    """

    run: str
    against: str
    error_deg: float
    limit_deg: float
    eye: str = "thesis"

    @property
    def passed(self) -> bool:
        """Within the limit; NaN is not."""
        return bool(self.error_deg <= self.limit_deg)


def validate(*, random_runs: int = 20, seed: int = 0) -> list[Check]:
    """All comparisons.

    Args:
        random_runs: random pulse-steps of all motors of each eye, beside the author's runs.
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
    """MuJoCo against the reference with viscous friction: the author's commands, and random ones of each eye."""
    author_names, motor, _ = author_runs()
    samples = motor.shape[1]
    which = np.arange(count) % len(_PRETENSIONS)
    random_names = [f"random pulse-steps {i + 1} of all motors" for i in range(count)]
    runs = {
        "thesis": (author_names + random_names, [motor, _pulse_steps(np.zeros((count, 3)), 18, random, samples)]),
        "six": (
            [f"pretension {_PRETENSIONS[i]}: {each}" for each, i in zip(random_names, which, strict=True)],
            [_pulse_steps(_rest_of_six()[which], 30, random, samples)],
        ),
    }
    checks = []
    for eye, (told, commands) in runs.items():
        both = np.concatenate(commands)
        error = _largest_angle(_run(MujocoPlant(eye=eye), both), _run(TavaresPlant(eye=eye), both))
        limit = REFERENCE_LIMIT_DEG[eye]
        checks += [Check(n, "reference: MuJoCo", float(e), limit, eye) for n, e in zip(told, error, strict=True)]
    return checks


def _pulse_steps(F: Array, reach_deg: float, random: np.random.Generator, samples: int) -> Array:
    """Motor positions [deg] (saccades, samples, motors) of random pulse-steps by up to that much from F."""
    D = F + random.uniform(-reach_deg, reach_deg, F.shape)
    B, k0 = random.uniform(30, 70, F.shape), random.uniform(12, 21, F.shape)
    return PulseStep(F, B, D, k0).sample(0.001, samples)


def _rest_of_six() -> Array:
    """Where its motors rest [deg], (pretensions, motors)."""
    model = build_model("six", visual=False)
    return np.array([rests(motors(model, pretension)) for pretension in _PRETENSIONS])


def against_truth() -> list[Check]:
    """Both settings of MuJoCo against the equations of motion solved by DOP853 at tight tolerance.

    The step of 1 ms, of the thesis and of the programs of the six-motor eye, is what it is: its row says how far off,
    and has no limit.
    """
    pulse = PulseStep(
        F=np.zeros((1, 3)), B=np.full((1, 3), 53.14), D=np.array([[0.0, 14.14, 0.0]]), k0=np.full((1, 3), 14.75)
    )
    six = TavaresPlant("six")
    there = six.hold(from_euler([15.0], [-10.0], [0.0]), names(six.motors))
    pulses = PulseStep(F=_rest_of_six()[:1], B=np.full((1, 6), 40.0), D=there, k0=np.full((1, 6), 12.0))
    cases: list[tuple[str, str, Array | PulseStep]] = [
        ("thesis", "step m2 20 deg", np.array([0.0, 20.0, 0.0])),
        ("thesis", "pulse-step m2 D=14.14 B=53.14 k0=14.75", pulse),
        ("six", "step to 15 deg left, 10 deg up", there[0]),
        ("six", "pulse-step to 15 deg left, 10 deg up", pulses),
    ]
    checks, times = [], np.linspace(0, 0.6, 601)
    for eye, run, told in cases:
        truth, command = _solve(TavaresPlant(eye), told, times), _at(told, times)[None]
        for accurate in (False, True):
            found = _run(MujocoPlant(eye=eye, accurate=accurate), command)[0]
            error, limit = float(angle_between(found, truth).max()), ACCURATE_LIMIT_DEG if accurate else np.inf
            checks.append(Check(run, f"DOP853: MuJoCo {'accurate' if accurate else '1 ms'}", error, limit, eye))
    return checks


def _at(told: Array | PulseStep, times: Array) -> Array:
    """Motor positions [deg] (times, motors) of a pulse-step, or of a step to (motors,)."""
    return told.position(times)[0] if isinstance(told, PulseStep) else np.tile(told, (len(times), 1))


def _solve(plant: TavaresPlant, told: Array | PulseStep, times: Array) -> Array:
    """Orientations (time, 4) of the full rigid body from straight ahead, the motors exactly as they are told."""
    e = plant.elastics

    def derivative(t: float, state: Array) -> Array:
        q, omega = state[:4], state[4:]
        turn = rotation(q).as_matrix()
        torque = plant.elastic_torque(turn[None], _at(told, np.array([t])))[0][0] - e.friction * omega
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
