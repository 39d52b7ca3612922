"""How the motors of an eye that has more of them than axes share the work of holding it.

    cables = plant.cables
    cables.posture(orientation, "least-force", 1.0)  # motors (n, 6) that hold orientations (n, 4), by a criterion
    cables.state(orientation, motor)                 # stable? slack?

Six cables hold an eye in each orientation in many ways: three of the six directions in which motors can go turn
nothing. Among taut cables tension and torque follow the motors on straight lines, so that the posture of a criterion is
the solution of a small quadratic program: of linear equations, for each set of the bounds that it may touch.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np
from numpy.typing import NDArray

from orient_eye.checks import real
from orient_eye.errors import InputError
from orient_eye.eyes.muscles import Muscles
from orient_eye.motor import Motor, names, ranges, rests
from orient_eye.plants import Plant
from orient_eye.plants.equilibrium import Torque, least_stiffness, stiffness
from orient_eye.registry import Registry

Array = NDArray[np.float64]
Quadratic = tuple[Array, Array, Array]
"""P (motors, motors), q (n, motors), c (n,) of a cost x P x / 2 - q x + c, of the motors [rad] off their rest."""
_TAUT = 0.5  # of the way from rest to the end of their range all cables are taut: tension and torque on straight lines
_UNIT = np.rad2deg(1.0)
_TORQUE = 1e-9  # N m, that may be left; a degree is worth about 5e-3
LOOSE_N = 1e-9
"""A cable with a smaller tension hangs."""
_SOFT = 1e-9  # of a cost, for what it leaves open: the change from the pretension then decides
MOST_RAD = 10.0
"""Of a co-contraction."""


@dataclass(frozen=True)
class Lines:
    """Tension and torque of taut cables in orientations, as straight lines in the motors' angles.

    Attributes:
        tension: [N] with the motors at rest, as if cables could push, (n, tendons).
        pull: by how much it grows, [N/rad], (tendons, motors).
        torque: [N m] the same, (n, 3).
        moment: by how much it grows, [N m/rad], (n, 3, motors).
    """

    tension: Array
    pull: Array
    torque: Array
    moment: Array


@dataclass(frozen=True)
class Criterion:
    """What of all postures that hold an orientation is the best.

    Attributes:
        summary: for people.
        cost: of a posture, from straight lines and the pairs of antagonists.
        unit: of the cost.
        co_contraction: whether pairs of antagonists are wound up by a number in the mean: "least", at least so far,
            "given", just so far; "" for free.
    """

    summary: str
    cost: Callable[[Lines, NDArray[np.intp]], Quadratic]
    unit: str
    co_contraction: str = ""


def _change(lines: Lines, pairs: NDArray[np.intp]) -> Quadratic:
    n, m = len(lines.tension), lines.pull.shape[1]
    return 2 * np.eye(m), np.zeros((n, m)), np.zeros(n)


def _force(lines: Lines, pairs: NDArray[np.intp]) -> Quadratic:
    return _squares(lines.tension, lines.pull)


def _difference(lines: Lines, pairs: NDArray[np.intp]) -> Quadratic:
    one, other = pairs.T
    return _squares(lines.tension[:, one] - lines.tension[:, other], lines.pull[one] - lines.pull[other])


def _squares(value: Array, slope: Array) -> Quadratic:
    """Sum of squares of values (n, k) that grow by slopes (k, motors)."""
    return 2 * slope.T @ slope, -2 * value @ slope, np.asarray((value**2).sum(axis=1))


CRITERIA: Registry[Criterion] = Registry(
    "criterion",
    {
        "least-change": Criterion("least sum of squared changes of the motors from their pretension", _change, "rad^2"),
        "least-force": Criterion("least sum of squared tensions, antagonists co-contracted", _force, "N^2", "least"),
        "co-contraction": Criterion("antagonists co-contracted by just so much", _force, "N^2", "given"),
        "least-difference": Criterion(
            "least sum of squared differences between the tensions of antagonists, co-contracted",
            _difference,
            "N^2",
            "least",
        ),
    },
    Criterion,
)
"""Name to criterion; the first is what a plant holds its eye by."""


@dataclass(frozen=True)
class Holding:
    """What is to be known of eyes that are held.

    Attributes:
        balanced: no torque is left, (n,).
        slack: a cable hangs, (n,).
        stiffness: about the axis where the eye is softest [N m/rad], (n,); not above 0 it is not stable.
        inside: the motors are inside their limits, (n,).
    """

    balanced: NDArray[np.bool_]
    slack: NDArray[np.bool_]
    stiffness: Array
    inside: NDArray[np.bool_]

    @property
    def good(self) -> NDArray[np.bool_]:
        """The eye comes to rest there, and no cable hangs, (n,)."""
        return self.balanced & ~self.slack & (self.stiffness > 0) & self.inside

    def fault(self, i: int) -> str:
        """What is wrong with one of them, for people."""
        if not self.balanced[i] or self.slack[i]:
            return "a cable hangs slack there"
        if not self.inside[i]:
            return "a motor would have to leave its range"
        return f"the eye is not stable there: its stiffness is {self.stiffness[i]:.3g} N m/rad, it would turn farther"


@dataclass(frozen=True)
class Cables:
    """The statics of an eye with more motors than axes.

    Attributes:
        plant: its name, for messages.
        motors: of the eye.
        torque: on an eye at rest, (n, 4), (n, motors) to [N m] (n, 3).
        tension: the same to [N] (n, tendons).
        muscles: its cables, where they are pairs of antagonists.
    """

    plant: str
    motors: tuple[Motor, ...]
    torque: Torque
    tension: Torque
    muscles: Muscles | None

    def lines(self, orientation: Array) -> Lines:
        """Of eyes in orientations (n, 4)."""
        n, m = len(orientation), len(self.motors)
        rest = rests(self.motors)
        high = ranges(self.motors)[:, 1]
        far = _TAUT * np.where(np.isfinite(high), high - rest, 360.0)
        taut = rest + far + far / 2 * np.eye(m + 1, m, -1)
        flat, motor = np.repeat(orientation, m + 1, axis=0), np.tile(taut, (n, 1))
        torque = self.torque(flat, motor).reshape(n, m + 1, 3)
        tension = self.tension(flat, motor).reshape(n, m + 1, -1)
        back = np.deg2rad(far)
        moment = np.swapaxes(torque[:, 1:] - torque[:, :1], 1, 2) / (back / 2)
        pull = (tension[:, 1:] - tension[:, :1]).mean(axis=0).T / (back / 2) if n else np.zeros((tension.shape[2], m))
        return Lines(tension[:, 0] - pull @ back, pull, torque[:, 0] - moment @ back, moment)

    @property
    def pairs(self) -> NDArray[np.intp]:
        """Antagonists (`orient_eye.eyes.muscles`), (pairs, 2).

        Raises:
            InputError: the motors are not pairs of antagonists.
        """
        if self.muscles is None:
            raise InputError(
                f"the motors of plant {self.plant!r} ({', '.join(names(self.motors))}) are not pairs of antagonists "
                "with a cable each, in the cables' order; --gaze and --motors answer by the criterion least-change"
            )
        return self.muscles.pairs

    @property
    def pretension(self) -> float:
        """Of antagonists at rest, in the mean [rad]."""
        return float(np.deg2rad(rests(self.motors)).mean())

    def posture(
        self,
        orientation: Array,
        criterion: str | Criterion = "least-change",
        co_contraction: float | None = None,
        driven: Sequence[int] | None = None,
    ) -> tuple[Array, Array]:
        """Motors (n, motors) that hold orientations (n, 4) by a criterion, and its cost (n,).

        Whether the eye stays there is another question: `state`.

        Args:
            orientation: of the eyes.
            criterion: one of `CRITERIA`.
            co_contraction: for a criterion that has one, mean angle of antagonists [rad]; None for their pretension.
            driven: motors that move, four or more; the others stand at their rest. None for all.

        Raises:
            InputError: an unknown criterion, or a co-contraction that is none.
        """
        rule = CRITERIA[criterion] if isinstance(criterion, str) else criterion
        index = np.arange(len(self.motors)) if driven is None else np.asarray(driven)
        lines, rest = self.lines(orientation), np.deg2rad(rests(self.motors))
        lines = Lines(lines.tension, lines.pull[:, index], lines.torque, lines.moment[..., index])
        if not rule.co_contraction:
            P, q, constant = rule.cost(lines, np.empty((0, 2), int))
            bounds, level = np.zeros((0, len(index))), np.zeros(0)
        else:
            pairs = self.pairs
            if len(index) < len(self.motors):
                raise InputError("antagonists are co-contracted by all motors; leave driven out, or take least-change")
            least = self.pretension if co_contraction is None else co_contraction
            least = real("the co-contraction", least, 0, MOST_RAD, unit="rad")
            P, q, constant = rule.cost(lines, pairs)
            bounds = np.zeros((len(pairs), len(index)))
            bounds[np.arange(len(pairs))[:, None], pairs] = 0.5
            level = least - bounds @ rest
        P = P + _SOFT * np.trace(P) * np.eye(len(index))
        best, found = np.full(len(orientation), np.inf), np.full((len(orientation), len(index)), np.nan)
        sets = list(chain.from_iterable(combinations(range(len(level)), k) for k in range(len(level) + 1)))
        for touched in sets[-1:] if rule.co_contraction == "given" else sets:
            x = _solved(P, q, lines, bounds[list(touched)], level[list(touched)])
            value = np.einsum("ni,ij,nj->n", x, P, x) / 2 - (q * x).sum(axis=1)
            better = (x @ bounds.T >= level - 1e-9).all(axis=1) & (value < best)
            best[better], found[better] = value[better], x[better]
        motor = np.tile(rests(self.motors), (len(orientation), 1))
        motor[:, index] += found * _UNIT
        return motor, best + constant

    def state(self, orientation: Array, motor: Array, limit: Array | None = None) -> Holding:
        """Of eyes in orientations (n, 4), the motors at (n, motors) [deg], inside limits (motors, 2) or theirs."""
        limit = ranges(self.motors) if limit is None else limit
        known = np.asarray(np.isfinite(motor).all(axis=1))
        at = np.where(known[:, None], motor, rests(self.motors))
        balanced = known & (np.abs(self.torque(orientation, at)).max(axis=1, initial=0.0) < _TORQUE)
        inside = known & ((at >= limit[:, 0] - 1e-9) & (at <= limit[:, 1] + 1e-9)).all(axis=1)
        slack = ~known | (self.tension(orientation, at).min(axis=1, initial=np.inf) <= LOOSE_N)
        return Holding(balanced, slack, np.where(known, least_stiffness(self.torque, orientation, at), np.nan), inside)

    def stiffness(self, orientation: Array, motor: Array) -> Array:
        """By how much the cables turn eyes back [N m/rad], head frame, (n, 3, 3)."""
        return stiffness(self.torque, orientation, motor)

    def held(self, orientation: Array, driven: Sequence[int], limit: Array) -> Array:
        """Motors [deg] (n, motors) of least change that hold orientations (n, 4) inside limits (motors, 2).

        NaN where they are slack or the eye is not stable.

        Raises:
            InputError: numbers that are not finite.
        """
        orientation = np.asarray(orientation, dtype=float)
        if not np.isfinite(orientation).all():
            raise InputError("an orientation to hold holds numbers that are not finite")
        motor, _ = self.posture(orientation, driven=driven)
        return np.where(self.state(orientation, motor, limit).good[:, None], motor, np.nan)

    def hold(self, orientation: Array, driven: Sequence[int], limit: Array) -> Array:
        """As `held`.

        Raises:
            InputError: an orientation that is not held, and why.
        """
        motor = self.held(orientation, driven, limit)
        held = np.isfinite(motor).all(axis=1)
        if not held.all():
            worst = int(held.argmin())
            one = np.asarray(orientation, dtype=float)[worst : worst + 1]
            fault = self.state(one, self.posture(one, driven=driven)[0], limit).fault(0)
            raise InputError(
                f"orientation {np.round(one[0], 4).tolist()} (w, x, y, z) is not held by motors "
                f"{', '.join(self.motors[i].name for i in driven)} of plant {self.plant!r}: {fault}; choose one nearer "
                "to straight ahead"
            )
        return motor


def muscles_of(plant: Plant) -> Muscles | None:
    """Those of the eye that a plant draws, if they are what moves it; None for any other plant."""
    found = Muscles.of(plant.drawn())
    return found if found is not None and found.names == names(plant.motors) else None


def _solved(P: Array, q: Array, lines: Lines, bounds: Array, level: Array) -> Array:
    """Motors off their rest [rad] (n, motors) of the least cost without torque, on bounds x = level."""
    n, m, k = len(q), len(P), len(bounds)
    system = np.zeros((n, m + 3 + k, m + 3 + k))
    system[:, :m, :m] = P
    system[:, m : m + 3, :m] = lines.moment
    system[:, m + 3 :, :m] = bounds
    system[:, :m, m:] = np.swapaxes(system[:, m:, :m], 1, 2)
    right = np.concatenate([q, -lines.torque, np.tile(level, (n, 1))], axis=1)
    return np.asarray(np.linalg.solve(system, right[..., None])[:, :m, 0])
