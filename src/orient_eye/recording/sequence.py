"""Saccades one after the other on one timeline, as a Rerun recording."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.errors import InputError
from orient_eye.eyes.model import ball
from orient_eye.eyes.muscles import Muscles
from orient_eye.movement.trajectory import Trajectory
from orient_eye.recording import titles as naming
from orient_eye.recording.curves import Curves
from orient_eye.recording.layout import SaccadeTab, saccade_colours, sequence_blueprint
from orient_eye.recording.poses import pose, tendon_names
from orient_eye.recording.rotation_vectors import RotationVectors
from orient_eye.recording.scene import Scene
from orient_eye.recording.stream import check, draw_info, write

if TYPE_CHECKING:
    import rerun as rr

Array = NDArray[np.float64]
PAUSE_S = 0.2
"""How long the eye rests between two saccades: about as long as a person's."""
JOINED_DEG = 1.0
"""A saccade starts this close to the end of the one before, or it is not its next."""
_GAZE_COLOUR = (205, 210, 220)  # of the line of sight, beside the saccades' own


def record_sequence(
    path: str | Path,
    trajectory: Trajectory,
    *,
    model: mujoco.MjModel | None = None,
    target: Array | None = None,
    titles: Sequence[str] | None = None,
    pause_s: float = PAUSE_S,
    notes: str = "",
) -> Path:
    """Write a recording of saccades one after the other; an older file is replaced only by a whole one.

    One scene and one series of curves for all of them: the way of the gaze grows ahead of the eye, and each target
    appears when it becomes the one that is looked for.

    Args:
        path: the file, NAME.rrd.
        trajectory: the saccades in their order, of any plant, each from where the one before it ended
            (`State(orientation, motor)` of its last sample).
        model: the compiled eye to draw, as in `record`.
        target: orientations w, x, y, z, (saccades, 4), or None.
        titles: name of each saccade, (saccades,); None for its start and target, or its number.
        pause_s: from the last sample of a saccade to the first of the next, in which the eye rests where it is [s];
            to the nearest sample, and at least one.
        notes: Markdown for the panel "info".

    Returns:
        The path.

    Raises:
        InputError: lengths or names that do not fit the trajectory, saccades of one sample, one that failed or does
            not start where the one before it ended, a pause below 0, or a path that is not NAME.rrd.
    """
    path = Path(path)
    target = None if target is None else np.asarray(target, dtype=float)
    check(path, len(trajectory), target, titles=titles)
    sequence, starts = one_after_the_other(trajectory, pause_s)
    samples, lasts_s = sequence.time.size // len(trajectory), float(sequence.time[-1])
    names = naming.titles(trajectory, target) if titles is None else titles
    numbered = [f"{i + 1}: {name}" for i, name in enumerate(names)]
    colours = saccade_colours(numbered)
    tab = SaccadeTab(0, "/sequence", "sequence", "", colours[0])
    model = ball() if model is None else model
    poses, muscles = pose(model, sequence), Muscles.of(model)
    wanted = None if target is None else np.repeat(target, samples, axis=0)[None]
    curves = Curves(sequence, [0], poses.tension, tendon_names(model), target=wanted, muscles=muscles)
    scene = Scene(model, poses, [0], graticule=curves.graticule, muscles=muscles)
    vectors = RotationVectors(sequence.orientation[0]) if "torsion" in curves.turns else None
    plots = curves.plots()

    def draw(rec: "rr.RecordingStream") -> None:
        rec.send_blueprint(sequence_blueprint(tab, plots, scene, vectors, lasts_s=lasts_s), make_active=False)
        draw_info(rec, "\n".join([notes, "", *_info(trajectory, numbered, starts, target, curves, scene, vectors)]))
        scene.draw_head(rec)
        root, time, orientation = f"{tab.root}/scene", sequence.time, sequence.orientation[0]
        shades = np.repeat(np.array(colours, np.uint8), samples, axis=0)
        scene.draw_saccade(rec, root, 0, time, colour=_GAZE_COLOUR)
        scene.grow_trace(rec, root, orientation, time, shades)
        scene.draw_moment(rec, root, orientation, time)
        if target is not None:
            scene.draw_targets(rec, f"{root}/target", target, starts, colours)
        if vectors:
            vectors.draw_axes(rec, "/listing")
            vectors.grow_path(rec, f"{tab.root}/listing", orientation, time, shades)
            vectors.draw_moment(rec, f"{tab.root}/listing", orientation, time)
            vectors.grow_ends(
                rec, f"{tab.root}/listing", trajectory.orientation[:, -1], starts + trajectory.time[-1], colours
            )
        curves.draw(rec, tab.root, 0, title="", colour=tab.colour)

    return write(path, ("sequence", plots, lasts_s), draw)


def one_after_the_other(trajectory: Trajectory, pause_s: float) -> tuple[Trajectory, Array]:
    """Saccades as one, with a pause after each in which the eye rests.

    Returns:
        The one, and when each saccade starts in it [s], (saccades,).

    Raises:
        InputError: as `record_sequence`.
    """
    if not pause_s >= 0:
        raise InputError(f"a pause between saccades lasts 0 s or longer, got {pause_s:g}")
    if trajectory.time.size < 2:
        raise InputError("a sequence is made of saccades that last, these have one sample each")
    if trajectory.failed.any():
        failed = ", ".join(map(str, np.flatnonzero(trajectory.failed) + 1))
        raise InputError(
            f"saccade {failed} of the sequence failed, so nothing can follow it: leave it out, or see it with record()"
        )
    apart = rotations.angle_between(trajectory.orientation[:-1, -1], trajectory.orientation[1:, 0])
    if (apart > JOINED_DEG).any():
        i = int(np.argmax(apart > JOINED_DEG))
        raise InputError(
            f"saccade {i + 2} of the sequence starts {apart[i]:.1f} deg from where the one before it ended, "
            f"{JOINED_DEG:g} deg are allowed: start it there, State(orientation, motor) of that one's last sample"
        )
    time, step = trajectory.time, trajectory.time[1] - trajectory.time[0]
    rest = max(1, round(pause_s / step))
    starts = (time[-1] + rest * step) * np.arange(len(trajectory))
    within = np.concatenate([time, time[-1] + step * np.arange(1, rest)])
    rows = np.minimum(np.arange(within.size), time.size - 1)

    def flat(values: Array) -> Array:
        return values[:, rows].reshape(1, -1, *values.shape[2:])

    moving = (np.arange(within.size) < time.size)[:, None]
    joined: dict[str, Any] = {name: flat(getattr(trajectory, name)) for name in ("orientation", "command", "motor")}
    return replace(
        trajectory,
        time=(starts[:, None] + within).ravel(),
        angular_velocity=flat(trajectory.angular_velocity) * np.tile(moving, (len(trajectory), 1)),
        tension=None if trajectory.tension is None else flat(trajectory.tension),
        failed=np.zeros(1, bool),
        **joined,
    ), starts


def _info(
    trajectory: Trajectory,
    titles: Sequence[str],
    starts: Array,
    target: Array | None,
    curves: Curves,
    scene: Scene,
    vectors: RotationVectors | None,
) -> list[str]:
    """Lines of Markdown."""
    angles = ", ".join(curves.turns)
    lines = [
        "One saccade after the other on the timeline `sim_time`; between them the eye rests. The line from the pupil "
        "is the line of sight, the line that grows ahead the way of the gaze, the white dot where it is. Targets are "
        "numbered; the large dot is the one that is looked for. Positive yaw is to the left, positive pitch down (head "
        "frame: x forward, y left, z up).",
        "",
        *scene.text,
        *(vectors.text if vectors else []),
        f"| saccade | start [s] | target {angles} | final {angles} | peak speed |",
        "|---|---|---|---|---|",
    ]
    ends = trajectory.orientation[:, -1]
    for k, title in enumerate(titles):
        aim = "" if target is None else naming.attitude(target[k], curves.turns, 2)
        peak = np.linalg.norm(trajectory.angular_velocity[k], axis=-1).max()
        lines.append(
            f"| {title} | {starts[k]:.3f} | {aim} | {naming.attitude(ends[k], curves.turns, 2)} | {peak:.0f} °/s |"
        )
    return lines
