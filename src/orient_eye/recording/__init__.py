"""A batch of saccades as a Rerun recording (.rrd): the eye in 3-D beside its curves, without a screen.

    record("saccades.rrd", trajectory, target=rotations.from_yaw(yaw_deg))
    $ orient-eye view saccades.rrd

All saccades start at 0 on the one timeline `sim_time`; each is a branch of the entity tree and a tab of
the viewer. Everything is drawn from a compiled model, the plant's own. Numbers are the trajectory's own, one row a
sample (a constant has two). The durable record is the .npz: Rerun promises the format to its next
version only.

Entities of a saccade, below /saccades/GROUP/INDEX_TITLE, in deg, deg/s, N and the motors' units:
    angle/yaw, angle/pitch, angle/roll          orientation; pitch and roll where they move
    angle/target_yaw, ...                       of the target
    velocity/x, velocity/y, velocity/z          angular velocity, head frame; x and y where they move
    motor/NAME                                  motor positions
    command/NAME                                where motors were told to be, where they were elsewhere
    tension                                     of all tendons of the model
    reference/...                               angle, velocity and motor of the reference
    scene/BODY, scene/tendons, scene/target     3-D, metres, head frame
"""

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.errors import InputError
from orient_eye.eyes.model import ball
from orient_eye.files import write_atomically
from orient_eye.movement.trajectory import Trajectory
from orient_eye.recording.curves import STILL_DEG, Curves
from orient_eye.recording.layout import SaccadeTab, blueprint, saccade_colours
from orient_eye.recording.poses import pose, tendon_names
from orient_eye.recording.scene import Scene, slug

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
        trajectory: the saccades, of any plant. Motors of the model that it lacks stand at 0, and where it
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
    if path.suffix != ".rrd":
        raise InputError(f"a recording is a file NAME.rrd, got {path.name!r}: write {path.stem}.rrd")
    if not len(trajectory):
        raise InputError("a recording needs at least one saccade, the trajectory has none")
    if target is not None:
        target = np.asarray(target, dtype=float)
        if target.shape != (len(trajectory), 4):
            raise InputError(
                f"{len(trajectory)} saccades need targets of shape ({len(trajectory)}, 4), quaternions, got "
                f"{target.shape}; rotations.from_yaw(yaw_deg) makes them"
            )
    for what, given in (("titles", titles), ("groups", groups), ("reference", reference)):
        if given is not None and len(given) != len(trajectory):
            raise InputError(f"{what}: one for each of the {len(trajectory)} saccades, got {len(given)}")
    titles = _titles(trajectory, target) if titles is None else titles
    content = _Content(
        trajectory=trajectory,
        model=ball() if model is None else model,
        tabs=_tabs(titles, groups),
        target=target,
        reference=reference,
        notes=notes,
    )
    return write_atomically(path, lambda file: _write(file, path.stem, content))


def _titles(trajectory: Trajectory, target: Array | None) -> list[str]:
    """Where each saccade goes, and whence if not from straight ahead; its number where there is no target."""
    if target is None:
        return [f"saccade {i}" for i in range(len(trajectory))]
    start = np.nan_to_num(trajectory.orientation[:, 0])
    pitch = any(abs(rotations.to_euler(q)[1]).max() > STILL_DEG for q in (start, target))
    titles = [_direction(q, pitch) for q in target]
    if rotations.angle_between(start, rotations.FORWARD)[~trajectory.failed].max(initial=0) > STILL_DEG:
        titles = [f"{_direction(q, pitch)} → {title}" for q, title in zip(start, titles, strict=True)]
    return titles


def _direction(orientation: Array, pitch: bool, decimals: int = 1) -> str:
    """Yaw, and pitch too, as text."""
    angles = rotations.to_euler(orientation)[: 2 if pitch else 1]
    return ", ".join(f"{angle:+.{decimals}f}".removesuffix(".0") + "°" for angle in angles)


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
    model: mujoco.MjModel
    tabs: list[SaccadeTab]
    target: Array | None
    reference: Trajectory | None
    notes: str


def _write(file: Path, name: str, content: _Content) -> None:
    import rerun as rr

    trajectory, target, reference = content.trajectory, content.target, content.reference
    shown = [tab for tab in content.tabs if not trajectory.failed[tab.index]]
    drawn = [tab.index for tab in shown]
    poses = pose(content.model, trajectory)
    tendons = tendon_names(content.model)
    curves = Curves(trajectory, drawn, poses.tension, tendons, target=target, reference=reference)
    span_deg = max(curves.largest_deg["yaw"], 30), curves.largest_deg["pitch"]
    scene = Scene(content.model, poses, drawn, span_deg=span_deg)
    plots, compared = curves.plots(), curves.compared()
    # The viewer keeps what a person changed in the layout of an application: one application for each layout.
    application = f"orient-eye-{zlib.crc32(repr((shown, plots, compared)).encode()):08x}"
    strict = rr.strict_mode()
    rr.set_strict_mode(True)
    try:
        with rr.RecordingStream(application) as rec:
            stream = rr.binary_stream(rec)  # to memory: of a file on a full disk the SDK says nothing, or waits
            rec.send_blueprint(blueprint(shown, plots, compared, scene), make_active=False)
            rec.send_recording_name(name)
            text = _info(content, pitch=curves.largest_deg["pitch"] > 0, tension_top=scene.tension_top)
            rec.log("/info", rr.TextDocument(text, media_type="text/markdown"), static=True)
            scene.draw_head(rec)
            for tab in shown:
                path, k = f"{tab.root}/scene", tab.index
                scene.draw_saccade(rec, path, k, trajectory.time, colour=tab.colour)
                if target is not None:
                    scene.draw_target(rec, f"{path}/target", target[k], tab.colour)
                if reference is not None and not reference.failed[k]:
                    scene.draw_reference(rec, f"{path}/reference", reference.orientation[k], reference.time)
                curves.draw(rec, tab.root, k, title=tab.title, colour=tab.colour)
            rec.disconnect()  # writes the end, without which the recording is not whole
            recording = stream.read()
            if recording is None:
                raise RuntimeError("the Rerun SDK returned no recording")
            file.write_bytes(recording)
    finally:
        rr.set_strict_mode(strict)


def _info(content: _Content, *, pitch: bool, tension_top: float) -> str:
    """The text of the panel "info", Markdown."""
    trajectory, target = content.trajectory, content.target
    angles = "yaw, pitch" if pitch else "yaw"
    scale = f"Tendons: green when slack, else from blue over magenta and orange to yellow at {tension_top:.3g} N."
    tendons = [scale, ""] if content.model.ntendon else []
    lines = [
        content.notes,
        "",
        "All saccades start at 0 on the timeline `sim_time`. Each has a tab; the time cursor stays when you change the "
        "tab. The line from the pupil is the line of sight, the dot ahead its target"
        + (", the grey line and the dark grey curves the reference. " if content.reference is not None else ". ")
        + "Positive yaw is to the left, positive pitch down (head frame: x forward, y left, z up).",
        "",
        *tendons,
        f"| saccade | group | target {angles} | final {angles} | peak speed |",
        "|---|---|---|---|---|",
    ]
    for tab in content.tabs:
        k = tab.index
        aim = "" if target is None else _direction(target[k], pitch, 2)
        ended = "**failed: the simulation diverged, nothing is drawn** | "
        if not trajectory.failed[k]:
            peak = np.linalg.norm(trajectory.angular_velocity[k], axis=-1).max()
            ended = f"{_direction(trajectory.orientation[k, -1], pitch, 2)} | {peak:.0f} °/s"
        lines.append(f"| {tab.title} | {tab.group} | {aim} | {ended} |")
    return "\n".join(lines)
