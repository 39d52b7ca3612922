"""The saccades that pictures show, and how pictures draw them alike."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.cached import cached_property
from orient_eye.figures import DATA, MODEL, OTHER, tidy
from orient_eye.figures.gaze.style import end_ms
from orient_eye.learning.directions import angles_toward, size_deg
from orient_eye.learning.policy import Policy
from orient_eye.movement.measures import Measures
from orient_eye.movement.oblique import seen_from, toward
from orient_eye.movement.trajectory import Trajectory
from orient_eye.movement.velocity_threshold import speed_of
from orient_eye.state import State
from orient_eye.task.saccade import Outcome, SaccadeTask
from orient_eye.task.targets import saccades
from orient_eye.words import plant_in_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
LEARNED, BEST, THIRD, HUMAN = DATA, MODEL, OTHER, "#8a8a8a"
SHOWN_DEG = np.array([2, 5, 10, 15, 20, 25, 30, 40, 50, 60], float)
SIZES_DEG = np.arange(1.0, 69.0)
_STARTS = 8  # starting points in each direction


@dataclass(frozen=True)
class Saccades:
    """Saccades of a policy.

    Attributes:
        task: on which they are made, its actions told without regard to the saccade.
        start: of the eyes.
        target: desired orientations, (saccades, 4).
        action: of the policy, in units, (saccades, numbers).
    """

    task: SaccadeTask
    start: State
    target: Array
    action: Array

    @classmethod
    def of(cls, task: SaccadeTask, policy: Policy, start: State, target: Array) -> "Saccades":
        """From starts to target orientations (saccades, 4)."""
        action = task.actions.as_plain(start, target, policy.act(start.orientation, target))
        return cls(task.plain, start, target, action)

    @classmethod
    def between(cls, task: SaccadeTask, policy: Policy, angles: tuple[Array, Array]) -> "Saccades":
        """Between directions told by the angles of the task's targets, each (saccades, angles)."""
        return cls.of(task, policy, *saccades(task.targets, *angles))

    @classmethod
    def symmetric(cls, task: SaccadeTask, policy: Policy, size_deg: Array) -> "Saccades":
        """Around straight ahead."""
        return cls.between(task, policy, task.targets.symmetric(size_deg))

    @classmethod
    def every_size(cls, task: SaccadeTask, policy: Policy) -> "Saccades":
        """Of every size, from starting points all over the range, both ways."""
        return cls.between(task, policy, task.targets.of_sizes(SIZES_DEG, _STARTS))

    def components_alone(self, task: SaccadeTask, policy: Policy) -> tuple["Saccades", "Saccades"]:
        """A policy's saccades along the horizontal part of their ways alone, and along the vertical part."""
        begin = rotations.gaze(self.start.orientation)
        way = seen_from(rotations.gaze(self.target), begin)

        def along(part: Array) -> "Saccades":
            target = task.targets.orientation(angles_toward(task.targets, toward(way * part, begin)))
            return Saccades.of(task, policy, self.start, target)

        return along(np.array([1.0, 0.0])), along(np.array([0.0, 1.0]))

    @cached_property
    def size_deg(self) -> Array:
        """Angle from start to target, or where saccades go in all directions that of their gaze, (saccades,)."""
        return size_deg(self.task, self.start.orientation, self.target).round(6)

    @cached_property
    def outcome(self) -> Outcome:
        """What comes of them."""
        return self.task.perform(self.start, self.action, self.target)

    @cached_property
    def trajectory(self) -> Trajectory:
        """The movements over time."""
        return self.outcome.movement.trajectory()

    @cached_property
    def of_gaze(self) -> Measures:
        """Measures of their gaze."""
        return self.outcome.movement.measure(self.task.band, "gaze")


def turned(trajectory: Trajectory) -> Array:
    """Angle [deg] from where the eye started, (saccades, time)."""
    return rotations.angle_between(trajectory.orientation, trajectory.orientation[:, :1])


def speed(trajectory: Trajectory) -> Array:
    """Angular speed [deg/s], (saccades, time)."""
    return speed_of(trajectory)


def size_axis(axes: "Axes", task: SaccadeTask) -> None:
    """From 0 to the largest saccade there is."""
    axes.set(xlabel="saccade size [deg]", xlim=(0, 2 * task.targets.limit_deg))


def mean_and_range(axes: "Axes", size: Array, values: Array, colour: str, label: str) -> None:
    """Mean over starting points as a line, their range as a shade."""
    sizes = np.unique(size)
    groups = [values[size == one] for one in sizes]
    low, mean, high = np.array([(np.nanmin(g), np.nanmean(g), np.nanmax(g)) for g in groups]).T
    axes.fill_between(sizes, low, high, color=colour, alpha=0.2, lw=0, label=f"{label}, over all starting points")
    axes.plot(sizes, mean, color=colour, lw=1.8, label=f"{label}, mean")


def beside(figure: Figure, handles: Sequence[Any], labels: Sequence[str]) -> None:
    """A legend below all panels, where it covers no data."""
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False, fontsize="small")


def until_ms(shown: Saccades) -> float:
    """Until when pictures over time go [ms]: to the thesis' 300, or a little beyond the last settling time."""
    return max(300.0, end_ms(shown.trajectory, shown.outcome.measures))


def draw_turned(axes: "Axes", shown: Saccades) -> None:
    """Progress of each saccade."""
    curves = zip(turned(shown.trajectory), shown.size_deg, colours(len(shown.target)), strict=True)
    for angle, size, colour in curves:
        axes.plot(1e3 * shown.trajectory.time, angle, color=colour, label=f"{size:g} deg")
    axes.set(xlabel="time [ms]", ylabel="angle turned [deg]", xlim=(0, until_ms(shown)))
    axes.set_ylim(bottom=0)
    tidy(axes)


def draw_speed(axes: "Axes", shown: Saccades) -> None:
    """Speed of each saccade, with a legend."""
    curves = zip(speed(shown.trajectory), shown.size_deg, colours(len(shown.target)), strict=True)
    for values, size, colour in curves:
        axes.plot(1e3 * shown.trajectory.time, values, color=colour, label=f"{size:g} deg")
    axes.set(xlabel="time [ms]", ylabel="angular speed [deg/s]", xlim=(0, until_ms(shown)))
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False, fontsize="small", ncols=2)
    tidy(axes)


def titled(figure: Figure, title: str, policy: Policy, task: SaccadeTask) -> Figure:
    """With a title that says which policy on which plant."""
    case = policy.manifest.get("case")
    words = f"case {case} on " if case else ""
    figure.suptitle(f"{title}: {words}{plant_in_words(task.plant.identity())}")
    return figure


def colours(count: int) -> list[tuple[float, float, float, float]]:
    """One for each of some curves, in order."""
    return [colormaps["viridis"](x) for x in np.linspace(0.05, 0.9, count)]
