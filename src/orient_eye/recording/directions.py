"""Lines on a sphere ahead of the eye, by which a direction of gaze is read: a protractor, or a net.

All on the unit sphere about the eye, head frame; a scene draws them at the length of its line of sight.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from orient_eye import rotations

Array = NDArray[np.float64]
_LEAST_NET = 40
_RING_DEG = 1.5


@dataclass(frozen=True)
class Graticule:
    """Lines with labels.

    Attributes:
        name: of its entity.
        strips: lines, each (points, 3).
        marks: where the labels stand, (labels, 3).
        labels: what they say.
        around_deg: how far from straight ahead they go to all sides; 0 for lines to the left and right only.
    """

    name: str
    strips: list[Array]
    marks: Array
    labels: list[str]
    around_deg: float


def protractor(span: float) -> Graticule:
    """A horizontal arc to a span on either side [deg], with a tick every 10 deg."""
    last = 10 * int(np.ceil(span / 10))
    degrees = np.arange(-last, last + 1)
    arc = rotations.gaze(rotations.from_yaw(degrees))
    ticks = np.flatnonzero(degrees % 10 == 0)
    written = np.flatnonzero(degrees % (10 if last <= 60 else 30) == 0)
    strips = [arc, *(np.outer([0.985, 1.015], arc[tick]) for tick in ticks)]
    return Graticule("protractor", strips, 1.05 * arc[written], [f"{degrees[tick]}°" for tick in written], around_deg=0)


def net(eccentricity: float) -> Graticule:
    """Circles of eccentricity, 10, 20, 30, 40 deg and on to the largest that is needed [deg], and meridians."""
    last = max(_LEAST_NET, 10 * int(np.ceil(eccentricity / 10)))
    rings = np.arange(10, last + 1, 10)
    strips = [_polar(ring, np.arange(0, 361, 5)) for ring in rings]
    strips += [_polar(np.arange(-last, last + 1, 2), meridian) for meridian in range(0, 180, 30)]
    sides = {"left": (6, 0), "up": (5, 90), "right": (6, 180), "down": (1, 270)}  # a label hangs below its mark
    marks = [*_polar(rings, 30), *(_polar(last + beyond, side) for beyond, side in sides.values())]
    return Graticule("directions", strips, np.array(marks), [*(f"{ring}°" for ring in rings), *sides], around_deg=last)


def ring(orientation: ArrayLike) -> Array:
    """A small circle (points, 3) about the direction of gaze of an orientation (4,)."""
    return rotations.rotation(orientation).apply(_polar(_RING_DEG, np.arange(0, 361, 15)))


def _polar(eccentricity: ArrayLike, meridian: ArrayLike) -> Array:
    """Directions (..., 3) so far from straight ahead [deg] along a meridian [deg]: 0 to the left, 90 up."""
    e, m = np.broadcast_arrays(np.deg2rad(eccentricity), np.deg2rad(meridian))
    return np.stack([np.cos(e), np.sin(e) * np.cos(m), np.sin(e) * np.sin(m)], axis=-1)
