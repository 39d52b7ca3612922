"""Identification of an eye with all its motors: three low-pass plants in parallel, and how good they are.

    found = identify_modes(make_plant("tavares"), np.random.default_rng(0))
    found.surrogate                                  # K, w0 about roll, pitch and yaw
    found.rows                                       # its error on pulse-steps that were not fitted, by eccentricity

Gains come from the orientations in which the eye rests, poles from how it moves: first steps, of each motor alone and
of all together, then pulse-steps of all motors between random orientations, with k0 near the poles that the steps
showed. Others like these judge.

More motors than axes hold an eye in many ways. They then stand where `Plant.hold` has them, and off that in the ways
that turn nothing, so that the gain of each is seen; and the workspace is that part of the usual in which they hold it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from orient_eye.cached import cached_property
from orient_eye.checks import real, whole
from orient_eye.commands import Command, Sampled
from orient_eye.commands.pulse_step import PulseStep
from orient_eye.constants import YAW_LIMIT_DEG
from orient_eye.errors import InputError
from orient_eye.modal_surrogate import MODES, ModalSurrogate, Mode, as_orientation, as_vector
from orient_eye.motor import ranges, rests
from orient_eye.movement.trajectory import Trajectory
from orient_eye.plants import Plant
from orient_eye.plants.linear_response import sampled_response
from orient_eye.plants.modal import ModalPlant, poles_of
from orient_eye.rotations import FORWARD, angle_between, angle_between_directions, gaze
from orient_eye.state import State
from orient_eye.task.actions import B_RANGE
from orient_eye.words import plant_in_words

Array = NDArray[np.float64]
ORDERS = ("first_order", "second_order")
WORTH = 0.05
"""Share by which the second order has to lower the error on what was not fitted, to be worth its second pole."""
WORKSPACE_DEG, TORSION_DEG = YAW_LIMIT_DEG, 3.0
"""Starts and ends look up to here from straight ahead, with a torsion up to here, by the gains there."""
DURATION_S = 0.7
"""Of each response."""
MOST = 10_000
"""Pulse-steps that are simulated at once: 0.5 GB."""
RINGS_DEG = (0.0, 10.0, 20.0, 30.0, 40.0, np.inf)
"""Ends of the rings of eccentricity."""
SHARED_DEG = 10.0
"""By how much motors that are more than the axes go off least change; that part is taken that turns nothing."""
_NEAR = 0.7  # of the way to where the eye is not held: pulses overshoot
_DIRECTIONS = 24
_LEAST_KEPT = 0.5  # of the pulse-steps
_STEP_DEG = 1.0  # of a motor, to see which way it turns the eye
_TURNS = 1e-3  # of the largest gain about an axis: less is another axis' business
_LEAST_GAIN = 1e-3  # deg of eye per deg of motor: less turns no eye
_RESTS = 50  # each with all signs of its three components
_SIGNS = np.array(list(product((1, -1), repeat=3)))
_SHARES = (-1.0, -0.6, -0.3, 0.3, 0.6, 1.0)  # of the workspace, to which a motor alone steps
_COMBINED = 20  # steps of all motors together
_K0_SPREAD = 0.4  # of the logarithm of k0 about that of the pole
_FIRST_GUESS = 10.0  # 1/s
_RATES, _ZETAS = (0.1, 1000.0), (0.02, 5.0)


@dataclass(frozen=True)
class ModesIdentification:
    """What was found.

    Attributes:
        surrogate: the linear eye to learn on.
        order: its order, one of `ORDERS`.
        orders: the same of first and of second order, by `ORDERS`.
        held_out: pulse-steps that were not fitted, as the plant made them.
        predicted: what each order makes of the same motors, orientations (saccades, time, 4).
        workspace_deg: starts and ends look up to here from straight ahead.
        ran_away: pulse-steps, fitted or held out, that went to where the motors do not hold the eye: left out.
    """

    surrogate: ModalSurrogate
    order: str
    orders: Mapping[str, ModalSurrogate]
    held_out: Trajectory
    predicted: Mapping[str, Array]
    workspace_deg: float = WORKSPACE_DEG
    ran_away: int = 0

    @cached_property
    def error_deg(self) -> Mapping[str, Array]:
        """Angle between plant and prediction [deg] (saccades, time), by order."""
        return {order: angle_between(told, self.held_out.orientation) for order, told in self.predicted.items()}

    @cached_property
    def eccentricity_deg(self) -> Array:
        """Angle between the plant's gaze and straight ahead [deg], (saccades, time)."""
        return angle_between_directions(gaze(self.held_out.orientation), gaze(FORWARD))

    @property
    def rms_deg(self) -> dict[str, float]:
        """Over all held-out samples [deg], by order."""
        return {order: _rms(error) for order, error in self.error_deg.items()}

    @property
    def rows(self) -> list[dict[str, Any]]:
        """Error of each order, overall and in each ring of eccentricity that was seen; plain values."""
        found = []
        for order, error in self.error_deg.items():
            for low, high in ((0.0, np.inf), *pairwise(RINGS_DEG)):
                there = error[(low <= self.eccentricity_deg) & (self.eccentricity_deg < high)]
                if there.size:
                    ends = {"from_deg": low, "to_deg": None if np.isinf(high) else high}
                    numbers = {"rms_deg": _rms(there), "largest_deg": float(there.max())}
                    found.append({"order": order, **ends, "samples": int(there.size), **numbers})
        return found

    @property
    def residuals(self) -> list[dict[str, Any]]:
        """One row of plain values for each held-out saccade: where it went, and how far off the surrogate was."""
        error, q = self.error_deg[self.order], self.held_out.orientation
        amplitude = angle_between(q[:, 0], q[:, -1])
        return [
            {
                "saccade": i,
                "amplitude_deg": float(amplitude[i]),
                "start_eccentricity_deg": float(self.eccentricity_deg[i, 0]),
                "end_eccentricity_deg": float(self.eccentricity_deg[i, -1]),
                "rms_deg": _rms(error[i]),
                "largest_deg": float(error[i].max()),
                "end_deg": float(error[i, -1]),
            }
            for i in range(len(error))
        ]


def identify_modes(
    plant: Plant,
    random: np.random.Generator,
    *,
    fitted: int = 200,
    held_out: int = 400,
    order: str = "best",
    worth: float = WORTH,
) -> ModesIdentification:
    """Identify a plant with all its motors.

    Args:
        plant: any of three motors or more that turn the eye about three axes.
        random: of what its motors are told.
        fitted: pulse-steps from which the poles are found.
        held_out: pulse-steps to judge by.
        order: of the surrogate, one of `ORDERS`; best for the first, unless the second is worth its numbers.
        worth: share by which it has to lower the held-out rms for that.

    Raises:
        InputError: motors that do not, an order or numbers that are none, or movements that diverged.
    """
    if order not in ("best", *ORDERS):
        raise InputError(f"an order is best, {', '.join(ORDERS)}, got {order!r}")
    for name, count in (("fitted", fitted), ("held out", held_out)):
        whole(f"the number of pulse-steps {name}", count, 1, MOST, advice="200 and 400 are usual")
    real("what a second order is worth", worth, 0, 1, advice="it is a share of the first order's error")
    eye = _Eye.of(plant)
    K = _gains(eye, random)
    rates = [mode.w0 for mode in _fit(_steps(eye, random), K, "first_order", eye.rest).values()]
    near = np.array(rates, dtype=float)[np.abs(K).argmax(axis=0)]
    seen = _pulse_steps(eye, near, fitted, random)
    judges = _pulse_steps(eye, near, held_out, random)
    ran_away = fitted + held_out - len(seen) - len(judges)
    identity, mechanical = plant.identity(), ranges(plant.motors)
    known: dict[str, Any] = {
        "motors": tuple(motor.name for motor in plant.motors),
        "ranges": mechanical.tolist() if np.isfinite(mechanical).all() else None,
        "eye": identity.get("eye"),
        "rest": tuple(eye.rest.tolist()),
    }
    orders = {name: ModalSurrogate(modes=_fit(seen, K, name, eye.rest), **known) for name in ORDERS}
    start = State(judges.orientation[:, 0], judges.motor[:, 0], judges.angular_velocity[:, 0])
    predicted = {
        name: ModalPlant(candidate, step_s=plant.step_s).run(judges.motor, start)[0]
        for name, candidate in orders.items()
    }
    rms = {name: _rms(angle_between(told, judges.orientation)) for name, told in predicted.items()}
    if order == "best":
        order = ORDERS[int(rms["second_order"] < (1 - worth) * rms["first_order"])]
    words = f"{len(seen)} pulse-steps of all motors on {plant_in_words(identity)}; {order.replace('_', ' ')}"
    details = {"plant": identity, "held_out_rms_deg": rms, "held_out": len(judges)}
    if eye.redundant:
        details |= {"workspace_deg": eye.workspace_deg, "ran_away": ran_away}
    surrogate = ModalSurrogate(modes=orders[order].modes, source=words, details=details, **known)
    return ModesIdentification(surrogate, order, orders, judges, predicted, eye.workspace_deg, ran_away)


def _rounded(values: NDArray[np.floating[Any]]) -> list[float]:
    """To six digits: the same on any machine."""
    return [float(f"{value:.6g}") for value in values]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@dataclass(frozen=True)
class _Eye:
    """What is known of a plant before its gains and poles are.

    Attributes:
        plant: it.
        rest: where its motors are when it looks straight ahead, (motors,).
        slope: gains there, (3, motors); 0 where a motor does not turn the eye about an axis.
        workspace_deg: starts and ends look up to here from straight ahead.
        edge_deg: up to here the motors hold it, as far as that is known.
    """

    plant: Plant
    rest: Array
    slope: Array
    workspace_deg: float = WORKSPACE_DEG
    edge_deg: float = np.inf

    @classmethod
    def of(cls, plant: Plant) -> "_Eye":
        """Of a plant.

        Raises:
            InputError: there are not three motors or more that turn the eye about three axes, and hold it.
        """
        rest = rests(plant.motors)
        moved = _STEP_DEG * np.eye(len(rest))
        slope = (as_vector(plant.rest(rest + moved)) - as_vector(plant.rest(rest - moved))).T / (2 * _STEP_DEG)
        slope[np.abs(slope) < _TURNS * np.abs(slope).max(axis=1, keepdims=True)] = 0
        axes = int(np.linalg.matrix_rank(slope, tol=_LEAST_GAIN))
        if axes < len(MODES):
            raise InputError(
                f"the {len(rest)} motors of plant {plant.name!r} turn the eye about {axes} independent axes; "
                "--all-motors needs three motors or more and three axes: leave it out, or choose another plant"
            )
        eye = cls(plant, rest, slope)
        if not eye.redundant:
            return eye
        edge = _edge(plant)
        if not edge:
            raise InputError(f"the motors of plant {plant.name!r} do not hold it next to straight ahead")
        return replace(eye, workspace_deg=min(WORKSPACE_DEG, round(_NEAR * edge, 1)), edge_deg=edge)

    @property
    def redundant(self) -> bool:
        """Whether it has more motors than axes."""
        return len(self.rest) > len(MODES)

    @property
    def reach(self) -> Array:
        """How far each motor works to either side of its rest, (motors,)."""
        low, high = np.array([motor.working for motor in self.plant.motors]).T
        return np.asarray(np.minimum(self.rest - low, high - self.rest))

    def drawn(self, count: int, random: np.random.Generator) -> Array:
        """Rotation vectors evenly over the workspace, (count, 3)."""
        torsion = random.uniform(-TORSION_DEG, TORSION_DEG, count)
        far, way = self.workspace_deg * np.sqrt(random.uniform(size=count)), random.uniform(-np.pi, np.pi, count)
        return np.stack([torsion, far * np.sin(way), far * np.cos(way)], axis=1)

    def motors(self, vector: Array, random: np.random.Generator) -> Array:
        """Positions (n, motors) for rotation vectors (n, 3).

        Three motors go by the gains at rest, less far where one works less far. More go where they hold the eye, and
        off that by a random part that turns nothing.
        """
        if not self.redundant:
            off = vector @ np.linalg.inv(self.slope).T
            far = np.abs(off) / self.reach
            return np.asarray(self.rest + off / np.maximum(far.max(axis=1, keepdims=True), 1))
        held = self.plant.hold(as_orientation(vector), tuple(motor.name for motor in self.plant.motors))
        shared = random.uniform(-SHARED_DEG, SHARED_DEG, held.shape)
        return held + shared - shared @ (np.linalg.pinv(self.slope) @ self.slope).T


def _edge(plant: Plant) -> float:
    """Angle from straight ahead [deg] up to which all motors together hold the eye in all directions."""
    far = np.arange(1, np.ceil(WORKSPACE_DEG / _NEAR) + 1)
    way = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    vector = far[:, None, None] * np.stack([0 * way, np.sin(way), np.cos(way)], axis=-1)
    held = plant.held(as_orientation(vector.reshape(-1, 3)), tuple(motor.name for motor in plant.motors))
    good = np.isfinite(held).reshape(len(far), -1).all(axis=1)
    return float(far[np.cumprod(good, dtype=bool)].max(initial=0.0))


def _gains(eye: _Eye, random: np.random.Generator) -> Array:
    """K (3, motors) by least squares over the orientations in which the eye rests, with the zeros of the slope.

    With every position all its mirror images: else what is a product of two components (a turned eye's torsion pulls it
    up or down) would pass for a gain.
    """
    motor = eye.motors((eye.drawn(_RESTS, random)[:, None] * _SIGNS).reshape(-1, 3), random)
    vector, off, K = as_vector(eye.plant.rest(motor)), motor - eye.rest, np.zeros_like(eye.slope)
    for i, turning in enumerate(eye.slope != 0):
        K[i, turning] = _rounded(np.linalg.lstsq(off[:, turning], vector[:, i], rcond=None)[0])
    return K


def _recorded(plant: Plant, command: Command, begin: Array) -> Trajectory:
    """From rest with the motors at begin (saccades, motors).

    Raises:
        InputError: a movement diverged.
    """
    done = plant.move(command, State(plant.rest(begin), begin), DURATION_S).trajectory()
    if done.failed.any():
        raise InputError(
            f"{done.failed.sum()} of {len(done)} movements of plant {plant.name!r} diverged; an eye that stiff needs "
            "a finer step of its integration"
        )
    return done


def _steps(eye: _Eye, random: np.random.Generator) -> Trajectory:
    """Steps from rest, of all motors together; of three also of each alone to both sides."""
    end = eye.motors(eye.drawn(_COMBINED, random), random)
    if not eye.redundant:
        alone = np.minimum(eye.reach, eye.workspace_deg / np.linalg.norm(eye.slope, axis=0))
        end = np.concatenate([*(eye.rest + share * np.diag(alone) for share in _SHARES), end])
    return _recorded(eye.plant, Sampled(end[:, None], eye.plant.step_s), np.tile(eye.rest, (len(end), 1)))


def _pulse_steps(eye: _Eye, near: Array, count: int, random: np.random.Generator) -> Trajectory:
    """Of all motors between random orientations, k0 near given rates [1/s] (motors,); without those that ran away.

    Raises:
        InputError: most did.
    """
    F, D = np.split(eye.motors(eye.drawn(2 * count, random), random), 2)
    low, high = np.log(B_RANGE)
    B = np.exp(random.uniform(low, high, F.shape))
    k0 = near * np.exp(random.uniform(-_K0_SPREAD, _K0_SPREAD, F.shape))
    done = _recorded(eye.plant, PulseStep(F, B, D, k0), F)
    stayed = np.asarray(angle_between_directions(gaze(done.orientation[:, -1]), gaze(FORWARD)) <= eye.edge_deg)
    if stayed.sum() < _LEAST_KEPT * count:
        raise InputError(
            f"from {count - stayed.sum()} of {count} pulse-steps plant {eye.plant.name!r} went where its motors do not "
            f"hold it, {eye.edge_deg:g} deg from straight ahead; no linear surrogate describes that"
        )
    return done[stayed]


def _fit(seen: Trajectory, K: Array, order: str, rest: Array) -> dict[str, Mode]:
    """Modes with these gains whose poles answer best to what the motors did off their rest, each axis by itself."""
    vector, step_s = as_vector(seen.orientation), float(seen.time[1])
    modes = {}
    for i, axis in enumerate(MODES):
        true, wanted = vector[..., i], (seen.motor - rest) @ K[i]
        modes[axis] = _fit_axis(true, wanted, tuple(K[i].tolist()), order, step_s)
    return modes


def _fit_axis(true: Array, wanted: Array, gains: tuple[float, ...], order: str, step_s: float) -> Mode:
    """One mode from components (saccades, time) of rotation vectors, and where the motors draw them."""

    def mode(numbers: list[float]) -> Mode:
        return Mode(gains, *numbers) if len(numbers) == 1 else Mode(gains, None, *numbers)

    def residual(x: Array) -> Array:
        poles = poles_of(mode(np.exp(x).tolist()))
        return np.asarray((sampled_response(1.0, poles, 0.0, wanted, step_s, true[:, 0])[0] - true).ravel())

    def best(guesses: list[tuple[float, ...]], bounds: list[tuple[float, float]]) -> list[float]:
        low, high = np.log(bounds).T
        fits = [optimize.least_squares(residual, np.clip(np.log(x), low, high), bounds=(low, high)) for x in guesses]
        return _rounded(np.exp(min(fits, key=lambda fit: fit.cost).x))

    first = best([(_FIRST_GUESS,)], [_RATES])
    if order == "first_order":
        return mode(first)
    (w0,) = first  # an eye that hardly has a second pole, and one that swings
    return mode(best([(3 * w0, 1.5), (w0, 0.7)], [_RATES, _ZETAS]))
