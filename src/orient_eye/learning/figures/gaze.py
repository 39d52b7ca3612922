"""A policy of saccades in all directions: pictures of its gaze, of the two components, of torsion and of its motors."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.figures import gaze as of_any_saccades
from orient_eye.figures import tidy
from orient_eye.figures.gaze.human import draw_human
from orient_eye.figures.gaze.paths import draw_paths
from orient_eye.figures.gaze.style import HORIZONTAL, OBLIQUE, VERTICAL, axial, colours, end_ms, way
from orient_eye.learning.directions import angles_toward, opposite
from orient_eye.learning.evaluation import Yardstick
from orient_eye.learning.figures.saccades import BEST, LEARNED, Saccades, titled
from orient_eye.learning.policy import Policy
from orient_eye.listing import fit_plane, rotation_vectors
from orient_eye.movement.antagonists import antagonist_correlation
from orient_eye.movement.oblique import (
    end_of_shift,
    seen_from,
    shift_velocity,
    torsion_blip,
    toward,
    transient_torsion,
)
from orient_eye.plants.cables import muscles_of
from orient_eye.task.generator_actions import GeneratorActions
from orient_eye.task.saccade import SaccadeTask

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
_SPOKES, _FAR = 8, 0.7  # directions of the shown paths, and how far of the range they go
_OBLIQUE_DEG = np.array([[8.7, 5.0], [5.0, 8.7], [5.0, -8.7], [17.3, 10.0], [10.0, 17.3]])  # left, up
_MAIN_SEQUENCE_DEG = (1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 13.0, 16.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0)
_EVERY_DEG = 30.0  # directions of the main sequence
_MOTORS_DEG = 20.0
_BETWEEN = np.array([0, 1, 3])  # of the few: a horizontal, a vertical and an oblique saccade
_EVERY_SAMPLE = 5  # of those on the way that Listing's plane shows


def gaze_page(policy: Policy, yardstick: Yardstick) -> Figure:
    """One page: paths, components and main sequence of the gaze, Listing's plane, torsion, and the reward gap.

    Args:
        policy: that acts.
        yardstick: random saccades with their optimum.
    """
    task = yardstick.task
    made, best = _pairs(policy, yardstick)
    figure = Figure(figsize=(17, 11), layout="constrained")
    (paths, components, peak), (plane, torsion, gap) = figure.subplots(2, 3)
    shown = _shown(task, policy)
    draw_paths(paths, shown.trajectory, shown.of_gaze, shown.target)
    paths.set_title("paths of the gaze")
    _draw_components(components, Saccades.between(task, policy, _from_ahead(task, _OBLIQUE_DEG[[0, -1]])))
    _draw_main_sequence(peak, main_sequence_saccades(task, policy))
    _draw_plane(plane, made, best)
    _draw_torsion(torsion, made)
    _draw_gap(gap, policy, yardstick)
    return titled(figure, "Saccades in all directions", policy, task)


def gaze_pictures(policy: Policy, pairs: Yardstick) -> dict[str, Figure]:
    """Pictures by name; of an eye with a motor for each muscle also those of antagonists, and of the group's eye.

    Args:
        policy: that acts.
        pairs: random saccades with their optimum: Listing's plane, torsion and the gap are theirs.
    """
    task = pairs.task
    made, best = _pairs(policy, pairs)
    shown, oblique = _shown(task, policy), Saccades.between(task, policy, _from_ahead(task, _OBLIQUE_DEG))
    alone = [(part.trajectory, part.of_gaze) for part in oblique.components_alone(task, policy)]
    every, few = main_sequence_saccades(task, policy), _few(task, policy)
    gap = Figure(figsize=(7.5, 5), layout="constrained")
    _draw_gap(gap.subplots(), policy, pairs)
    muscles, of_muscles = muscles_of(task.plant), {}
    antagonists = None if muscles is None or few.trajectory.tension is None else muscles.pairs
    if antagonists is not None:
        between = few.trajectory[_BETWEEN], few.of_gaze[_BETWEEN]
        correlation = antagonist_correlation(made.trajectory, made.of_gaze, antagonists)
        error = rotations.angle_between_directions(rotations.gaze(made.of_gaze.final), rotations.gaze(made.target))
        of_muscles = {
            "muscles": of_any_saccades.antagonists_over_time(*between, antagonists, correlation),
            "main_sequence_beside_group": of_any_saccades.main_sequence_beside_group(
                (every.trajectory, every.of_gaze), (made.trajectory, made.of_gaze), error
            ),
        }
    return {
        "gaze_paths": of_any_saccades.gaze_paths(shown.trajectory, shown.of_gaze, shown.target),
        "components": of_any_saccades.component_velocities(oblique.trajectory, oblique.of_gaze, alone),
        "main_sequence": of_any_saccades.main_sequence(every.trajectory, every.of_gaze),
        "listing_plane": _listing_plane(made, best),
        "torsion": of_any_saccades.torsion_over_time(made.trajectory, made.of_gaze),
        "motors": of_any_saccades.motors_over_time(few.trajectory, few.of_gaze, antagonists),
        **of_muscles,
        "reward_gap": titled(gap, "Reward gap", policy, task),
    }


def _listing_plane(made: Saccades, best: Saccades) -> Figure:
    """Of ends and samples on the way; beside those of the optimum, and of the least force, where ends are free."""
    inside = made.trajectory.time <= made.of_gaze.settling_time_s[:, None]
    inside[:, np.arange(inside.shape[1]) % _EVERY_SAMPLE > 0] = False
    imposed = isinstance(made.task.actions, GeneratorActions)
    compared = {"searched optimum": best.of_gaze.final, "least force at the target": made.target}
    figure = of_any_saccades.listing_plane(
        made.of_gaze.final, made.trajectory.orientation[inside], None if imposed else compared
    )
    if imposed:
        figure.suptitle(f"{figure.get_suptitle()}\nimposed: all ends are where the statics hold the targets")
    return figure


def _pairs(policy: Policy, yardstick: Yardstick) -> tuple[Saccades, Saccades]:
    """The policy's saccades, and the searched best ones."""
    task, start, target = yardstick.task, yardstick.start, yardstick.target
    return Saccades.of(task, policy, start, target), Saccades(task.plain, start, target, yardstick.optimum.action)


def _from_ahead(task: SaccadeTask, shift: Array) -> tuple[Array, Array]:
    """Angles of saccades from straight ahead, so far to the left and up (n, 2); smaller ones where the range ends."""
    shift = shift * min(1.0, task.targets.limit_deg / np.linalg.norm(shift, axis=1).max())
    return angles_toward(task.targets, toward(0 * shift)), angles_toward(task.targets, toward(shift))


def _shown(task: SaccadeTask, policy: Policy) -> Saccades:
    """From straight ahead into all directions, and between the places where those end."""
    around = 2 * np.pi * np.arange(_SPOKES) / _SPOKES
    ring = _FAR * task.targets.limit_deg * np.stack([np.cos(around), np.sin(around)], axis=1)
    start, target = np.concatenate([0 * ring, ring]), np.concatenate([ring, np.roll(ring, _SPOKES // 2 - 1, axis=0)])
    angles = angles_toward(task.targets, toward(start)), angles_toward(task.targets, toward(target))
    return Saccades.between(task, policy, angles)


def main_sequence_saccades(task: SaccadeTask, policy: Policy) -> Saccades:
    """Of every size into all directions, around straight ahead."""
    limit = 2 * task.targets.limit_deg
    sizes = np.array([size for size in _MAIN_SEQUENCE_DEG if size <= limit])
    around, size = (grid.ravel() for grid in np.meshgrid(np.arange(0.0, 360.0, _EVERY_DEG), sizes))
    return Saccades.between(task, policy, opposite(task.targets, size, around))


def _few(task: SaccadeTask, policy: Policy) -> Saccades:
    """To the left, up, down, and obliquely."""
    around = np.deg2rad([0.0, 90.0, -90.0, 45.0])
    return Saccades.between(
        task, policy, _from_ahead(task, _MOTORS_DEG * np.stack([np.cos(around), np.sin(around)], axis=1))
    )


def _draw_components(axes: "Axes", made: Saccades) -> None:
    """Velocities of both components of a few saccades."""
    time, end = 1e3 * made.trajectory.time, end_of_shift(made.trajectory, made.of_gaze)
    for colour, velocity, to in zip(colours(len(end)), shift_velocity(made.trajectory), end, strict=True):
        axes.plot(time, velocity[:, 0], color=colour, label=way(to))
        axes.plot(time, velocity[:, 1], "--", color=colour)
    axes.axhline(0, color="black", lw=0.6)
    axes.set(
        xlabel="time [ms]", ylabel="velocity of the component [deg/s]", xlim=(0, end_ms(made.trajectory, made.of_gaze))
    )
    axes.set_title("components: horizontal, and dashed vertical")
    axes.legend(frameon=False, fontsize="small")
    tidy(axes)


def _directions(shift: Array) -> "list[tuple[str, dict[str, Any], NDArray[np.bool_]]]":
    """Name, style and which of saccades (n, 2), left and up, are horizontal, vertical, or neither."""
    horizontal, vertical = axial(shift)
    return [
        ("horizontal", {"color": HORIZONTAL, "marker": "o"}, horizontal),
        ("vertical", {"color": VERTICAL, "marker": "^"}, vertical),
        ("oblique", {"color": OBLIQUE, "marker": "x"}, ~(horizontal | vertical)),
    ]


def _draw_main_sequence(axes: "Axes", made: Saccades) -> None:
    """Peak velocity against amplitude, by direction, beside people."""
    amplitude, peak = made.of_gaze.amplitude_deg, made.of_gaze.peak_velocity_deg_s
    for name, style, some in _directions(end_of_shift(made.trajectory, made.of_gaze)):
        axes.plot(amplitude[some], peak[some], ls="", mfc="none", ms=5, label=name, **style)
    draw_human(axes, "peak_velocity", "peak_velocity_vertical")
    axes.set(xlabel="amplitude [deg]", ylabel="peak velocity of the gaze [deg/s]", title="main sequence")
    axes.set_xlim(0, 1.04 * np.nanmax(amplitude))
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False, fontsize="small")
    tidy(axes)


def _draw_plane(axes: "Axes", made: Saccades, best: Saccades) -> None:
    """How the plane of the orientations at rest is twisted: level for Listing, falling by 1 a degree for Fick."""
    largest = 0.0
    for name, ends, colour in (("searched optimum", best.of_gaze.final, BEST), ("policy", made.of_gaze.final, LEARNED)):
        x, y, z = rotation_vectors(ends).T
        plane, product = fit_plane(ends), np.rad2deg(2 * y * z)
        axes.plot(
            product, np.rad2deg(2 * np.arctan(x)), ".", color=colour, ms=7, label=f"{name}: sd {plane.sd_deg:.2f} deg"
        )
        largest = float(np.nanmax(np.abs(product), initial=largest))
        across = np.array([-largest, largest])
        offset = np.rad2deg(2 * np.arctan(plane.offset))
        axes.plot(across, offset + plane.twist * across, color=colour, lw=1, label=f"twist {plane.twist:.2f}")
    axes.plot(across, 0 * across, "k:", lw=1, label="Listing")
    axes.plot(across, -across, "k--", lw=1, label="Fick")
    axes.set(xlabel=r"2 $r_y r_z$ [deg]", ylabel="torsion [deg]", title="Listing's plane of the ends, and its twist")
    axes.legend(frameon=False, fontsize="small")
    tidy(axes)


def _draw_torsion(axes: "Axes", made: Saccades) -> None:
    """Torsion beside the way from start to end, of all saccades."""
    time = 1e3 * made.trajectory.time
    for colour, values in zip(colours(len(made.target)), transient_torsion(made.trajectory, made.of_gaze), strict=True):
        axes.plot(time, values, color=colour, lw=1)
    blip = torsion_blip(made.trajectory, made.of_gaze)
    axes.axhline(0, color="black", lw=0.6)
    axes.set(
        xlabel="time [ms]",
        ylabel="torsion beside the straight way [deg]",
        xlim=(0, end_ms(made.trajectory, made.of_gaze)),
    )
    axes.set_title(f"torsion: blips of {np.nanmedian(blip):.2f} deg in the median, {np.nanmax(blip):.2f} at most")
    tidy(axes)


def _draw_gap(axes: "Axes", policy: Policy, yardstick: Yardstick) -> None:
    """Reward gap against size, by direction."""
    gap, begin = 100 * yardstick.perform(policy.act)[2], rotations.gaze(yardstick.start.orientation)
    for name, style, some in _directions(seen_from(rotations.gaze(yardstick.target), begin)):
        axes.plot(yardstick.size_deg[some], gap[some], ls="", mfc="none", ms=6, label=name, **style)
    axes.axhline(0, color="black", lw=0.6)
    axes.set(xlabel="amplitude [deg]", ylabel="reward gap to the searched optimum [%]")
    axes.set_title(f"reward gap: mean {gap.mean():.2f} %, 95th percentile {np.quantile(gap, 0.95):.2f} %")
    axes.set_xlim(0, 2 * yardstick.task.targets.limit_deg)
    axes.legend(frameon=False, fontsize="small")
    tidy(axes)
