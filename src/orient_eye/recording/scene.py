"""The eye in 3-D for a recording: bodies, tendons, line of sight, all read from the compiled model.

    scene = Scene(model, pose(model, trajectory), drawn=[0, 1, 2])
    scene.draw_head(rec); scene.draw_saccade(rec, "/saccades/0/scene", 0, time, colour=(90, 140, 255))

Nothing here knows how many motors, tendons or bodies there are: another eye draws itself.
"""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye import rotations
from orient_eye.eyes.muscles import Muscles
from orient_eye.recording.directions import Graticule, ring
from orient_eye.recording.geometry import geometry
from orient_eye.recording.poses import Poses

if TYPE_CHECKING:
    import rerun as rr

Array = NDArray[np.float64]
Colour = tuple[int, int, int]
TIMELINE = "sim_time"
SLACK_COLOUR = (70, 205, 130)
"""Of a tendon that does not pull."""
TENSION_COLOURS = ((60, 110, 250), (190, 70, 210), (255, 110, 70), (255, 235, 90))
"""Of a tendon that pulls, from just taut to the top of the scale, straight lines between."""
REFERENCE_COLOUR = (120, 120, 128)
MOMENT_COLOUR = (255, 255, 255)
"""Of a dot that stands where the eye is at the moment."""
_GRATICULE_COLOUR = (150, 150, 155)
_ROWS = 500  # of a chunk of line strips: `rerun rrd verify` takes time by its square
_DOT, _TRACE = 0.024, 0.004  # radii of a target and of the gaze's trace, of the line of sight's length
_REACH = 4.5  # the line of sight is this many eye radii long
_CAMERA = np.array([0.62, 0.67, 0.41])  # ahead, to the left and above: iris and arms are seen


def tension_colours(tension: ArrayLike, top: float) -> NDArray[np.uint8]:
    """Colours (..., 3) of tensions [N] (...): a scale from 0 to top, slack tendons green."""
    share = np.clip(np.asarray(tension) / top, 0, 1)
    anchors = np.linspace(0, 1, len(TENSION_COLOURS))
    colour = np.stack([np.interp(share, anchors, channel) for channel in zip(*TENSION_COLOURS, strict=True)], axis=-1)
    return np.where(share[..., None] > 0, colour, SLACK_COLOUR).astype(np.uint8)


def slug(name: str) -> str:
    """The name as a part of an entity path that needs no escapes."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name.replace("°", "deg").replace("%", "percent")).strip("_")


class Scene:
    """Draws a batch of saccades into a recording.

    Bodies that stand still in all of them are drawn once, under /head; the others in each saccade.

    Args:
        model: the compiled eye.
        poses: of the batch.
        drawn: the saccades that will be drawn.
        graticule: the lines ahead of the eye by which its gaze is read.
        muscles: what the tendons are, to write their names to them; None for tendons without names.

    Attributes:
        reach: length of the line of sight, from the centre of the eye [m].
        gaze: entity path of the line of sight below a saccade's.
        tension_top: of the colour scale [N].
        camera, middle: where to look from and to [m], head coordinates.
        behind, ahead: the same, to see the whole net as the eye itself does.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        poses: Poses,
        drawn: list[int],
        *,
        graticule: Graticule,
        muscles: Muscles | None = None,
    ) -> None:
        self.model, self.poses, self.graticule, self.muscles = model, poses, graticule, muscles
        sites = [model.site(i).name for i in range(model.nsite)]
        self._shapes = [geometry(model, body) for body in range(model.nbody)]
        self.gaze_start = model.site("gaze").pos.copy() if "gaze" in sites else np.zeros(3)
        eye = int(model.jnt_bodyid[model.joint("eye").id])
        largest = float(model.geom_rbound[model.geom_bodyid == eye].max(initial=0.01))
        self.reach = _REACH * (float(np.linalg.norm(self.gaze_start)) or largest)
        stands = np.concatenate([poses.position, poses.orientation], axis=-1)
        self._still = stands[drawn[0] if drawn else 0, 0]
        self._moving = (abs(stands[drawn] - self._still) > 1e-9).any(axis=(0, 1, 3))
        self._moving[eye] = True
        self.gaze = f"{self._name(eye)}/gaze"
        strongest = float(poses.tension[drawn].max(initial=0))
        self.tension_top = float(np.ceil(strongest)) if strongest > 1 else max(strongest, 1e-3)
        self.middle = self._still[eye, :3] + 0.2 * (model.stat.center - self._still[eye, :3])
        away, around = model.stat.extent + 0.7 * self.reach, np.deg2rad(graticule.around_deg)
        if around:  # the net reaches further ahead, and the view shares its place with that of the gaze
            self.middle = self.middle + 0.15 * self.reach * np.eye(3)[0]
            away = max(0.85 * away, 3.6 * np.sin(around) * self.reach)
        self.camera = self.middle + away * _CAMERA
        self.behind, self.ahead = self.reach * np.array([[np.cos(around) - 2.8 * np.sin(around), 0, 0], [1, 0, 0]])

    @property
    def text(self) -> list[str]:
        """What the colours say, lines of Markdown."""
        scale = (
            f"Tendons: green when slack, else from blue over magenta and orange to yellow at {self.tension_top:.3g} N."
        )
        return [scale, ""] if self.model.ntendon else []

    def _name(self, body: int) -> str:
        return slug(self.model.body(body).name) or f"body{body}"

    def draw_head(self, rec: "rr.RecordingStream") -> None:
        """What all saccades have in common, under /head."""
        import rerun as rr

        rec.log("/", rr.ViewCoordinates.FLU, static=True)
        for body in (~self._moving).nonzero()[0].tolist():
            path, stands = f"/head/{self._name(body)}", self._still[body]
            if self._draw_body(rec, path, body):
                turned = np.roll(stands[3:], -1)
                rec.log(path, rr.Transform3D(translation=stands[:3], quaternion=turned), static=True)
        lines, thin, path = self.graticule, 0.0015 * self.reach, f"/head/{self.graticule.name}"
        strips = [self.reach * strip for strip in lines.strips]
        rec.log(path, rr.LineStrips3D(strips, colors=_GRATICULE_COLOUR, radii=thin), static=True)
        marks = rr.Points3D(
            self.reach * lines.marks, labels=lines.labels, show_labels=True, radii=thin, colors=_GRATICULE_COLOUR
        )
        rec.log(f"{path}/degrees", marks, static=True)

    def draw_saccade(self, rec: "rr.RecordingStream", path: str, saccade: int, time: Array, *, colour: Colour) -> None:
        """Moving bodies, tendons and the line of sight of a saccade, (time,) [s], below an entity path."""
        import rerun as rr

        when = [rr.TimeColumn(TIMELINE, duration=time)]
        for body in self._moving.nonzero()[0].tolist():
            self._draw_body(rec, f"{path}/{self._name(body)}", body)
            turned = np.roll(self.poses.orientation[saccade, :, body], -1, axis=-1)
            stands = rr.Transform3D.columns(translation=self.poses.position[saccade, :, body], quaternion=turned)
            rec.send_columns(f"{path}/{self._name(body)}", when, stands)
        self._draw_gaze(rec, f"{path}/{self.gaze}", colour)
        self._draw_tendons(rec, f"{path}/tendons", saccade, time)
        if self.muscles:
            self._draw_names(rec, f"{path}/muscles", saccade, time, self.muscles.names)

    def draw_reference(self, rec: "rr.RecordingStream", path: str, orientation: Array, time: Array) -> None:
        """The line of sight of another trajectory in grey, and its way; orientation (time, 4), time (time,) [s]."""
        import rerun as rr

        turned = rr.Transform3D.columns(quaternion=np.roll(orientation, -1, axis=-1))
        rec.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time)], turned)
        self._draw_gaze(rec, f"{path}/gaze", REFERENCE_COLOUR)
        if self.graticule.around_deg:
            rec.log(f"{path}_trace", self._trace(orientation, REFERENCE_COLOUR), static=True)

    def draw_target(self, rec: "rr.RecordingStream", path: str, orientation: Array, colour: Colour) -> None:
        """A point where the line of sight of an orientation (4,) ends."""
        import rerun as rr

        point = self.reach * rotations.gaze(orientation)
        rec.log(path, rr.Points3D([point], radii=_DOT * self.reach, colors=[colour]), static=True)

    def draw_targets(
        self, rec: "rr.RecordingStream", path: str, orientation: Array, since: Array, colours: Sequence[Colour]
    ) -> None:
        """Numbered targets (saccades, 4), each from its moment [s] on; smaller once it is no more the one."""
        import rerun as rr

        for i, (point, colour) in enumerate(zip(self.reach * rotations.gaze(orientation), colours, strict=True)):
            when, radii = since[i : i + 2], np.array([1.0, 0.5])[: since.size - i] * _DOT * self.reach
            style = rr.Points3D.from_fields(colors=[colour], labels=[f"{i + 1}"], show_labels=True)
            rec.log(f"{path}/{i + 1}", style, static=True)
            dots = rr.Points3D.columns(positions=np.repeat(point[None], when.size, axis=0), radii=radii)
            rec.send_columns(f"{path}/{i + 1}", [rr.TimeColumn(TIMELINE, duration=when)], dots)

    def draw_moment(self, rec: "rr.RecordingStream", path: str, orientation: Array, time: Array) -> None:
        """A dot where the line of sight ends, orientation (time, 4) at times [s]."""
        import rerun as rr

        style = rr.Points3D.from_fields(colors=[MOMENT_COLOUR], radii=[0.5 * _DOT * self.reach])
        rec.log(f"{path}/moment", style, static=True)
        dots = rr.Points3D.columns(positions=self.reach * rotations.gaze(orientation))
        rec.send_columns(f"{path}/moment", [rr.TimeColumn(TIMELINE, duration=time)], dots)

    def draw_trace(
        self, rec: "rr.RecordingStream", path: str, orientation: Array, colour: Colour, *, named: bool
    ) -> None:
        """The way of the line of sight's end, orientation (time, 4), and a ring where it starts, which may say so."""
        import rerun as rr

        rec.log(f"{path}/trace", self._trace(orientation, colour), static=True)
        start = self.reach * ring(orientation[0])
        thin = 0.6 * _TRACE * self.reach
        drawn = rr.LineStrips3D([start], colors=[colour], radii=thin, labels=["start"], show_labels=named)
        rec.log(f"{path}/start", drawn, static=True)

    def _trace(self, orientation: Array, colour: Colour) -> "rr.LineStrips3D":
        import rerun as rr

        trace = self.reach * rotations.gaze(orientation)
        return rr.LineStrips3D([trace], colors=[colour], radii=_TRACE * self.reach)

    def grow_trace(
        self, rec: "rr.RecordingStream", path: str, orientation: Array, time: Array, colours: NDArray[np.uint8]
    ) -> None:
        """The same trace as one that grows with time [s], in colours (time, 3)."""
        grow(rec, f"{path}/trace", self.reach * rotations.gaze(orientation), time, colours, radii=_TRACE * self.reach)

    def _draw_tendons(self, rec: "rr.RecordingStream", path: str, saccade: int, time: Array) -> None:
        import rerun as rr

        if not self.model.ntendon:
            return
        width = float(self.model.tendon_width.max())
        rec.log(path, rr.LineStrips3D.from_fields(radii=[width]), static=True)
        for start in range(0, time.size, _ROWS):
            rows = slice(start, min(start + _ROWS, time.size))
            strips, tendon, counts = self.poses.strips(saccade, rows)
            row = start + np.repeat(np.arange(len(counts)), counts)
            colours = tension_colours(self.poses.tension[saccade, row, tendon], self.tension_top)
            columns = rr.LineStrips3D.columns(strips=strips, colors=colours).partition(counts)
            rec.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time[rows])], columns)

    def _draw_names(
        self, rec: "rr.RecordingStream", path: str, saccade: int, time: Array, names: Sequence[str]
    ) -> None:
        """Names of the tendons (tendons,), each in the middle of its last piece."""
        import rerun as rr

        thin = float(self.model.tendon_width.max())
        style = rr.Points3D.from_fields(labels=names, show_labels=True, radii=[thin], colors=[MOMENT_COLOUR])
        rec.log(path, style, static=True)
        columns = rr.Points3D.columns(positions=self.poses.middle(saccade).reshape(-1, 3))
        rec.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time)], columns.partition([len(names)] * len(time)))

    def _draw_body(self, rec: "rr.RecordingStream", path: str, body: int) -> bool:
        """Whether there is anything to draw."""
        for name, shape in self._shapes[body].items():
            rec.log(f"{path}/{slug(name)}", shape, static=True)
        return bool(self._shapes[body])

    def _draw_gaze(self, rec: "rr.RecordingStream", path: str, colour: Colour) -> None:
        import rerun as rr

        end = self.gaze_start * [0, 1, 1]
        end[0] = np.sqrt(self.reach**2 - end @ end)
        rec.log(
            path, rr.LineStrips3D([[self.gaze_start, end]], colors=[colour], radii=0.0035 * self.reach), static=True
        )


def grow(
    rec: "rr.RecordingStream", path: str, points: Array, time: Array, colours: NDArray[np.uint8], *, radii: ArrayLike
) -> None:
    """A line through points (time, 3) in colours (time, 3), each sample's piece a row at its time [s].

    It grows in a view of all rows up to the moment. Where nothing moved there is no row.
    """
    import rerun as rr

    rec.log(path, rr.LineStrips3D.from_fields(radii=radii), static=True)
    pieces = np.stack([points[:-1], points[1:]], axis=1)
    moved = np.flatnonzero((pieces[:, 0] != pieces[:, 1]).any(axis=1))
    for rows in np.split(moved, range(_ROWS, moved.size, _ROWS)):
        columns = rr.LineStrips3D.columns(strips=list(pieces[rows]), colors=colours[rows + 1])
        rec.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time[rows + 1])], columns)
