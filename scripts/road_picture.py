"""The picture of the data's road: command -> plant -> movement -> measures -> reward, and what stands around it.

    python scripts/road_picture.py                         # docs/pictures/road.svg

Its curves are a saccade of 20 deg of the shipped policy mujoco-1, a worse one beside it, the reward about its best
command, and a step of the eye beside the step of its surrogate. The strokes are uneven by a seed: the same each time.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import contourpy
import numpy as np
import tyro
from numpy.typing import ArrayLike, NDArray

from orient_eye.files import write_text
from orient_eye.learning.policy import Policy
from orient_eye.plants import make_plant
from orient_eye.task.targets import saccades

Array = NDArray[np.float64]
WIDTH, HEIGHT = 1200, 800
PAPER, SHEET, INK, PENCIL, SAND = "#f8f2e4", "#fffdf6", "#2d2a33", "#8d857a", "#ecdcb6"
BLUE, RED, OCHRE, GREEN = "#2b6a99", "#c5442c", "#c98d1f", "#5d8563"
COLUMNS = {"command": 168.0, "plant": 390.0, "movement": 612.0, "measures": 836.0, "reward": 1058.0}
ROAD_Y, FLOOR = 420.0, 376.0
_FONT = "Palatino,'Palatino Linotype','Book Antiqua',Georgia,'Liberation Serif',serif"


# --- what is drawn --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Curves:
    """What the package computes for the picture; times in s, angles in deg."""

    time: Array
    motor: Array
    gaze: Array
    """Of the policy's saccade."""
    worse: Array
    """Gaze of a saccade that overshoots."""
    settled: float
    """When the gaze has settled."""
    k0: Array
    reward: Array
    """Against k0, the rest being the policy's."""
    best: float
    """The k0 of the largest reward."""
    contours: list[Array]
    """Lines of equal reward over k0 and B, (points, 2) in shares of their ranges."""
    stepped: Array
    fitted: Array
    """Gaze after a step of the motor, of the eye and of its surrogate."""


def curves() -> Curves:
    """The saccade, what else could have been done, and a step."""
    policy = Policy.load("mujoco-1")
    task = policy.task()
    start, target = saccades(task.targets, [[0.0]], [[20.0]])
    action = policy.act(start.orientation, target)
    made = task.trajectory(start, action, target)

    def with_numbers(B: ArrayLike, k0: ArrayLike) -> Array:
        B, k0 = np.broadcast_arrays(np.asarray(B, float), np.asarray(k0, float))
        return np.stack([B.ravel(), np.full(B.size, action[0, 1]), k0.ravel()], axis=1)

    def worth(actions: Array) -> Array:
        which = np.zeros(len(actions), int)
        return task.perform(start[which], actions, target[which]).reward.total

    k0 = np.linspace(13.0, 30.0, 171)
    B, near = np.linspace(25.0, 75.0, 24), np.linspace(16.0, 22.0, 24)
    grid = np.log10(-worth(with_numbers(*np.meshgrid(B, near, indexing="ij"))).reshape(24, 24))
    least = float(grid.min())
    lines = contourpy.contour_generator(np.linspace(0, 1, 24), np.linspace(0, 1, 24), grid)
    levels = least + np.array([0.006, 0.03, 0.08, 0.18, 0.4])
    found = [line for level in levels for line in lines.lines(float(level)) if len(line) > 6]
    step = np.zeros((1, 300, 3))
    step[:, 1:, 1] = 10.0
    eye = make_plant("mujoco").move(step).trajectory()
    surrogate = make_plant("lpf", surrogate="mujoco").move(step[..., 1:2]).trajectory()
    return Curves(
        made.time,
        made.motor[0, :, 1],
        made.yaw_deg[0],
        task.trajectory(start, with_numbers(action[0, 0], 9.0), target).yaw_deg[0],
        float(task.perform(start, action, target).measures.settling_time_s[0]),
        k0,
        worth(with_numbers(action[0, 0], k0)),
        float(k0[worth(with_numbers(action[0, 0], k0)).argmax()]),
        found,
        eye.yaw_deg[0],
        surrogate.yaw_deg[0],
    )


# --- the hand -------------------------------------------------------------------------------------------------------


def along(points: Array, every: float) -> Array:
    """Points (n, 2) on a polyline, as far apart as that, the last one too."""
    length = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.linspace(0, length[-1], max(int(length[-1] / every) + 1, 3))
    return np.stack([np.interp(at, length, values) for values in points.T], axis=1)


def path_of(points: Array, *, closed: bool = False) -> str:
    """A smooth path through the middles between points."""
    if closed:
        points = np.concatenate([points, points[:2]])
    middles = (points[1:] + points[:-1]) / 2
    if not closed:
        middles[0], middles[-1] = points[0], points[-1]
    points, middles = points.round(1), middles.round(1)
    steps = (_pair(p - m) + _pair(n - m) for p, m, n in zip(points[1:-1], middles[:-1], middles[1:], strict=True))
    return f"M{_pair(middles[0])}q{''.join(steps)}".replace("q ", "q") + ("z" if closed else "")


def _pair(point: ArrayLike) -> str:
    """Two numbers to a tenth, as short as SVG allows."""
    words = (
        f"{value:g}".replace("0.", ".") if abs(value) < 1 else f"{value:g}" for value in np.asarray(point).round(1)
    )
    return "".join(word if word.startswith("-") else f" {word}" for word in words)


def off(points: Array, x: float, y: float) -> Array:
    """Points (..., 2), moved."""
    return points + np.array([x, y])


def ellipse(x: float, y: float, rx: float, ry: float | None = None, turn: float = 0.0) -> Array:
    """Points on an ellipse, turned by degrees."""
    angle = np.linspace(0, 2 * np.pi, max(int(max(rx, ry or rx)), 12), endpoint=False)
    own = np.stack([rx * np.cos(angle), (rx if ry is None else ry) * np.sin(angle)], axis=1)
    cos, sin = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    return own @ np.array([[cos, sin], [-sin, cos]]) + [x, y]


@dataclass
class Hand:
    """Draws strokes that are a little uneven, and keeps them as SVG."""

    random: np.random.Generator
    parts: list[str] = field(default_factory=list)

    def uneven(self, points: Any, wobble: float, every: float = 16.0, *, closed: bool = False) -> Array:
        """Points as a hand finds them: off by slow noise of that size, in px."""
        points = np.asarray(points, float)
        points = points if closed else along(points, every)
        noise = self.random.normal(size=(len(points) + 4, 2))
        slow = sum(noise[i : i + len(points)] * weight for i, weight in enumerate((0.15, 0.3, 0.4, 0.3, 0.15)))
        return points + wobble * slow

    def stroke(
        self, points: Any, colour: str = INK, width: float = 1.8, *, wobble: float = 1.0, every: float = 16.0,
        closed: bool = False, fill: str = "none", more: str = "",
    ) -> None:  # fmt: skip
        """A line through points."""
        d = path_of(self.uneven(points, wobble, every, closed=closed), closed=closed)
        drawn = f' stroke="{colour}" stroke-width="{width}"' if width else ' stroke="none"'
        self.parts.append(f'<path d="{d}"{drawn}{_fill(fill)}{more}/>')

    def area(self, points: Any, fill: str, more: str = "") -> None:
        """A filled shape without an outline."""
        self.parts.append(f'<path d="M{"L".join(map(_pair, np.asarray(points)))}Z" stroke="none" fill="{fill}"{more}/>')

    def hatch(
        self, lines: Sequence[Any], colour: str, width: float = 0.8, wobble: float = 0.5, every: float = 14.0
    ) -> None:
        """Many short strokes as one path."""
        d = "".join(path_of(self.uneven(line, wobble, every)) for line in lines)
        self.parts.append(f'<path d="{d}" stroke="{colour}" stroke-width="{width}"/>')

    def dot(self, x: float, y: float, r: float, colour: str) -> None:
        """A round spot."""
        self.parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r:g}" fill="{colour}"/>')

    def arrow(self, points: Any, colour: str = INK, width: float = 1.8, head: float = 9.0, more: str = "") -> None:
        """A line with a head at its end."""
        points = np.asarray(points, float)
        self.stroke(points, colour, width, wobble=0.8, more=more)
        self.head(points[-1], points[-1] - points[-2], colour, width, head)

    def head(self, tip: Any, way: Any, colour: str, width: float, size: float) -> None:
        """Of an arrow."""
        angle = np.arctan2(way[1], way[0])
        sides = [np.asarray(tip) - size * np.array([np.cos(angle + s), np.sin(angle + s)]) for s in (0.45, -0.45)]
        self.stroke([sides[0], tip, sides[1]], colour, width, wobble=0.3, every=size / 2)

    def text(
        self,
        x: float,
        y: float,
        words: str,
        size: float = 15,
        colour: str = INK,
        anchor: str = "middle",
        more: str = "",
    ) -> None:
        """Words in italics."""
        at = f'x="{x:g}" y="{y:g}" font-size="{size:g}" fill="{colour}"'
        placed = "" if anchor == "middle" else f' text-anchor="{anchor}"'
        self.parts.append(f"<text {at}{placed}{more}>{escape(words)}</text>")

    def axes(self, x: float, y: float, width: float, height: float, across: str, up: str) -> None:
        """Two arrows from a corner, with what they tell."""
        self.arrow([(x - 6, y), (x + width, y)], INK, 1.4, 7)
        self.arrow([(x, y + 6), (x, y - height)], INK, 1.4, 7)
        self.text(x + width - 2, y + 16, across, 14.5, PENCIL)
        self.text(x + 8, y - height + 4, up, 14.5, PENCIL, "start")


def _fill(colour: str) -> str:
    return "" if colour == "none" else f' fill="{colour}"'


def placed(x: ArrayLike, y: ArrayLike, box: tuple[float, float, float, float], spans: Any) -> Array:
    """Points (n, 2) of a curve in a box (left, floor, width, height) that shows these spans of x and y."""
    left, floor, width, height = box
    (x0, x1), (y0, y1) = spans
    across = left + width * (np.asarray(x, float) - x0) / (x1 - x0)
    return np.stack([across, floor - height * (np.asarray(y, float) - y0) / (y1 - y0)], axis=1)


# --- the stations ---------------------------------------------------------------------------------------------------

UNTIL = 0.3  # s of the curves


def command(hand: Hand, what: Curves) -> None:
    """The pulse-step."""
    x = COLUMNS["command"] - 82
    hand.axes(x, FLOOR - 8, 172, 142, "time", "motor")
    seen = what.time <= UNTIL
    box, spans = (x, FLOOR - 8, 158, 112), ((0, UNTIL), (0, 17.7))
    curve = placed(what.time[seen], what.motor[seen], box, spans)
    step = placed([0, UNTIL], [what.motor[seen][-1]] * 2, box, spans)
    peak = curve[curve[:, 1].argmin()]
    above = curve[curve[:, 1] < step[0, 1] - 0.5]
    hand.area([*above, (above[0, 0], step[0, 1])], RED, ' opacity=".16"')
    hand.stroke(step, PENCIL, 1.2, wobble=0.4, more=' stroke-dasharray="5 5"')
    hand.stroke(curve[::3], RED, 2.8, wobble=0.25, every=5)
    hand.text(peak[0] + 24, peak[1] - 5, "pulse", 15, RED, "start")
    hand.text(x + 132, step[0, 1] + 19, "step", 15, RED)


def plant(hand: Hand) -> None:
    """Motors with their arms, elastics, and the eye."""
    x, y, r = COLUMNS["plant"] + 38, 292.0, 54.0
    for k, (motor_y, tilt) in enumerate(((238.0, -16.0), (292.0, 20.0), (346.0, 16.0))):
        motor_x = COLUMNS["plant"] - 84
        arm = np.array([np.sin(np.deg2rad(tilt)), -np.cos(np.deg2rad(tilt))])
        ends = [np.array([motor_x, motor_y]) + side * 23 * arm for side in (1, -1)]
        for side, end in zip((1, -1), ends, strict=True):
            angle = np.deg2rad(180 + (k - 1) * 52 - side * 14)
            goal = np.array([x + 0.97 * r * np.cos(angle), y - 0.97 * r * np.sin(angle)])
            spring(hand, end, goal, (OCHRE, GREEN, OCHRE)[k])
        hand.stroke(ends, INK, 4.5, wobble=0.4)
        hand.stroke(ellipse(motor_x, motor_y, 12), INK, 1.8, wobble=0.6, closed=True, fill="#d9d3c6")
        hand.dot(motor_x, motor_y, 3.2, INK)
    eye(hand, x, y, r, 14)
    hand.stroke([(x + 62, y - 17), (x + 94, y - 26)], BLUE, 1.6, wobble=0.3, more=' stroke-dasharray="2 5"')


def spring(hand: Hand, start: Array, end: Array, colour: str) -> None:
    """An elastic."""
    way = end - start
    length = float(np.hypot(*way))
    across = np.array([-way[1], way[0]]) / length
    share = np.linspace(0.16, 0.84, 15)
    zigzag = [start + s * way + across * (3.6 if i % 2 else -3.6) for i, s in enumerate(share)]
    points = np.array([start, start + 0.12 * way, *zigzag, start + 0.88 * way, end])
    hand.parts.append(f'<path d="{path_of(points)}" stroke="{colour}" stroke-width="1.7"/>')


def eye(hand: Hand, x: float, y: float, r: float, up: float) -> None:
    """An eye that looks to the right, so many degrees up."""
    look = np.array([np.cos(np.deg2rad(up)), -np.sin(np.deg2rad(up))])
    bulge = [
        ellipse_point(np.array([x, y]) + 0.80 * r * look, 0.31 * r, 0.54 * r, -up, a)
        for a in np.linspace(-1.6, 1.6, 15)
    ]
    hand.stroke(bulge, INK, 1.6, wobble=0.3, every=9, fill="#dfeaf0")
    hand.stroke(ellipse(x, y, r), INK, 2.2, wobble=0.6, closed=True, fill=SHEET)
    hand.stroke(ellipse(x + 0.6, y + 0.4, r + 0.6), INK, 0.8, wobble=1.5, closed=True)
    shade = []
    for k in range(7):
        inner = r * (0.93 - 0.075 * k)
        angle = np.deg2rad(np.linspace(104 + 4 * k, 186 - 6 * k, 7))
        shade.append(np.stack([x + inner * np.cos(angle), y + inner * np.sin(angle)], axis=1))
    hand.hatch(shade, PENCIL, 0.9)
    veins = []
    for angle, bend in ((-150, 6), (-128, -5), (-172, 4)):
        a = np.deg2rad(angle)
        out = np.array([np.cos(a), np.sin(a)])
        beside = np.array([-out[1], out[0]])
        along_it = ((0.93, 0), (0.75, 1), (0.62, -0.3), (0.5, 0.8))
        veins.append([np.array([x, y]) + r * share * out + bend * b * beside for share, b in along_it])
    hand.hatch(veins, RED, 0.9, 0.8, 4.0)
    iris = np.array([x, y]) + 0.80 * r * look
    hand.stroke(ellipse(*iris, 0.20 * r, 0.50 * r, -up), INK, 1.8, wobble=0.3, closed=True, fill=BLUE)
    rays = []
    for angle in np.deg2rad(np.arange(0, 360, 20)):
        rim = ellipse_point(iris, 0.19 * r, 0.47 * r, -up, angle)
        rays.append([iris + 0.5 * (rim - iris), rim])
    hand.hatch(rays, "#a9cbe0", 0.9, 0.2)
    hand.stroke(ellipse(*(iris + 0.03 * r * look), 0.09 * r, 0.23 * r, -up), INK, 0, wobble=0.2, closed=True, fill=INK)
    hand.dot(iris[0] + 0.03 * r, iris[1] - 0.2 * r, 0.055 * r, SHEET)


def ellipse_point(centre: Array, rx: float, ry: float, turn: float, angle: float) -> Array:
    """Of an ellipse that is turned by degrees, at an angle in rad."""
    cos, sin = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
    own = np.array([rx * np.cos(angle), ry * np.sin(angle)])
    return centre + own @ np.array([[cos, sin], [-sin, cos]])


GAZE = (0, UNTIL), (0.0, 23.5)


def movement(hand: Hand, what: Curves) -> None:
    """The gaze against time, and the eye at three instants."""
    x = COLUMNS["movement"] - 84
    hand.axes(x, FLOOR - 8, 176, 142, "time", "gaze")
    seen = what.time <= UNTIL
    box = (x, FLOOR - 8, 162, 130)
    curve = placed(what.time[seen], what.gaze[seen], box, GAZE)
    hand.stroke(placed([0, UNTIL], [20, 20], box, GAZE), PENCIL, 1.2, wobble=0.4, more=' stroke-dasharray="5 5"')
    hand.text(x + 160, curve[:, 1].min() - 10, "target", 15, PENCIL, "end")
    hand.stroke(curve[::3], BLUE, 2.8, wobble=0.25, every=5)
    for moment in (0.07, 0.15, 0.25):
        k = int(np.searchsorted(what.time, moment))
        at = curve[k]
        below = FLOOR - 34
        hand.stroke([off(at, 0, 5), (at[0], below - 17)], PENCIL, 0.9, wobble=0.2, more=' stroke-dasharray="2 4"')
        hand.dot(*at, 3.6, BLUE)
        small_eye(hand, at[0], below, 13, 2.2 * what.gaze[k] - 22)


def small_eye(hand: Hand, x: float, y: float, r: float, up: float) -> None:
    """An eye of few strokes."""
    hand.stroke(ellipse(x, y, r), INK, 1.5, wobble=0.4, closed=True, fill=SHEET)
    look = np.array([np.cos(np.deg2rad(up)), -np.sin(np.deg2rad(up))])
    iris = np.array([x, y]) + 0.74 * r * look
    hand.stroke(ellipse(*iris, 0.26 * r, 0.5 * r, -up), INK, 1, wobble=0.2, closed=True, fill=BLUE)
    hand.dot(*(iris + 0.05 * r * look), 0.16 * r, INK)


def measures(hand: Hand, what: Curves) -> None:
    """The same gaze with marks: amplitude, duration, overshoot of a worse one, and the band in which it settles."""
    x = COLUMNS["measures"] - 78
    seen = what.time <= UNTIL
    box = (x, FLOOR - 8, 162, 116)
    span = (0, UNTIL), (0.0, 23.5)
    curve, worse = (placed(what.time[seen], each[seen], box, span) for each in (what.gaze, what.worse))
    end = float(what.gaze[-1])
    band = placed([0, UNTIL, UNTIL, 0], [1.01 * end, 1.01 * end, 0.99 * end, 0.99 * end], box, span)
    hand.area(band, GREEN, ' opacity=".45"')
    hand.stroke([(x - 6, FLOOR - 8), (x + 174, FLOOR - 8)], INK, 1.4, wobble=0.5)
    hand.stroke(worse[::3], PENCIL, 1.5, wobble=0.25, every=5, more=' stroke-dasharray="6 3"')
    hand.stroke(curve[::3], BLUE, 2.4, wobble=0.25, every=5)
    top = placed([0], [end], box, span)[0, 1]
    settled = placed([what.settled], [end], box, span)[0]
    hand.dot(*settled, 4, GREEN)
    hand.stroke([off(settled, 0, 6), (settled[0], FLOOR - 8)], GREEN, 1.2, wobble=0.3, more=' stroke-dasharray="3 4"')
    between(hand, (x, FLOOR - 26), (settled[0], FLOOR - 26), RED)
    hand.text((x + settled[0]) / 2 + 8, FLOOR - 33, "duration", 15, RED)
    side = x + 150
    between(hand, (side, FLOOR - 10), (side, top), RED)
    hand.text(side - 6, FLOOR - 54, "amplitude", 15, RED, more=f' transform="rotate(-90 {side - 6:g} {FLOOR - 54:g})"')
    peak = worse[worse[:, 1].argmin()]
    hand.text(peak[0] + 12, peak[1] - 18, "overshoot", 15, PENCIL)
    hand.stroke([off(peak, 2, -14), off(peak, 0, -3)], PENCIL, 1.1, wobble=0.3, every=4)
    hand.text(settled[0] + 10, FLOOR + 9, "settled within 1 %", 14.5, GREEN)


def between(hand: Hand, start: tuple[float, float], end: tuple[float, float], colour: str) -> None:
    """A measure from here to there."""
    hand.stroke([start, end], colour, 1.4, wobble=0.4)
    way = np.subtract(end, start)
    hand.head(end, way, colour, 1.4, 7)
    hand.head(start, -way, colour, 1.4, 7)


def reward(hand: Hand, what: Curves) -> None:
    """The reward against k0: a cliff, and a flag on the best."""
    x, low = COLUMNS["reward"] - 82, FLOOR - 8
    box = (x + 22, low, 148, 104)
    height = -np.log10(-what.reward)
    spans = (what.k0[0], what.k0[-1]), (height.min() - 0.1, height.max())
    curve = placed(what.k0, height, box, spans)
    hand.area([*curve, (curve[-1, 0], low), (curve[0, 0], low)], SAND, ' opacity=".8"')
    at = placed([what.best], [np.interp(what.best, what.k0, height)], box, spans)[0]
    lines = []
    for k, y in enumerate(np.arange(at[1] + 12, low - 8, 8.5)):  # rock
        edge = _edge(curve, y)
        lines.append([(edge + 3, y), (edge + 13 + 11 * (k % 3), y + 7 + 2 * (k % 2))])
    for k, over in enumerate(np.arange(at[0] + 14, curve[-1, 0] - 2, 9.5)):  # meadow
        top = float(np.interp(over, *curve.T))
        lines.append([(over, top + 4), (over - 3, top + 9 + 5 * (k * 7 % 4))])
    hand.hatch(lines, OCHRE, 1.1)
    hand.axes(x, low, 182, 142, "k0", "reward")
    hand.stroke(curve, INK, 2.4, wobble=0.5, every=8)
    hand.stroke([off(curve[-1], 0, 4), (curve[-1, 0], low - 2)], PENCIL, 0.9, wobble=0.9, every=9)
    hand.stroke([at, off(at, 0, -36)], INK, 1.8, wobble=0.3)
    hand.stroke([off(at, 0, -36), off(at, 24, -29), off(at, 0, -21)], RED, 1.4, wobble=0.3, every=8, fill=RED)
    hand.dot(*at, 4, RED)
    hand.text(at[0] + 32, at[1] - 24, "best", 15, RED, "start")
    hand.text(x + 7, low - 74, "cliff", 15, INK, "start")


def _edge(curve: Array, y: float) -> float:
    """Where a rising curve of pixels is first as high as y."""
    return float(curve[int(np.argmax(curve[:, 1] <= y)), 0])


# --- around the road ------------------------------------------------------------------------------------------------

LAYERS = (
    ("command line", "orient-eye", tuple(COLUMNS), INK),
    ("recorder", "Rerun", ("command", "plant", "movement"), OCHRE),
    ("trainer", "sweeps", ("command", "reward"), RED),
    ("environment", "Gymnasium", ("command", "reward"), BLUE),
)
_TOP, _APART = 52.0, 32.0


def layers(hand: Hand) -> None:
    """Thin sheets over the road, with a spot where each touches it."""
    for x in COLUMNS.values():
        hand.stroke([(x, _TOP + 8), (x, 190)], PENCIL, 0.9, wobble=0.5, more=' stroke-dasharray="1.5 5"')
    for k, (name, remark, touches, colour) in enumerate(LAYERS):
        y = _TOP + k * _APART
        tilt = (0.8, -0.9, 0.7, -0.6)[k]
        corners = [(34, y - 11 + tilt), (1166, y - 11 - tilt), (1168, y + 11 - tilt), (36, y + 11 + tilt)]
        sides = pairwise([*corners, corners[0]])
        outline = np.concatenate([along(np.array(side, float), 60)[:-1] for side in sides])
        hand.stroke(outline, PENCIL, 1.0, wobble=0.6, closed=True, fill=SHEET, more=' fill-opacity=".8"')
        hand.text(43, y + 5, name, 16, colour, "start")
        hand.text(1156, y + 4, remark, 14.5, PENCIL, "end")
        ends = [(COLUMNS[touches[0]], y), (COLUMNS[touches[-1]], y)]
        hand.stroke(ends, colour, 1.6, wobble=0.5, every=90, more=' opacity=".4"')
        for station in touches:
            hand.dot(COLUMNS[station], y, 5, colour)


GRASS = (
    *((112, 1), (231, -1), (330, 1), (452, -1), (545, 1), (676, 1), (690, -1)),
    *((779, 1), (905, -1), (1002, 1), (1112, -1)),
)
"""Where it grows, and on which side of the road."""


def road(hand: Hand) -> None:
    """The road, with its milestones."""
    x = np.linspace(40, 1150, 80)
    y = ROAD_Y + 3.5 * np.sin(x / 95) + 2 * np.sin(x / 41 + 1)
    middle = np.stack([x, y], axis=1)
    edges = [hand.uneven(off(middle, 0, side * 13), 0.9, 30) for side in (-1, 1)]
    outline = np.concatenate([edges[0], [(1174, y[-1])], edges[1][::-1]])
    hand.stroke(outline, INK, 1.5, wobble=0, every=24, fill=SAND)
    for edge in edges:  # gone over once more
        hand.stroke(edge, INK, 0.7, wobble=1.3, every=70)
    tufts = []
    for at, side in GRASS:
        foot = float(np.interp(at, x, y)) + (22 if side > 0 else -14)
        blades = ((-5, -3, 6), (-1.5, -0.5, 9), (2, 2, 7), (5, 4, 5))
        tufts += [
            [(at + b, foot), (at + b + lean / 3, foot - high / 2), (at + b + lean, foot - high)]
            for b, lean, high in blades
        ]
    hand.hatch(tufts, GREEN, 1.2, 0.25)
    chevrons = []
    for at in (58, 84, 254, 280, 306, 474, 500, 526, 698, 724, 750, 922, 948, 974, 1118, 1144):
        height = float(np.interp(at, x, y))
        chevrons.append([(at - 5, height - 5), (at + 3, height), (at - 5, height + 5)])
    d = "".join(f"M{'L'.join(map(_pair, c))}" for c in chevrons)
    hand.parts.append(f'<path d="{d}" stroke="{PENCIL}" stroke-width="1.6"/>')
    told = {
        "command": "what motors are told",
        "plant": "motors, elastics, an eye",
        "movement": "where the gaze goes",
        "measures": "how far, how long, how well",
        "reward": "what it was worth",
    }
    for (name, words), numeral in zip(told.items(), ("I", "II", "III", "IV", "V"), strict=True):
        at, top = COLUMNS[name], float(np.interp(COLUMNS[name], x, y))
        hand.stroke(ellipse(at, top, 17, 15), INK, 1.6, wobble=0.3, closed=True, fill=SHEET)
        hand.text(at, top + 5, numeral, 14, INK, more=' font-style="normal"')
        hand.text(at, 463, name, 24, INK, more=' font-weight="bold"')
        hand.text(at, 483, words, 16, PENCIL)


def learner(hand: Hand) -> None:
    """The way back, through a network."""
    right, left, y = COLUMNS["reward"], COLUMNS["command"], 694.0
    quarter = np.linspace(0, np.pi / 2, 9)
    bend = 84 * np.stack([1 - np.cos(quarter), np.sin(quarter)], axis=1)
    hand.stroke([(right, 498), *off(bend * (-1, 1), right, y - 84), (712, y)], RED, 2.6, wobble=1.0, every=22)
    hand.head((708, y), (-1, 0), RED, 2.6, 12)
    hand.arrow([(508, y), *off(bend, left, y - 84)[::-1], (left, 500)], RED, 2.6, 13)
    columns = [(690, (-20, 20)), (636, (-42, -14, 14, 42)), (580, (-42, -14, 14, 42)), (526, (-28, 0, 28))]
    links = [[(x0, y + y0), (x1, y + y1)] for (x0, ys), (x1, others) in pairwise(columns) for y0 in ys for y1 in others]
    d = "".join(f"M{_pair(a)}L{_pair(b)}" for a, b in links)
    hand.parts.append(f'<path d="{d}" stroke="{PENCIL}" stroke-width=".8" opacity=".8"/>')
    for k, (x, ys) in enumerate(columns):
        for each in ys:
            hand.stroke(ellipse(x, y + each, 8), INK, 1.5, wobble=0.4, closed=True, fill=(BLUE, SHEET, SHEET, RED)[k])
    hand.text(608, y - 68, "learner", 21, INK, more=' font-weight="bold"')
    hand.text(608, y + 76, "Soft Actor-Critic: one command an episode", 16, PENCIL)
    hand.text(706, y + 32, "start, target", 14.5, BLUE, "start")
    hand.text(508, y + 46, "B, D, k0", 14.5, RED, "end")
    hand.text(900, y + 24, "how good it was", 16, RED)
    hand.text(330, y + 24, "a better command", 16, RED)


def sysid(hand: Hand, what: Curves) -> None:
    """A step of the eye and the surrogate's."""
    x, floor = COLUMNS["plant"] - 78, 618.0
    hand.axes(x, floor, 164, 92, "time", "gaze")
    box, spans = (x, floor, 150, 82), ((0, 0.3), (0, 17.5))
    time = np.arange(len(what.stepped)) * 1e-3
    hand.stroke(placed([0, 0, 0.3], [0, 10, 10], box, spans), PENCIL, 1.2, wobble=0.3, more=' stroke-dasharray="5 4"')
    hand.stroke(placed(time, what.fitted, box, spans)[::4], GREEN, 2.4, wobble=0.4, every=8)
    for k in range(4, len(time), 26):
        hand.dot(*placed([time[k]], [what.stepped[k]], box, spans)[0], 2.8, INK)
    hand.text(COLUMNS["plant"], floor + 28, "sysid", 21, INK, more=' font-weight="bold"')
    hand.text(COLUMNS["plant"], floor + 47, "which eye is this?", 16, PENCIL)
    hand.arrow([(COLUMNS["plant"], 528), (COLUMNS["plant"], 496)], GREEN, 2.2, 9)


def search(hand: Hand, what: Curves) -> None:
    """Lines of equal reward, and a simplex that walks to the best."""
    left, floor, width, height = COLUMNS["measures"] - 70, 618.0, 146.0, 84.0
    hand.axes(left, floor, 164, 92, "k0", "B")
    shades = ("#b98a2c", "#c69d4d", "#cfae6c", "#d7bd8a", "#decaa4")
    for k, line in enumerate(what.contours):
        points = np.stack([left + 6 + width * line[:, 0], floor - 6 - height * line[:, 1]], axis=1)
        hand.stroke(points, shades[min(k, 4)], 1.5, wobble=0.3, every=11)
    best = what.contours[0].mean(axis=0)
    goal = np.array([left + 6 + width * best[0], floor - 6 - height * best[1]])
    for distance, size, turn in ((72, 14, 10), (48, 11, 70), (27, 8, 130)):
        centre = goal + distance * np.array([0.93, -0.37])
        angle = np.deg2rad(turn + np.array([0, 120, 240, 360]))
        corners = centre + size * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        hand.parts.append(f'<path d="M{"L".join(map(_pair, corners[:3]))}z" stroke="{INK}" stroke-width="1.4"/>')
    hand.dot(*goal, 4, RED)
    hand.text(COLUMNS["measures"], floor + 28, "search", 21, INK, more=' font-weight="bold"')
    hand.text(COLUMNS["measures"], floor + 47, "the best there is", 16, PENCIL)
    turn = np.linspace(0, np.pi / 2, 8)
    hand.arrow(np.stack([930 + 92 * np.sin(turn), 500 + 64 * np.cos(turn)], axis=1), OCHRE, 2.2, 9)


def picture(what: Curves) -> str:
    """The SVG."""
    hand = Hand(np.random.default_rng(4))
    for a, b in (((15, 11), (15, 789)), ((11, 15), (1189, 15)), ((1185, 11), (1185, 789)), ((11, 785), (1189, 785))):
        hand.stroke([a, b], PENCIL, 1.0, wobble=0.5, every=90)
    layers(hand)
    road(hand)
    command(hand, what)
    plant(hand)
    movement(hand, what)
    measures(hand, what)
    reward(hand, what)
    learner(hand)
    sysid(hand, what)
    search(hand, what)
    hand.text(30, 772, "policy mujoco-1, a saccade of 20 deg", 13.5, PENCIL, "start")
    told = (
        "A road from left to right: command, plant, movement, measures, reward. Thin layers over it: command line, "
        "recorder, trainer, environment. Below, the learner's way back from reward to command; sysid beside the plant, "
        "search beside the reward."
    )
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-labelledby="t d">\n'
        f'<title id="t">The road of the data</title>\n<desc id="d">{told}</desc>\n'
        f'<rect width="{WIDTH}" height="{HEIGHT}" rx="18" fill="{PAPER}"/>\n'
        f'<g fill="none" stroke-linecap="round" stroke-linejoin="round" font-family="{_FONT}" font-style="italic" '
        'text-anchor="middle">\n'
    )
    return head + "\n".join(hand.parts) + "\n</g>\n</svg>\n"


@dataclass(frozen=True)
class RoadPicture:
    """Draw the road."""

    out: Path = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "road.svg"
    """The picture, SVG."""


if __name__ == "__main__":
    write_text(tyro.cli(RoadPicture, description=__doc__).out, picture(curves()))
