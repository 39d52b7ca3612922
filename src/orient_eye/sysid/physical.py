"""Parameters of an elastic eye's MJCF from recordings, with MuJoCo's own `mujoco.sysid`.

    fit = fit_physical(read_recordings(paths, "thesis"), "thesis")      # physical_recordings
    fit["friction"].interval, fit.held_out_rms_deg, fit.warnings
    write_eye(fit, "fitted.xml")                                        # fitted_eye

The eye of `eyes.build_model` moves as the recorded motors did, from rest at the first row, and stiffness and rest
length of its elastics (one of each for a default class of the MJCF) and its friction are fitted to the recorded
angles. The inertia acts within 2 ms: friction and stiffness divide out of what remains of the motion but for their
ratio, so at least one of them is frozen. A constant of each angle of each recording, the zero of its sensor, is
fitted along and counted.
"""

import copy
import io
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from types import ModuleType

import mujoco
import numpy as np
from mujoco.rollout import rollout
from numpy.typing import NDArray

from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError
from orient_eye.eyes.model import Tendons, build_model, load_spec, motors
from orient_eye.motor import rests
from orient_eye.plants.equilibrium import rest_orientation
from orient_eye.rotations import rotation
from orient_eye.sysid.comparison import HeldOut
from orient_eye.sysid.fit import Estimate, autocorrelation, effective_samples
from orient_eye.sysid.models import Parameter
from orient_eye.sysid.physical_recordings import Measured, angles_of

Array = NDArray[np.float64]
INSTALL = "pip install 'orient-eye[physical]'"
_REST = "rest_length_"
_FACTOR = 10.0  # bounds of stiffness and friction, from the eye's own value
_STABLE = 0.9  # of the friction at which the explicit step diverges, 2 inertia / step
_TAUT = 0.98  # longest rest length, of the length at rest: an elastic that is slack there pulls nothing
DIGITS = 6
"""Significant ones that MuJoCo writes into a file."""
_DIFFERENCE = 1e-5  # of the eye's own value, in the central differences of the intervals
_UNTOLD = 0.5  # half width of an interval, of the value
_ILL_CONDITIONED = 1e2  # of the Jacobian with columns of unit length
_ITERATIONS = 30


@dataclass(frozen=True)
class PhysicalFit:
    """An eye whose parameters fit the recordings best.

    Attributes:
        eye: that was fitted: preset or MJCF file.
        estimates: of the parameters that were fitted, in SI units.
        frozen: the others, name to value.
        rms_deg: root mean square of the residual [deg].
        samples: number of residuals.
        effective_samples: how many independent ones they are worth (`fit.effective_samples`).
        autocorrelation: lag-1, of the residuals.
        condition: number of the Jacobian with columns of unit length.
        held_out: each recording, predicted by a fit to the others; empty where there is one only.
        residuals: predicted less measured angles [deg] of each recording, without their means, (rows, axes).
        warnings: for people.
    """

    eye: str
    estimates: tuple[Estimate, ...]
    frozen: dict[str, float]
    rms_deg: float
    samples: int
    effective_samples: float
    autocorrelation: float
    condition: float
    held_out: tuple[HeldOut, ...]
    residuals: tuple[Array, ...]
    warnings: tuple[str, ...]

    def __getitem__(self, name: str) -> Estimate:
        return next(e for e in self.estimates if e.parameter.name == name)

    @property
    def values(self) -> dict[str, float]:
        """Of all parameters, fitted and frozen."""
        return {e.parameter.name: e.value for e in self.estimates} | self.frozen

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Parameters that sit on a bound."""
        return tuple(e.parameter.name for e in self.estimates if e.at_bound)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Parameters whose interval is wider than half the value to either side."""
        return tuple(e.parameter.name for e in self.estimates if not e.half_width < _UNTOLD * abs(e.value))

    @property
    def ill_conditioned(self) -> bool:
        """Whether parameters cannot be told apart; no interval means much then."""
        return not self.condition < _ILL_CONDITIONED

    @property
    def held_out_rms_deg(self) -> float:
        """Root mean square over the recordings [deg], each counting the same; NaN without any."""
        return float(np.sqrt(np.mean([h.rms_deg**2 for h in self.held_out]))) if self.held_out else float("nan")


def parameters(eye: str) -> dict[Parameter, float]:
    """What can be fitted of an eye, with its bounds, and the eye's own values.

    Raises:
        InputError: unknown eye, one that is wound up by spindles, or one whose elastics or friction pull nothing.
    """
    model = build_model(eye, visual=False)
    wound = Tendons.of(model).motor
    if (wound >= 0).any():
        those = ", ".join(motors(model)[i].name for i in wound if i >= 0)
        raise InputError(
            f"--physical fits the elastics of an eye that arms pull, and eye {eye!r} is wound up by spindles, {those}, "
            "whose stiffness it is: choose another --eye, or identify it without --physical"
        )
    friction, found = float(_friction(model)[0]), {}
    for group, tendons in _groups(eye).items():
        index = [model.tendon(name).id for name in tendons]
        stiffness, rest = model.tendon_stiffness[index], model.tendon_lengthspring[index, 1]
        shortest = float(model.tendon_length0[index].min())
        if np.ptp(stiffness) or np.ptp(rest) or not (stiffness > 0).all() or not 0 < rest[0] < _TAUT * shortest:
            raise InputError(
                f"the elastics {', '.join(tendons)} of eye {eye!r} must have one stiffness above 0 and one rest length "
                f"below {_TAUT * shortest:.4g} m, since they are one class: give them classes of their own, or tighten"
            )
        k, longest = float(stiffness[0]), min(1.5 * float(rest[0]), _TAUT * shortest)
        found[Parameter(f"stiffness_{group}", "N/m", k / _FACTOR, k * _FACTOR)] = k
        found[Parameter(f"{_REST}{group}", "m", 0.5 * float(rest[0]), longest)] = float(rest[0])
    if not friction > 0:
        raise InputError(f"eye {eye!r} has no friction (damping of its joint), so no angle tells a stiffness")
    diverges = 2 * float(model.body("eye").inertia.min()) / model.opt.timestep
    most = min(friction * _FACTOR, max(_STABLE * diverges, (friction + diverges) / 2))
    found[Parameter("friction", "N m s/rad", friction / _FACTOR, most)] = friction
    return found


def _friction(model: mujoco.MjModel) -> Array:
    first = int(model.joint("eye").dofadr[0])
    damping: Array = model.dof_damping[first : first + 3]
    return damping


def _groups(eye: str) -> dict[str, list[str]]:
    """Elastics by their default class of the MJCF."""
    spec, groups = load_spec(eye), dict[str, list[str]]()  # MuJoCo's tendons do not keep their spec alive
    for tendon in spec.tendons:
        name = tendon.default().name
        groups.setdefault("elastics" if name == "main" else name, []).append(tendon.name)
    return groups


def fit_physical(
    recordings: Sequence[Measured], eye: str = "thesis", frozen: Sequence[str] | None = None
) -> PhysicalFit:
    """Fit an eye to recordings, and leave each out in turn to see how the others predict it.

    Args:
        recordings: of `read_physical`, of motors of this eye.
        eye: to start from, preset or MJCF file.
        frozen: names of parameters that keep the eye's own value; None for `usually_frozen`.

    Raises:
        InputError: no recording, unknown parameters, no stiffness or friction frozen, nothing left to fit, too few
            rows, motors beyond the eye's reach, or `mujoco.sysid` is not installed.
    """
    if not recordings:
        raise InputError("no recording is given; name one or more")
    own, sysid = parameters(eye), _sysid()
    free = _free(own, usually_frozen(own) if frozen is None else frozen)
    problem = _Problem.of(eye, own, free, recordings)
    needed = len(free) + problem.constants + 2
    if problem.samples < needed:
        raise InputError(
            f"the recordings have {problem.samples} angles; at least {needed} are needed: record more rows"
        )
    values = _search(sysid, problem, _beginning(sysid, problem, own))
    values = np.array([float(f"{x:.{DIGITS}g}") for x in values * problem.own]) / problem.own  # as in the file
    held_out = []
    if len(recordings) > 1:
        for left_out in recordings:
            others = _Problem.of(eye, own, free, [r for r in recordings if r is not left_out])
            judge = _Problem.of(eye, own, free, [left_out])
            error = judge.residuals(_search(sysid, others, values)[:, None])[0][:, 0]
            spread = left_out.angles - left_out.angles.mean(axis=0)
            rms, power = float(np.sqrt(np.mean(error**2))), float(np.sum(spread**2))
            held_out.append(HeldOut(left_out.name, rms, 1 - float(error @ error) / power if power else float("nan")))
    return _judged(sysid, problem, values, tuple(held_out))


def moved(fit: PhysicalFit, recordings: Sequence[Measured]) -> tuple[Array, Array]:
    """How the fitted eye moves under the motors of recordings.

    Returns:
        Times from each first row on [s] (time,), and yaw, pitch, roll [deg] (recordings, time, 3).
    """
    own = parameters(fit.eye)
    free = [e.parameter for e in fit.estimates]
    problem = _Problem.of(fit.eye, own, free, recordings)
    time, angles = problem.angles(np.array([[e.value / own[e.parameter]] for e in fit.estimates]))
    return time, angles[0]


def usually_frozen(own: dict[Parameter, float]) -> tuple[str, ...]:
    """The horizontal stiffness (or the first), and the rest lengths, which one axis cannot tell."""
    names = [p.name for p in own]
    stiffness = [name for name in names if name.startswith("stiffness_")]
    scale = "stiffness_horizontal" if "stiffness_horizontal" in stiffness else stiffness[0]
    return (scale, *(name for name in names if name.startswith(_REST)))


def _free(own: dict[Parameter, float], frozen: Sequence[str]) -> list[Parameter]:
    names = [p.name for p in own]
    for name in frozen:
        if name not in names:
            raise InputError(f"this eye has no parameter {name!r}; it has {', '.join(names)}")
    scale = [name for name in names if name.startswith("stiffness_") or name == "friction"]
    if not set(scale) & set(frozen):
        raise InputError(
            "angles alone tell only ratios of stiffness to friction: freeze one of "
            f"{', '.join(scale)} at the eye's own value"
        )
    free = [p for p in own if p.name not in frozen]
    if not free:
        raise InputError(f"every parameter is frozen, nothing is left to fit; leave out one of {', '.join(names)}")
    return free


def _sysid() -> ModuleType:
    """`mujoco.sysid`, which without its dependencies can be imported and is empty."""
    sysid = import_module("mujoco.sysid")
    if not hasattr(sysid, "ParameterDict"):
        raise InputError(f"physical parameters are fitted by mujoco.sysid, whose packages are not there: {INSTALL}")
    return sysid


@dataclass(frozen=True)
class _Problem:
    """Recordings and how an eye is told to repeat them; values are in units of the eye's own.

    Attributes:
        eye: see `PhysicalFit`.
        model: of the eye, without shapes.
        free: to be fitted.
        own: values of the free parameters in the eye, (free,).
        frozen: the others.
        groups: of the elastics.
        recordings: to be fitted.
        control: motor angles at the end of every step [rad], (recordings, steps, motors).
    """

    eye: str
    model: mujoco.MjModel
    free: list[Parameter]
    own: Array
    frozen: dict[str, float]
    groups: dict[str, list[str]]
    recordings: Sequence[Measured]
    control: Array

    @classmethod
    def of(
        cls, eye: str, own: dict[Parameter, float], free: list[Parameter], recordings: Sequence[Measured]
    ) -> "_Problem":
        model = build_model(eye, visual=False)
        steps = max(int(np.ceil((r.time[-1] - r.time[0]) / model.opt.timestep)) for r in recordings)
        # An arm stands where its control says one step later, so each step is sent the next instant.
        at = model.opt.timestep * np.arange(1, steps + 1)
        control = np.array(
            [[np.interp(at, r.time - r.time[0], m) for m in np.deg2rad(r.motor.T)] for r in recordings]
        ).transpose(0, 2, 1)
        frozen = {p.name: value for p, value in own.items() if p not in free}
        return cls(eye, model, free, np.array([own[p] for p in free]), frozen, _groups(eye), recordings, control)

    @property
    def samples(self) -> int:
        """Number of measured angles."""
        return sum(r.angles.size for r in self.recordings)

    @property
    def constants(self) -> int:
        """Number of zeros of sensors."""
        return sum(len(r.axes) for r in self.recordings)

    def eye_of(self, values: Array) -> mujoco.MjModel:
        """The eye with these values (free,)."""
        told = dict(zip([p.name for p in self.free], values * self.own, strict=True))
        model = copy.copy(self.model)
        for group, tendons in self.groups.items():
            index = [model.tendon(name).id for name in tendons]
            model.tendon_stiffness[index] = told.get(f"stiffness_{group}", model.tendon_stiffness[index])
            model.tendon_lengthspring[index, 1] = told.get(f"{_REST}{group}", model.tendon_lengthspring[index, 1])
        _friction(model)[:] = told.get("friction", _friction(model))
        return model

    def residuals(self, values: Array) -> list[Array]:
        """Predicted less measured angles [deg], without their means, of eyes with values (free, eyes).

        Returns:
            For each recording (rows * axes, eyes), the angles one after the other; NaN where an eye diverged or
            finds no rest.
        """
        time, angles = self.angles(values)
        return [self._residual(r, time, angles[:, i]) for i, r in enumerate(self.recordings)]

    def angles(self, values: Array) -> tuple[Array, Array]:
        """Times from the first row on [s] (time,), and yaw, pitch, roll [deg] (eyes, recordings, time, 3)."""
        models = [self.eye_of(column) for column in values.T]
        starts = np.concatenate([self._starts(model) for model in models])
        count, steps = len(self.recordings), self.control.shape[1]
        data = [mujoco.MjData(self.model) for _ in range(max(1, len(os.sched_getaffinity(0))))]
        control = np.tile(self.control, (len(models), 1, 1))
        state, _ = rollout([m for m in models for _ in range(count)], data, starts, control)
        state = np.concatenate([starts[:, None], state], axis=1).reshape(len(models), count, steps + 1, -1)
        first = 1 + int(self.model.joint("eye").qposadr[0])  # time comes first
        angles = angles_of(state[..., first : first + 4])
        # After a divergence a rollout repeats its last state, time included.
        whole = (state[..., -1, 0] > (steps - 0.5) * self.model.opt.timestep) & np.isfinite(state[..., 0, :]).all(-1)
        angles[~whole] = np.nan
        time = self.model.opt.timestep * np.arange(steps + 1)
        return time, angles

    def _residual(self, recording: Measured, time: Array, angles: Array) -> Array:
        at, columns = recording.time - recording.time[0], []
        for i, axis in enumerate(recording.axes):
            predicted = np.array([np.interp(at, time, one) for one in angles[..., AXES.index(axis)]])
            error = predicted - recording.angles[:, i]
            columns.append(error - error.mean(axis=-1, keepdims=True))
        return np.concatenate(columns, axis=-1).T

    def _starts(self, model: mujoco.MjModel) -> Array:
        """States at rest with the motors at their first rows, (recordings, state); NaN where there is no rest."""
        data, eye = mujoco.MjData(model), model.joint("eye")
        qpos, dofs = int(eye.qposadr[0]) + np.arange(4), int(eye.dofadr[0]) + np.arange(3)
        actuators = [model.actuator(motor.name) for motor in motors(model)]
        arms = np.array([int(model.jnt_qposadr[a.trnid[0]]) for a in actuators])
        gear = np.array([float(a.gear[0]) for a in actuators])

        def torque(orientation: Array, motor: Array) -> Array:
            found = np.empty((len(motor), 3))
            for i, (turned, degrees) in enumerate(zip(orientation, motor, strict=True)):
                data.qpos[qpos], data.qpos[arms] = turned, np.deg2rad(degrees) / gear
                mujoco.mj_fwdPosition(model, data)
                mujoco.mj_fwdVelocity(model, data)
                found[i] = data.qfrc_passive[dofs]
            return np.asarray(rotation(orientation).apply(found))

        size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        begin = np.array([r.motor[0] for r in self.recordings])
        states = np.full((len(begin), size), np.nan)
        try:
            rest = rest_orientation(torque, begin, rests(motors(model)))
        except (InputError, np.linalg.LinAlgError):
            return states
        for i, orientation in enumerate(rest):
            mujoco.mj_resetData(model, data)
            data.qpos[qpos], data.qpos[arms] = orientation, np.deg2rad(begin[i]) / gear
            mujoco.mj_getState(model, data, states[i], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        return states


def _beginning(sysid: ModuleType, problem: _Problem, own: dict[Parameter, float]) -> Array:
    """Where the search begins: at what fits with the eye's own rest lengths; from farther away it is led astray."""
    values = np.ones(len(problem.free))
    sure = np.array([not p.name.startswith(_REST) for p in problem.free])
    if sure.any() and not sure.all():
        free = [p for p, is_sure in zip(problem.free, sure, strict=True) if is_sure]
        values[sure] = _search(sysid, _Problem.of(problem.eye, own, free, problem.recordings), np.ones(len(free)))
    return values


def _search(sysid: ModuleType, problem: _Problem, start: Array) -> Array:
    """Least squares inside the bounds, in units of the eye's own values, (free,)."""
    asked = sysid.ParameterDict()
    for p, own, value in zip(problem.free, problem.own, start, strict=True):
        asked.add(sysid.Parameter(p.name, float(value), p.low / own, p.high / own))
    first = problem.residuals(start[:, None])
    if not np.isfinite(np.concatenate(first)).all():
        raise InputError(
            f"eye {problem.eye!r} does not move as these motors did: it finds no rest where they begin, or diverges; "
            "check the motors' angles and their zero"
        )
    # The backend prints whatever `verbose` says: mujoco.sysid 4.0 does not pass it on.
    found, _ = sysid.optimize(
        asked.move_off_bounds(),
        lambda x, _: (problem.residuals(x.reshape(len(start), -1)), [], []),
        verbose=False,
        max_iters=_ITERATIONS,
        output=io.StringIO(),
    )
    return np.asarray(found.as_vector())


def _judged(sysid: ModuleType, problem: _Problem, values: Array, held_out: tuple[HeldOut, ...]) -> PhysicalFit:
    count = len(values)
    shifted = np.concatenate([values[:, None], values[:, None] + _DIFFERENCE * np.eye(count),
                              values[:, None] - _DIFFERENCE * np.eye(count)], axis=1)  # fmt: skip
    parts = problem.residuals(shifted)
    all_of = np.concatenate(parts)
    residual, jacobian = all_of[:, 0], (all_of[:, 1 : 1 + count] - all_of[:, 1 + count :]) / (2 * _DIFFERENCE)
    correlation = autocorrelation(
        [c for part, r in zip(parts, problem.recordings, strict=True) for c in np.split(part[:, 0], len(r.axes))]
    )
    freedom = len(residual) - count
    effective = effective_samples(len(residual), correlation, count)
    _, half = sysid.calculate_intervals([residual], jacobian)
    # White residuals, and no constants, are what it takes for granted.
    half = half * np.sqrt(len(residual) / effective * freedom / (freedom - problem.constants)) * problem.own
    norms = np.linalg.norm(jacobian, axis=0)
    singular = np.linalg.svd(jacobian / np.where(norms > 0, norms, 1), compute_uv=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0 else np.inf
    estimates = []
    for p, value, h, norm in zip(problem.free, values * problem.own, half, norms, strict=True):
        near = min(1e-3 * (p.high - p.low), 1e-2 * float(value))
        half_width = float(h) if norm > 0 and np.isfinite(h) else np.inf
        estimates.append(
            Estimate(p, float(f"{value:.{DIGITS}g}"), half_width, bool(min(value - p.low, p.high - value) < near))
        )
    fit = PhysicalFit(
        eye=problem.eye,
        estimates=tuple(estimates),
        frozen=problem.frozen,
        rms_deg=float(np.sqrt(np.mean(residual**2))),
        samples=len(residual),
        effective_samples=effective,
        autocorrelation=correlation,
        condition=condition,
        held_out=held_out,
        residuals=tuple(
            part[:, 0].reshape(len(r.axes), -1).T for part, r in zip(parts, problem.recordings, strict=True)
        ),
        warnings=(),
    )
    return replace(fit, warnings=tuple(_warnings(fit, problem.recordings)))


def _warnings(fit: PhysicalFit, recordings: Sequence[Measured]) -> Iterator[str]:
    for recording in recordings:
        yield from (f"{recording.name}: {text}" for text in recording.warnings)
    for e in fit.estimates:
        p = e.parameter
        if e.at_bound:
            yield f"{p.name} = {e.value:.4g} {p.unit} sits on its bound ({p.low:.4g} to {p.high:.4g}): do not trust it"
        elif p.name in fit.undetermined:
            yield f"{p.name} cannot be told from these recordings: {e} {p.unit} (95 %); freeze it"
    if fit.ill_conditioned:
        told = f"condition number {fit.condition:.1e} (1 is best)"
        yield f"parameters cannot be told apart, {told}, so no interval means much: freeze one"
    if not fit.held_out:
        yield "one recording only: nothing is held out"
