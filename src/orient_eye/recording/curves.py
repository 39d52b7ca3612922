"""The time series of a recording: which curves a saccade has, and the plots they stand in."""

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import listing, rotations
from orient_eye.eyes.muscles import Muscles
from orient_eye.movement.trajectory import Trajectory
from orient_eye.recording.directions import Graticule, net, protractor
from orient_eye.recording.scene import REFERENCE_COLOUR, TIMELINE, Colour, slug

if TYPE_CHECKING:
    import rerun as rr

Array = NDArray[np.float64]
TARGET_COLOUR = (165, 165, 170)
"""Of what was wanted: targets and commands."""
TENDON_COLOURS: tuple[Colour, ...] = (
    (80, 160, 220), (255, 150, 60), (90, 190, 90), (235, 90, 90), (175, 130, 210),
    (170, 125, 110), (235, 140, 200), (200, 200, 70), (60, 200, 210), (150, 150, 150),
)  # fmt: skip
_TURNS = {"yaw": "z", "pitch": "y", "torsion": "x"}  # an angle and the axis of its velocity
STILL_DEG = 0.5
"""Angles that stay below are left out; torsion is shown, however small, where yaw and pitch both move."""
_TURN = 0.37  # of the circle of hues, from one curve of a saccade to the next
_SAME = 1e-6  # of a motor's unit: a command that its motor follows to this is not drawn


@dataclass(frozen=True)
class Plot:
    """A plot that every saccade has.

    Attributes:
        name: with its unit.
        series: entity paths below a saccade's root; those of the reference are added.
        span: smallest and largest value over all saccades, so that tabs compare.
        legend: how many curves of one saccade it has to tell apart; 0 where there is one.
        shaded: the first curve has another hue than its saccade's colour, because of its place in a saccade's tab.
        labels: of the curves in a saccade's own tab; none for their names with its title.
        row: in which it stands with others; 0 for wherever there is room.
    """

    name: str
    series: tuple[str, ...]
    span: tuple[float, float]
    legend: int = 0
    shaded: bool = False
    labels: tuple[str, ...] = ()
    row: int = 0


class Curves:
    """The curves of a batch of saccades, in deg, deg/s, N and the motors' units.

    Args:
        trajectory: the saccades.
        drawn: those that will be drawn.
        tension: of the tendons [N], (saccades, time, tendons).
        tendons: their names.
        target: orientations (saccades, 4), or (saccades, time, 4) where it changes, or None.
        reference: another trajectory of the same saccades, or None.
        muscles: what the tendons are, where they are antagonists: each two share their plots. None for tendons.

    Attributes:
        own: entity path below a saccade's root to values (saccades, time).
        told: the same of commands, where a motor was told to be elsewhere than it was.
        target: the same of the target, (saccades,) or (saccades, time).
        reference: the same of the reference, (saccades, its time); its root is the saccade's "reference".
        turns: the angles that are shown, of yaw, pitch, torsion.
        largest_deg: the largest of each either way; 0 for those left out.
        eccentricity_deg: how far the gaze, or its target, is from straight ahead at most.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        drawn: list[int],
        tension: Array,
        tendons: tuple[str, ...],
        *,
        target: Array | None = None,
        reference: Trajectory | None = None,
        muscles: Muscles | None = None,
    ) -> None:
        self._drawn, self._time, self._tension = drawn, trajectory.time, tension
        self._tendons, self._muscles = () if muscles else tendons, muscles
        orientations = [trajectory.orientation[drawn]]
        orientations += [] if target is None else [target[drawn]]
        orientations += [] if reference is None else [np.nan_to_num(reference.orientation[drawn])]
        turned = [turned_by(q) for q in orientations]
        largest = {turn: max(float(abs(each[turn]).max(initial=0)) for each in turned) for turn in _TURNS}
        moving = {turn for turn in _TURNS if largest[turn] > STILL_DEG}
        shown = (moving or {"yaw"}) | ({"torsion"} if {"yaw", "pitch"} <= moving else set())
        self.turns = turns = [turn for turn in _TURNS if turn in shown]
        ahead = rotations.gaze(rotations.FORWARD)
        away = [rotations.angle_between_directions(rotations.gaze(q), ahead) for q in orientations]
        self.eccentricity_deg = max(float(each.max(initial=0)) for each in away)
        self.largest_deg = {turn: largest[turn] if turn in turns else 0.0 for turn in _TURNS}
        self.own = _curves(trajectory, turns)
        if muscles:
            self.own |= {f"tension/{slug(name)}": tension[..., i] for i, name in enumerate(muscles.names)}
        self._units = {f"motor/{slug(motor.name)}": motor.unit for motor in trajectory.motors}
        off = np.abs(np.nan_to_num(trajectory.command - trajectory.motor)[drawn]).max(axis=(0, 1), initial=0) > _SAME
        self.told = {
            f"command/{slug(motor.name)}": trajectory.command[..., i]
            for i, motor in enumerate(trajectory.motors)
            if off[i]
        }
        self.target = {} if target is None else {f"angle/target_{turn}": turned_by(target)[turn] for turn in turns}
        self.reference = {} if reference is None else _curves(reference, turns)
        self._reference_time = np.zeros(0) if reference is None else reference.time
        self._reference_failed = np.zeros(0, bool) if reference is None else reference.failed

    @property
    def graticule(self) -> Graticule:
        """By which the gaze is read: a protractor where only yaw moves, else a net of directions."""
        if self.turns != ["yaw"]:
            return net(self.eccentricity_deg)
        return protractor(max(self.largest_deg["yaw"], 30))

    def plots(self) -> list[Plot]:
        """Beside the eye: angles with targets (torsion apart), motors by unit with commands, velocity, tension.

        Of muscles motors and tensions have a row each, with a plot for each two antagonists.
        """
        moving = self._moving_motors()
        units = dict.fromkeys(self._units[name] for name in moving)
        angles = [f"angle/{turn}" for turn in self.turns]
        gaze, torsion = ([a for a in angles if (a == "angle/torsion") == apart] for apart in (False, True))
        turned = [self._angle_plot(shown) for shown in (gaze, torsion) if shown]
        if self._muscles:
            own = [*turned, self._plot("angular velocity [deg/s]", self._named("velocity"))]
            return [_labelled(plot, row) for row, plots in enumerate((own, *self._pairs()), 1) for plot in plots]
        plots = [
            *turned,
            *(self._motor_plot([name for name in moving if self._units[name] == unit]) for unit in units),
            self._plot("angular velocity [deg/s]", self._named("velocity")),
        ]
        if self._tendons:
            top = float(self._tension[self._drawn].max(initial=0))
            plots.append(Plot("tension [N]", ("tension",), (0, top), legend=len(self._tendons)))
        return plots

    def compared(self) -> list[Plot]:
        """Those that show all saccades: one curve a saccade in each, with its target; of muscles no tension."""
        curves = [
            (plot.row, place, curve)
            for plot in self.plots()
            for place, curve in enumerate(name for name in plot.series if name in self.own)
        ]
        if self._muscles:  # antagonists one above the other: the first of each two, then the others
            curves.sort(key=lambda curve: (curve[0], curve[1] * (curve[0] > 1)))
        plots = []
        for _, place, curve in curves:
            quantity, what = curve.split("/")
            if quantity == "angle":
                each = self._angle_plot([curve])
            elif quantity == "motor":
                each = self._motor_plot([curve])
            elif quantity == "velocity":
                each = self._plot(f"angular velocity about {what} [deg/s]", [curve])
            else:
                continue
            plots.append(replace(each, shaded=place > 0))
        return plots

    def draw(self, rec: "rr.RecordingStream", root: str, saccade: int, *, title: str, colour: Colour) -> None:
        """Send a saccade's curves: in its colour, the others of a plot in other hues."""
        place = {name: i for plot in self.plots() for i, name in enumerate(plot.series)}
        for path, values in self.own.items():
            style = _style(f"{path.split('/')[1]} {title}", turned_hue(colour, place.get(path, 0)), 2)
            _send(rec, f"{root}/{path}", self._time, values[saccade], style)
        for path, values in self.told.items():
            style = _style(f"{path.replace('/', ' ')} {title}", TARGET_COLOUR, 1)
            _send(rec, f"{root}/{path}", self._time, values[saccade], style)
        for path, angle in self.target.items():
            style = _style(f"{path.split('/')[1].replace('_', ' ')} {title}", TARGET_COLOUR, 1)
            _send(rec, f"{root}/{path}", self._time, np.broadcast_to(angle[saccade], self._time.shape), style)
        if self.reference and not self._reference_failed[saccade]:
            for path, values in self.reference.items():
                style = _style(f"reference {path.split('/')[1]} {title}", REFERENCE_COLOUR, 1)
                _send(rec, f"{root}/reference/{path}", self._reference_time, values[saccade], style)
        if self._tendons:
            colours = [TENDON_COLOURS[i % len(TENDON_COLOURS)] for i in range(len(self._tendons))]
            style = {"names": self._tendons, "colors": colours, "widths": [1.5] * len(colours)}
            _send(rec, f"{root}/tension", self._time, self._tension[saccade], style)

    def _pairs(self) -> tuple[list[Plot], list[Plot]]:
        """Of antagonists: their motors and their tensions, each kind on one scale."""
        assert self._muscles is not None
        both = [[slug(self._muscles.names[i]) for i in pair] for pair in self._muscles.pairs.tolist()]
        known = [[f"motor/{name}" for name in names if f"motor/{name}" in self.own] for names in both]
        motors = [self._motor_plot(pair) for pair in known if pair]
        tensions = [self._plot(f"{', '.join(names)} [N]", [f"tension/{name}" for name in names]) for names in both]
        return _on_one_scale(motors), _on_one_scale(tensions)

    def _named(self, quantity: str) -> list[str]:
        return [name for name in self.own if name.startswith(f"{quantity}/")]

    def _moving_motors(self) -> list[str]:
        motors = self._named("motor")
        moving = [
            name
            for name in motors
            if _command_of(name) in self.told
            or (self._drawn and np.ptp(np.nan_to_num(self.own[name][self._drawn])) > 0)
        ]
        return moving or motors

    def _angle_plot(self, angles: Sequence[str]) -> Plot:
        """Of angles with their targets."""
        turns = [angle.removeprefix("angle/") for angle in angles]
        goals = [goal for goal in (f"angle/target_{turn}" for turn in turns) if goal in self.target]
        return self._plot(f"{', '.join(turns)} [deg]" + (", target grey" if goals else ""), [*angles, *goals])

    def _motor_plot(self, motors: Sequence[str]) -> Plot:
        """Of motors of one unit."""
        told = [command for command in map(_command_of, motors) if command in self.told]
        name = ", ".join(motor.removeprefix("motor/") for motor in motors) + f" [{self._units[motors[0]]}]"
        return self._plot(name + (", command grey" if told else ""), [*motors, *told])

    def _plot(self, name: str, series: Sequence[str]) -> Plot:
        sources = (self.own, self.told, self.target, self.reference)
        values = [np.nan_to_num(curves[each][self._drawn]) for curves in sources for each in series if each in curves]
        span = float(min(v.min(initial=0) for v in values)), float(max(v.max(initial=0) for v in values))
        several = sum(each in self.own for each in series) > 1
        return Plot(name, tuple(series), span, legend=len(series) if several else 0)


def _labelled(plot: Plot, row: int) -> Plot:
    """In a row, its curves called after what they show."""
    return replace(plot, row=row, labels=tuple(name.replace("_", " ") for name in map(_last, plot.series)))


def _last(path: str) -> str:
    quantity, what = path.split("/")
    return f"command {what}" if quantity == "command" else what


def _on_one_scale(plots: Sequence[Plot]) -> list[Plot]:
    spans = [plot.span for plot in plots]
    low, high = min((low for low, _ in spans), default=0.0), max((high for _, high in spans), default=0.0)
    return [replace(plot, span=(low, high)) for plot in plots]


def turned_hue(colour: Colour, place: int) -> Colour:
    """The colour of the first, second, third ... curve of a saccade in one plot: its hue turned around the circle."""
    hue, saturation, value = colorsys.rgb_to_hsv(*(part / 255 for part in colour))
    red, green, blue = (round(255 * part) for part in colorsys.hsv_to_rgb((hue + _TURN * place) % 1, saturation, value))
    return red, green, blue


def _command_of(motor: str) -> str:
    """Entity path of a motor's command."""
    return "command/" + motor.removeprefix("motor/")


def turned_by(orientation: Array) -> dict[str, Array]:
    """Yaw, pitch and torsion [deg], each (...), of orientations (..., 4), by name."""
    yaw, pitch, _ = rotations.to_euler(orientation)
    return {"yaw": yaw, "pitch": pitch, "torsion": listing.torsion(orientation)}


def _curves(trajectory: Trajectory, turns: Sequence[str]) -> dict[str, Array]:
    turned = turned_by(trajectory.orientation)
    curves = {f"angle/{turn}": turned[turn] for turn in turns}
    curves |= {f"velocity/{_TURNS[t]}": trajectory.angular_velocity[..., "xyz".index(_TURNS[t])] for t in turns}
    return curves | {f"motor/{slug(name)}": trajectory.motor[..., i] for i, name in enumerate(trajectory.motor_names)}


def _style(name: str, colour: Colour, width: float) -> dict[str, Any]:
    return {"names": [name.strip()], "colors": [colour], "widths": [width]}


def _send(rec: "rr.RecordingStream", path: str, time: Array, values: Array, style: dict[str, Any]) -> None:
    """A time series: values (time,) or (time, curves) at times [s]; a constant sends its ends."""
    import rerun as rr

    if time.size > 2 and (values == values[0]).all():
        time, values = time[[0, -1]], values[[0, -1]]
    rec.log(path, rr.SeriesLines(**style), static=True)
    columns = rr.Scalars.columns(scalars=values.ravel())
    if values.ndim > 1:
        columns = columns.partition([values.shape[1]] * len(values))
    rec.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time)], columns)
