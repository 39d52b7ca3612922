"""The eye in 3-D for a recording: bodies, tendons, line of sight, all read from the compiled model.

    scene = Scene(model, pose(model, trajectory), drawn=[0, 1, 2])
    scene.draw_head(rec); scene.draw_saccade(rec, "/saccades/0/scene", 0, time, colour=(90, 140, 255))

Nothing here knows how many motors, tendons or bodies there are: another eye draws itself.
"""

import re
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from orient_eye.recording.geometry import geometry
from orient_eye.recording.poses import Poses
from orient_eye.rotations import rotation

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
_PROTRACTOR_COLOUR = (150, 150, 155)
_ROWS = 500  # of a chunk of line strips: `rerun rrd verify` takes time by its square
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
        span_deg: how far the protractor ahead of the eye reaches, horizontally and vertically [deg].

    Attributes:
        reach: length of the line of sight, from the centre of the eye [m].
        gaze: entity path of the line of sight below a saccade's.
        tension_top: of the colour scale [N].
        camera, middle: where to look from and to [m], head coordinates.
    """

    def __init__(
        self, model: mujoco.MjModel, poses: Poses, drawn: list[int], *, span_deg: tuple[float, float] = (30, 0)
    ) -> None:
        self.model, self.poses, self.span_deg = model, poses, span_deg
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
        self.camera = self.middle + (model.stat.extent + 0.7 * self.reach) * _CAMERA

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
        strips, marks, labels = _protractor(self.reach, *self.span_deg)
        thin = 0.0015 * self.reach
        rec.log("/head/protractor", rr.LineStrips3D(strips, colors=_PROTRACTOR_COLOUR, radii=thin), static=True)
        labelled = rr.Points3D(marks, labels=labels, show_labels=True, radii=thin, colors=_PROTRACTOR_COLOUR)
        rec.log("/head/protractor/degrees", labelled, static=True)

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

    def draw_reference(self, rec: "rr.RecordingStream", path: str, orientation: Array, time: Array) -> None:
        """The line of sight of another trajectory in grey; orientation (time, 4), time (time,) [s]."""
        import rerun as rr

        turned = rr.Transform3D.columns(quaternion=np.roll(orientation, -1, axis=-1))
        rec.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time)], turned)
        self._draw_gaze(rec, f"{path}/gaze", REFERENCE_COLOUR)

    def draw_target(self, rec: "rr.RecordingStream", path: str, orientation: Array, colour: Colour) -> None:
        """A point where the line of sight of an orientation (4,) ends."""
        import rerun as rr

        point = rotation(orientation).apply([self.reach, 0, 0])
        rec.log(path, rr.Points3D([point], radii=0.024 * self.reach, colors=[colour]), static=True)

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


def _protractor(reach: float, horizontal: float, vertical: float) -> tuple[list[Array], Array, list[str]]:
    """Arcs with a tick every 10 deg at a distance [m] ahead: line strips, places of labels (n, 3), labels."""
    strips: list[Array] = []
    marks: list[Array] = []
    labels: list[str] = []
    for span, axis in ((horizontal, 2), (vertical, 1)):
        if span == 0:
            continue
        last = 10 * int(np.ceil(span / 10))
        degrees = np.arange(-last, last + 1)
        arc = Rotation.from_rotvec(np.eye(3)[axis] * degrees[:, None], degrees=True).apply([reach, 0, 0])
        ticks = np.flatnonzero(degrees % 10 == 0)
        strips += [arc, *(np.outer([0.985, 1.015], arc[tick]) for tick in ticks)]
        written = [tick for tick in ticks if degrees[tick] % (10 if last <= 60 else 30) == 0]
        written = [tick for tick in written if degrees[tick] or axis == 2]  # one 0 is enough
        marks += [1.05 * arc[tick] for tick in written]
        labels += [f"{degrees[tick]}°" for tick in written]
    return strips, np.array(marks), labels
