"""Listing's plane as a recording shows it: rotation vectors in 3-D, in deg.

x is torsion, y the vertical and z the horizontal turn, each 2 atan(r) of the rotation vector r (`orient_eye.listing`).
Torsion is small beside the others and drawn larger, by a factor that the view's name tells; its axis is labelled in
deg of torsion.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye.listing import Plane, fit_plane, rotation_vectors
from orient_eye.recording.curves import STILL_DEG
from orient_eye.recording.scene import MOMENT_COLOUR, TIMELINE, Colour, grow

if TYPE_CHECKING:
    import rerun as rr

Array = NDArray[np.float64]
_AXIS_COLOUR, _PLANE_COLOUR = (150, 150, 155), (90, 110, 150, 70)
_CAMERA = np.array([1.8, -1.8, 1.2])  # from the upper right: no axis hides another
_FACTORS = np.array([1, 2, 5, 10, 20])
_TICKS_DEG = np.array([0.2, 0.5, 1, 2, 5, 10, 20, 30, 60])


class RotationVectors:
    """Draws the rotation vectors of a recording's saccades, and the plane that lies closest to all of them.

    Args:
        orientation: of all of them, (..., 4).

    Attributes:
        plane: None where they lie close to a line, through which many planes go.
        factor: torsion is drawn so many times larger.
        name: of the view.
        camera: where to look from.
    """

    def __init__(self, orientation: Array) -> None:
        vectors = _in_degrees(orientation).reshape(-1, 3)
        self._limit = 10 * float(np.ceil(max(np.abs(vectors[:, 1:]).max(), 1) / 10))
        largest = float(np.abs(vectors[:, 0]).max())
        self.factor = int(_FACTORS[_FACTORS * largest <= 0.75 * self._limit].max(initial=1))
        tick = _TICKS_DEG[np.searchsorted(_TICKS_DEG[:-1], largest / 3)]
        self._ticks = tick * np.arange(1, np.ceil(max(largest, tick) / tick) + 1)
        flat = vectors[:, 1:] - vectors[:, 1:].mean(axis=0)
        across = float(np.linalg.svd(flat, compute_uv=False)[-1]) / np.sqrt(len(flat))
        self.plane: Plane | None = fit_plane(orientation) if across > STILL_DEG else None
        self.name = "Listing's plane" + (f": torsion {self.factor} times as large" if self.factor > 1 else "")
        self.camera = max(self._limit, self.factor * float(self._ticks[-1])) * _CAMERA

    def at(self, orientation: ArrayLike) -> Array:
        """Where orientations (..., 4) are drawn, (..., 3)."""
        return _in_degrees(orientation) * [self.factor, 1, 1]

    def draw_axes(self, rec: "rr.RecordingStream", path: str) -> None:
        """The axes, and the plane, below an entity path."""
        import rerun as rr

        marks, labels, lines = [], [], []
        straight = np.arange(10, self._limit + 1, 10)
        sides = (("torsion", "torsion"), ("up", "down"), ("right", "left"))
        for unit, ticks, names in zip(
            np.diag([self.factor, 1, 1]), (self._ticks, straight, straight), sides, strict=True
        ):
            lines.append([-ticks[-1] * unit, ticks[-1] * unit])
            for sign, name in zip((-1, 1), names, strict=True):
                marks += [sign * tick * unit for tick in ticks]
                labels += [""] * (ticks.size - 1) + [f"{sign * ticks[-1]:+g}° {name}"]
        thin, dot = rr.Radius.ui_points(0.75), rr.Radius.ui_points(2.0)
        rec.log(f"{path}/axes", rr.LineStrips3D(lines, colors=_AXIS_COLOUR, radii=thin), static=True)
        labelled = rr.Points3D(marks, labels=labels, show_labels=True, radii=dot, colors=_AXIS_COLOUR)
        rec.log(f"{path}/axes/degrees", labelled, static=True)
        if self.plane:
            rec.log(f"{path}/plane", self._sheet(self.plane), static=True)

    def draw_path(self, rec: "rr.RecordingStream", path: str, orientation: Array, time: Array, colour: Colour) -> None:
        """A saccade's rotation vectors, (time, 4) at times [s]: all as a line, the last and that of the moment dots."""
        import rerun as rr

        at = self.at(orientation)
        thin, dot = rr.Radius.ui_points(1.0), rr.Radius.ui_points(4.0)
        rec.log(f"{path}/path", rr.LineStrips3D([at], colors=[colour], radii=thin), static=True)
        rec.log(f"{path}/end", rr.Points3D(at[-1:], colors=[colour], radii=dot), static=True)
        self.draw_moment(rec, path, orientation, time)

    def draw_moment(self, rec: "rr.RecordingStream", path: str, orientation: Array, time: Array) -> None:
        """That of the moment, (time, 4) at times [s], as a dot."""
        import rerun as rr

        dot = rr.Radius.ui_points([3.0])
        rec.log(f"{path}/moment", rr.Points3D.from_fields(colors=[MOMENT_COLOUR], radii=dot), static=True)
        moments = rr.Points3D.columns(positions=self.at(orientation))
        rec.send_columns(f"{path}/moment", [rr.TimeColumn(TIMELINE, duration=time)], moments)

    def grow_path(
        self, rec: "rr.RecordingStream", path: str, orientation: Array, time: Array, colours: NDArray[np.uint8]
    ) -> None:
        """A line that grows with time, in colours (time, 3)."""
        import rerun as rr

        grow(rec, f"{path}/path", self.at(orientation), time, colours, radii=rr.Radius.ui_points([1.0]))

    def grow_ends(
        self, rec: "rr.RecordingStream", path: str, orientation: Array, time: Array, colours: Sequence[Colour]
    ) -> None:
        """Where saccades ended (saccades, 4), numbered dots, each from its moment [s] on."""
        import rerun as rr

        style = rr.Points3D.from_fields(radii=rr.Radius.ui_points([4.0]), show_labels=True)
        rec.log(f"{path}/ends", style, static=True)
        numbers = [f"{i + 1}" for i in range(len(orientation))]
        dots = rr.Points3D.columns(positions=self.at(orientation), colors=colours, labels=numbers)
        rec.send_columns(f"{path}/ends", [rr.TimeColumn(TIMELINE, duration=time)], dots)

    def _sheet(self, plane: Plane) -> "rr.Mesh3D":
        import rerun as rr

        y, z = (np.tan(np.deg2rad(self._limit) / 2) * np.array(corners) for corners in ((-1, 1, 1, -1), (-1, -1, 1, 1)))
        r = np.stack([plane.offset + plane.by_y * y + plane.by_z * z, y, z], axis=1)
        corners = np.rad2deg(2 * np.arctan(r)) * [self.factor, 1, 1]
        return rr.Mesh3D(vertex_positions=corners, triangle_indices=[[0, 1, 2], [0, 2, 3]], albedo_factor=_PLANE_COLOUR)

    @property
    def text(self) -> list[str]:
        """What the plane is like, lines of Markdown."""
        if self.plane is None:
            return ["These saccades lie along one line of rotation vectors: through it there is no one plane.", ""]
        yaw, pitch = self.plane.tilt_deg
        return [
            f"Listing's plane through all samples: thickness {self.plane.sd_deg:.2f}° (standard deviation of torsion), "
            f"turned by {yaw:+.2f}° of yaw and {pitch:+.2f}° of pitch, twist {self.plane.twist:+.2f} (0 by Listing's "
            "law, -1 by Fick's gimbal).",
            "",
        ]


def _in_degrees(orientation: ArrayLike) -> Array:
    """2 atan(r) [deg] (..., 3) of orientations (..., 4)."""
    return np.asarray(np.rad2deg(2 * np.arctan(rotation_vectors(orientation))))
