"""A batch of saccades as a Rerun recording (.rrd): the eye in 3-D beside its curves, without a screen.

    record("saccades.rrd", trajectory, target=rotations.from_yaw(yaw_deg))
    record_sequence("sequence.rrd", trajectory, target=target)   # one after the other on one timeline
    $ orient-eye view saccades.rrd

All saccades start at 0 on the one timeline `sim_time`; each is a branch of the entity tree and a tab of
the viewer. Everything is drawn from a compiled model, the plant's own. Numbers are the trajectory's own, one row a
sample (a constant has two). The durable record is the .npz: Rerun promises the format to its next
version only.

Entities of a saccade, below /saccades/GROUP/INDEX_TITLE, in deg, deg/s, N and the motors' units:
    angle/yaw, angle/pitch, angle/torsion       orientation; pitch and torsion where they move
    angle/target_yaw, ...                       of the target
    velocity/x, velocity/y, velocity/z          angular velocity, head frame; x and y where they move
    motor/NAME                                  motor positions
    command/NAME                                where motors were told to be, where they were elsewhere
    tension                                     of all tendons of the model
    tension/NAME                                instead, where they are muscles: antagonists with a motor each
    reference/...                               angle, velocity and motor of the reference
    scene/BODY, scene/tendons, scene/target     3-D, metres, head frame
    scene/muscles                               their names, where the tendons are muscles
    scene/trace, scene/start, scene/moment      way of the gaze ahead of the eye; where pitch or torsion move
    scene/reference_trace                       of the reference
    listing/path, listing/end, listing/moment   rotation vectors, 2 atan(r) [deg]; where torsion is shown

A sequence (`record_sequence`) is one such branch, /sequence, that lasts through all its saccades; its targets are
/sequence/scene/target/NUMBER.
"""

from collections.abc import Sequence, Sized
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.eyes.model import ball
from orient_eye.eyes.muscles import Muscles
from orient_eye.movement.trajectory import Trajectory
from orient_eye.recording import titles as naming
from orient_eye.recording.curves import Curves
from orient_eye.recording.layout import SaccadeTab, blueprint, saccade_colours
from orient_eye.recording.poses import pose, tendon_names
from orient_eye.recording.rotation_vectors import RotationVectors
from orient_eye.recording.scene import Scene, slug
from orient_eye.recording.sequence import record_sequence as record_sequence
from orient_eye.recording.stream import check, draw_info, write

if TYPE_CHECKING:
    import rerun as rr

Array = NDArray[np.float64]


def record(
    path: str | Path,
    trajectory: Trajectory,
    *,
    model: mujoco.MjModel | None = None,
    target: Array | None = None,
    titles: Sequence[str] | None = None,
    groups: Sequence[str] | None = None,
    reference: Trajectory | None = None,
    notes: str = "",
) -> Path:
    """Write a recording of a batch of saccades; an older file is replaced only by a whole one.

    Made for some tens of saccades: each is a tab. Failed saccades are left out, and the recording says so.

    Args:
        path: the file, NAME.rrd.
        trajectory: the saccades, of any plant. Motors of the model that it lacks stand at rest, and where it
            has no tension the tendons show that of their length.
        model: the compiled eye to draw, with its shapes: `plant.drawn()`; None for a ball without motors and tendons.
        target: orientations w, x, y, z, (saccades, 4); `rotations.from_yaw(yaw_deg)` for horizontal ones.
        titles: name of each saccade, (saccades,); None for its start and target, or its number. Saccades of the
            same title have the same colour.
        groups: name of each saccade's group, (saccades,), as the stages of a training; None for no groups.
        reference: another trajectory of the same saccades, drawn in grey beside them.
        notes: Markdown for the panel "info".

    Returns:
        The path.

    Raises:
        InputError: lengths or names that do not fit the trajectory, or a path that is not NAME.rrd.
    """
    path = Path(path)
    target = None if target is None else np.asarray(target, dtype=float)
    told: dict[str, Sized | None] = {"titles": titles, "groups": groups, "reference": reference}
    check(path, len(trajectory), target, **told)
    content = _Content(
        trajectory=trajectory,
        tabs=_tabs(naming.titles(trajectory, target) if titles is None else titles, groups),
        target=target,
        reference=reference,
        notes=notes,
    )
    return _write(path, content, ball() if model is None else model)


def _tabs(titles: Sequence[str], groups: Sequence[str] | None) -> list[SaccadeTab]:
    digits = len(str(len(titles)))
    groups = [""] * len(titles) if groups is None else groups
    saccades = []
    for i, colour in enumerate(saccade_colours(titles)):
        branch = ["/saccades", slug(groups[i]), f"{i:0{digits}}_{slug(titles[i])}"]
        saccades.append(SaccadeTab(i, "/".join(filter(None, branch)), titles[i], groups[i], colour))
    return saccades


@dataclass(frozen=True)
class _Content:
    """The arguments of `record`, checked and with their defaults."""

    trajectory: Trajectory
    tabs: list[SaccadeTab]
    target: Array | None
    reference: Trajectory | None
    notes: str


def _write(path: Path, content: _Content, model: mujoco.MjModel) -> Path:
    trajectory, target, reference = content.trajectory, content.target, content.reference
    shown = [tab for tab in content.tabs if not trajectory.failed[tab.index]]
    drawn = [tab.index for tab in shown]
    poses, muscles = pose(model, trajectory), Muscles.of(model)
    curves = Curves(
        trajectory, drawn, poses.tension, tendon_names(model), target=target, reference=reference, muscles=muscles
    )
    scene = Scene(model, poses, drawn, graticule=curves.graticule, muscles=muscles)
    vectors = RotationVectors(trajectory.orientation[drawn]) if "torsion" in curves.turns else None
    plots, compared = curves.plots(), curves.compared()
    lasts_s, several = float(trajectory.time[-1]), len(content.tabs) > 1

    def draw(rec: "rr.RecordingStream") -> None:
        rec.send_blueprint(blueprint(shown, plots, compared, scene, vectors, lasts_s=lasts_s), make_active=False)
        draw_info(rec, _info(content, curves, scene, vectors))
        scene.draw_head(rec)
        if vectors:
            vectors.draw_axes(rec, "/listing")
        for tab in shown:
            root, k = f"{tab.root}/scene", tab.index
            scene.draw_saccade(rec, root, k, trajectory.time, colour=tab.colour)
            if target is not None:
                scene.draw_target(rec, f"{root}/target", target[k], tab.colour)
            if reference is not None and not reference.failed[k]:
                scene.draw_reference(rec, f"{root}/reference", reference.orientation[k], reference.time)
            if scene.graticule.around_deg:
                scene.draw_trace(rec, root, trajectory.orientation[k], tab.colour, named=not several)
                scene.draw_moment(rec, root, trajectory.orientation[k], trajectory.time)
            if vectors:
                vectors.draw_path(rec, f"{tab.root}/listing", trajectory.orientation[k], trajectory.time, tab.colour)
            curves.draw(rec, tab.root, k, title=tab.title if several else "", colour=tab.colour)

    return write(path, (shown, plots, compared), draw)


def _info(content: _Content, curves: Curves, scene: Scene, vectors: RotationVectors | None) -> str:
    """The text of the panel "info", Markdown."""
    trajectory, target, angles = content.trajectory, content.target, ", ".join(curves.turns)
    net = scene.graticule.around_deg
    trace = (
        " The line on the net of directions is the way of the gaze, the ring its start, the white dot where it is."
        if net
        else ""
    )
    lines = [
        content.notes,
        "",
        "All saccades start at 0 on the timeline `sim_time`. Each has a tab; the time cursor stays when you change the "
        "tab. The line from the pupil is the line of sight, the dot ahead its target"
        + (", the grey line and the dark grey curves the reference. " if content.reference is not None else ". ")
        + "Positive yaw is to the left, positive pitch down (head frame: x forward, y left, z up)."
        + trace,
        "",
        *scene.text,
        *(vectors.text if vectors else []),
        f"| saccade | target {angles} | final {angles} | peak |",
        "|---|---|---|---|",
    ]
    for tab in content.tabs:
        k = tab.index
        aim = "" if target is None else naming.attitude(target[k], curves.turns, 2)
        ended = "**failed: the simulation diverged, nothing is drawn** | "
        if not trajectory.failed[k]:
            peak = np.linalg.norm(trajectory.angular_velocity[k], axis=-1).max()
            ended = f"{naming.attitude(trajectory.orientation[k, -1], curves.turns, 2)} | {peak:.0f} °/s"
        name = f"{tab.title}, {tab.group}" if tab.group else tab.title
        lines.append(f"| {name} | {aim} | {ended} |")
    return "\n".join(lines)
