"""Parameters of an elastic eye's MJCF from recordings, with MuJoCo's own `mujoco.sysid`.

    fit = fit_physical(read_recordings(paths, "thesis"), "thesis")
    fit["friction"].interval, fit.held_out_rms_deg, fit.warnings
    write_eye(fit, "fitted.xml")                     # make_plant("mujoco", eye="fitted.xml")

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
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
from mujoco.rollout import rollout
from numpy.typing import NDArray

from orient_eye.constants import ANGLES as AXES
from orient_eye.errors import InputError
from orient_eye.eyes.model import build_model, load_spec, motors
from orient_eye.files import write_text
from orient_eye.motor import Motor
from orient_eye.plants.equilibrium import rest_orientation
from orient_eye.rig import Rig
from orient_eye.rotations import rotation, to_euler
from orient_eye.sysid import prototype_log
from orient_eye.sysid.comparison import HeldOut
from orient_eye.sysid.fit import Estimate, autocorrelation, effective_samples
from orient_eye.sysid.models import Parameter
from orient_eye.sysid.recordings import MIN_ROWS, read_recording
from orient_eye.tables import read_lines, table_of

Array = NDArray[np.float64]
INSTALL = "pip install 'orient-eye[physical]'"
_QUATERNION = ("q_w", "q_x", "q_y", "q_z")
_REST = "rest_length_"
_FACTOR = 10.0  # bounds of stiffness and friction, from the eye's own value
_STABLE = 0.9  # of the friction at which the explicit step diverges, 2 inertia / step
_TAUT = 0.98  # longest rest length, of the length at rest: an elastic that is slack there pulls nothing
_DIGITS = 6  # significant ones that MuJoCo writes into a file
_DIFFERENCE = 1e-5  # of the eye's own value, in the central differences of the intervals
_UNTOLD = 0.5  # half width of an interval, of the value
_ILL_CONDITIONED = 1e2  # of the Jacobian with columns of unit length
_ITERATIONS = 30


@dataclass(frozen=True)
class Measured:
    """A recorded movement of an eye and its motors.

    Attributes:
        name: of the file.
        time: [s], rising, any spacing, (rows,).
        motor: measured positions of all motors of the eye [deg], (rows, motors).
        axes: which angles were measured, of yaw, pitch, roll.
        angles: [deg], (rows, axes).
        warnings: of the reader.
    """

    name: str
    time: Array
    motor: Array
    axes: tuple[str, ...]
    angles: Array
    warnings: tuple[str, ...] = ()

    def until(self, time: float) -> "Measured":
        """Its rows up to a time [s]."""
        kept = self.time <= time
        if kept.sum() < MIN_ROWS or not np.ptp(self.motor[kept], axis=0).any():
            raise InputError(
                f"{self.name} has {kept.sum()} rows until {time:g} s; at least {MIN_ROWS} are needed, with a motor "
                "that moves: name a later time"
            )
        return replace(self, time=self.time[kept], motor=self.motor[kept], angles=self.angles[kept])


def read_recordings(
    paths: Sequence[Path],
    eye: str = "thesis",
    row_times: str = "even",
    until: float | None = None,
    rig: Rig | None = None,
) -> tuple[Measured, ...]:
    """Read recordings of an eye; see `read_physical`.

    Args:
        paths: of the files.
        eye: whose motors they are.
        row_times: see `read_physical`.
        until: leave out what comes after this time [s], in the clock of the files; None for nothing.
        rig: see `read_physical`.

    Raises:
        InputError: also when a file is named twice, or fewer than 8 rows are left.
    """
    resolved = [Path(path).resolve() for path in paths]
    for path in resolved:
        if resolved.count(path) > 1:
            raise InputError(f"{path.name} is named twice; a recording counts once")
    eye_motors = motors(build_model(eye, visual=False))
    read = tuple(read_physical(Path(path), eye_motors, row_times, rig) for path in paths)
    return read if until is None else tuple(each.until(until) for each in read)


def read_physical(path: Path, eye_motors: Sequence[Motor], row_times: str = "even", rig: Rig | None = None) -> Measured:
    """Read a recording: a table as `orient-eye simulate` writes it, or a log of the prototype.

    Columns: t_s; a motor's (tau2_deg) where it moved, motors without one stand at 0; q_w, q_x, q_y, q_z, or any of
    yaw_deg, pitch_deg, roll_deg. Others are ignored.

    Args:
        path: of the file.
        eye_motors: of the eye that is to be fitted.
        row_times: of a prototype log, see `recordings.read_recording`.
        rig: whose motors of the same names tell their positions in their driver's units, in its columns.

    Raises:
        InputError: unreadable, no such columns, fewer than 8 rows, time that does not rise, or motors that stand.
    """
    lines = read_lines(path)
    if lines and prototype_log.recognised(lines[0][1]):
        step = read_recording(path, row_times=row_times)
        if step.orientation is None or any(motor.name not in step.motors for motor in eye_motors):
            raise InputError(f"{path}: the prototype has motor1, motor2 and motor3, this eye has others; give a table")
        driven = np.stack([step.motors[motor.name] for motor in eye_motors], axis=-1)
        return Measured(step.name, step.time, driven, AXES, _angles(step.orientation), step.warnings)
    table = table_of(path, lines, "t_s,tau2_deg,yaw_deg,pitch_deg,roll_deg")
    if len(table.lines) < MIN_ROWS:
        raise InputError(f"{path} has {len(table.lines)} rows of numbers; a recording needs at least {MIN_ROWS}")
    time = table.rising_time()
    motor = np.zeros((len(time), len(eye_motors)))
    spoken = {} if rig is None else {m.name: m for m in rig.motors}
    columns = {m.name: spoken[m.name].column if m.name in spoken else m.column for m in eye_motors}
    for i, each in enumerate(eye_motors):
        if columns[each.name] in table:
            told = table[columns[each.name]]
            motor[:, i] = spoken[each.name].from_driver(told) if each.name in spoken else told
    if not np.ptp(motor, axis=0).any():
        raise InputError(
            f"{path}: no motor of this eye moves; its columns are {', '.join(columns.values())}, the file has "
            f"{', '.join(table.columns)}"
        )
    if all(name in table for name in _QUATERNION):
        quaternion = table.stack(_QUATERNION)
        if (np.abs(np.linalg.norm(quaternion, axis=-1) - 1) > 0.01).any():
            raise InputError(f"{path}: {', '.join(_QUATERNION)} must be unit quaternions, some are not")
        return Measured(path.name, time, motor, AXES, _angles(quaternion))
    axes = tuple(axis for axis in AXES if f"{axis}_deg" in table)
    if not axes:
        raise InputError(
            f"{path} has no angle of the eye: no column yaw_deg, pitch_deg, roll_deg, or {', '.join(_QUATERNION)}; it "
            f"has {', '.join(table.columns)}"
        )
    angles = np.stack([np.unwrap(table[f"{axis}_deg"], period=360.0) for axis in axes], axis=-1)
    return Measured(path.name, time, motor, axes, angles)


def _angles(orientation: Array) -> Array:
    """Yaw, pitch, roll [deg] (..., time, 3) without jumps, of orientations (..., time, 4)."""
    return np.unwrap(np.stack(to_euler(rotation(orientation).as_quat(scalar_first=True)), axis=-1), period=360, axis=-2)


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
        InputError: unknown eye, or one whose elastics or friction pull nothing.
    """
    model = build_model(eye, visual=False)
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
    sysid, own = _sysid(), parameters(eye)
    free = _free(own, usually_frozen(own) if frozen is None else frozen)
    problem = _Problem.of(eye, own, free, recordings)
    needed = len(free) + problem.constants + 2
    if problem.samples < needed:
        raise InputError(
            f"the recordings have {problem.samples} angles; at least {needed} are needed: record more rows"
        )
    values = _search(sysid, problem, _beginning(sysid, problem, own))
    values = np.array([float(f"{x:.{_DIGITS}g}") for x in values * problem.own]) / problem.own  # as in the file
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
        models = [self.eye_of(column) for column in values.T]
        starts = np.concatenate([self._starts(model) for model in models])
        count, steps = len(self.recordings), self.control.shape[1]
        data = [mujoco.MjData(self.model) for _ in range(max(1, len(os.sched_getaffinity(0))))]
        control = np.tile(self.control, (len(models), 1, 1))
        state, _ = rollout([m for m in models for _ in range(count)], data, starts, control)
        state = np.concatenate([starts[:, None], state], axis=1).reshape(len(models), count, steps + 1, -1)
        first = 1 + int(self.model.joint("eye").qposadr[0])  # time comes first
        angles = _angles(state[..., first : first + 4])
        # After a divergence a rollout repeats its last state, time included.
        whole = (state[..., -1, 0] > (steps - 0.5) * self.model.opt.timestep) & np.isfinite(state[..., 0, :]).all(-1)
        angles[~whole] = np.nan
        time = self.model.opt.timestep * np.arange(steps + 1)
        return [self._residual(r, time, angles[:, i]) for i, r in enumerate(self.recordings)]

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
            rest = rest_orientation(torque, begin)
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
            Estimate(p, float(f"{value:.{_DIGITS}g}"), half_width, bool(min(value - p.low, p.high - value) < near))
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


def write_eye(fit: PhysicalFit, path: str | Path) -> list[str]:
    """Write the fitted eye as an MJCF file that needs no other: its meshes stand in it.

    MuJoCo writes 6 significant digits; those of the fitted parameters are what was fitted.

    Returns:
        Files that it still refers to, relative to those of the eye it was made from: textures, height fields.

    Raises:
        InputError: it cannot be written.
    """
    spec, values = load_spec(fit.eye), fit.values
    for tendon in spec.tendons:
        default = tendon.default()
        group = "elastics" if default.name == "main" else default.name
        for name, place, index in (("stiffness", "stiffness", 0), ("rest_length", "springlength", 1)):
            if f"{name}_{group}" not in fit.frozen:
                for changed in (default.tendon, tendon):  # in the class, so that the file says it once
                    getattr(changed, place)[index] = values[f"{name}_{group}"]
    if "friction" not in fit.frozen:
        spec.joint("eye").damping[0] = values["friction"]
    _inline_meshes(spec)
    told = [f"{e.parameter.name} = {e} {e.parameter.unit} (95 %)" for e in fit.estimates]
    told += [f"{name} = {value:.6g}, kept" for name, value in fit.frozen.items()]
    comment = f"Eye {Path(fit.eye).name}, fitted to recordings by orient-eye sysid: " + "; ".join(told) + "."
    xml = spec.to_xml()
    write_text(path, f"<!-- {comment.replace('--', '- -')} -->\n{xml}")
    files = (element.get("file") for element in ElementTree.fromstring(xml).iter() if element.tag != "compiler")
    return sorted({file for file in files if file})


def _inline_meshes(spec: mujoco.MjSpec) -> None:
    """Meshes of files as numbers in the MJCF."""
    model = spec.copy().compile()
    for mesh in spec.meshes:
        if not mesh.file:
            continue
        i = model.mesh(mesh.name).id
        corner, face = model.mesh_vertadr[i], model.mesh_faceadr[i]
        corners = model.mesh_vert[corner : corner + model.mesh_vertnum[i]]
        # The compiler puts a mesh into its own frame, scaled.
        placed = rotation(model.mesh_quat[i]).apply(corners) + model.mesh_pos[i]
        mesh.file, mesh.content_type, mesh.scale = "", "", [1, 1, 1]
        mesh.refpos, mesh.refquat = [0, 0, 0], [1, 0, 0, 0]
        mesh.uservert = placed.ravel().tolist()
        mesh.userface = model.mesh_face[face : face + model.mesh_facenum[i]].ravel().tolist()


def summary(fit: PhysicalFit) -> dict[str, Any]:
    """The fit as plain values, for JSON, without NaN or infinity."""

    def finite(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    return {
        "eye": fit.eye,
        "fitted": {
            e.parameter.name: {
                "value": e.value,
                "interval": [finite(x) for x in e.interval],
                "unit": e.parameter.unit,
                "bounds": [e.parameter.low, e.parameter.high],
                "at_bound": e.at_bound,
                "undetermined": e.parameter.name in fit.undetermined,
            }
            for e in fit.estimates
        },
        "frozen": fit.frozen,
        "rms_deg": fit.rms_deg,
        "samples": fit.samples,
        "effective_samples": fit.effective_samples,
        "autocorrelation": fit.autocorrelation,
        "condition": finite(fit.condition),
        "held_out": [{"name": h.name, "rms_deg": h.rms_deg, "r_squared": finite(h.r_squared)} for h in fit.held_out],
        "held_out_rms_deg": finite(fit.held_out_rms_deg),
        "warnings": list(fit.warnings),
    }
