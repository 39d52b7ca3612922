"""Plants: what a motor command does to the eye.

    plant = make_plant("mujoco")                     # or "lpf", "tavares": `PLANTS`
    movement = plant.move(command)                   # a command, or positions (saccades, time, motors) [deg]
    movement.measure(); movement.trajectory()

Every plant is a `Plant`; the name picks its kind from `PLANTS`. To add one: a class with the members of
`Plant` (`simulated.SimulatedPlant` has most of them for a plant that is stepped through time) and a
`PlantKind` in that table, or in the entry points `orient_eye.plants` of a package of your own. Environment,
trainer, sysid and command line then know it, and nothing outside its file asks what kind it is.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from orient_eye.constants import EYE
from orient_eye.errors import InputError
from orient_eye.eyes import EYES
from orient_eye.registry import Registry, load

if TYPE_CHECKING:  # names and options are listed without the libraries that compute
    import mujoco
    import numpy as np
    from numpy.typing import NDArray

    from orient_eye.motor import Motor
    from orient_eye.movement import Movement
    from orient_eye.state import State

    Array = NDArray[np.float64]


@dataclass(frozen=True)
class PulseRates:
    """Bounds of B and k0 [1/s] in which the best pulse-steps of a plant lie; on a logarithmic scale."""

    B: tuple[float, float]
    k0: tuple[float, float]

    @classmethod
    def around(cls, rates: Sequence[float]) -> PulseRates:
        """Of a plant whose poles have these sizes [1/s].

        A motor at its speed limit makes a B of many times the poles and a k0 of a tenth of them the best (the pulse
        saturates the motor); an eye that swings wants a B and a k0 near them.
        """
        slowest, fastest = min(rates), max(rates)
        return cls((0.4 * slowest, 25 * fastest), (0.05 * slowest, 3 * fastest))


UPDATES, EVALUATION_PAIRS = 7000, 60
"""Of a simulated eye."""


@runtime_checkable
class Plant(Protocol):
    """From a batch of motor commands to movements of the eye.

    Safe to share: several threads may use one plant at once, a forked child may go on with its parent's, and a pickled
    or copied one is the same plant, `doubt` included. The results are those of one call after the other, bit for bit.

    Attributes:
        name: key in `PLANTS`.
        motors: what moves the eye, (motors,).
        step_s: interval between the samples of its trajectories [s].
        horizon_s: how long a saccade has to last so that it can be measured; None where it needs no horizon.
        updates: of the networks that learn on it, where nobody says how many.
        evaluation_pairs: how many random saccades are worth holding against the searched optimum.
        slow_pole: the pole [1/s] that k0 can cancel (thesis 4.2), on a plant that is linear and has one such; None
            where what k0 should be has to be found.
        pulse_rates: bounds of B and of k0 [1/s] that hold the best pulse-steps, where the thesis' (18 to 80, 5 to 40)
            do not; None where they do.
        doubt: share of the amplitude by which a measure may be wrong because a simulated saccade was not stepped on; a
            copy of the plant may take it more lightly, to learn on (`orient_eye.learning.training`).
    """

    name: str
    motors: tuple[Motor, ...]
    step_s: float
    horizon_s: float | None
    updates: int
    evaluation_pairs: int
    slow_pole: float | None
    pulse_rates: PulseRates | None
    doubt: float

    def move(
        self,
        command: Any,
        start: State | None = None,
        horizon_s: float | None = None,
        random: np.random.Generator | None = None,
    ) -> Movement:
        """Perform a batch of saccades.

        Args:
            command: an `orient_eye.commands.Command` of all motors, or positions (saccades, time, motors) in their
                units, row k at time k * step_s.
            start: state at time 0; None for rest at the command's beginning.
            horizon_s: how long; None for as long as the command says something, or the plant's own horizon.
            random: of a plant that is noisy; the others need none.

        Returns:
            The movement. A saccade that diverged, or whose command is not finite, is marked failed and is NaN; the
            others are not touched by it.

        Raises:
            InputError: wrong shape, or a written command outside the mechanical range.
        """
        ...

    def rest(self, motor: Array) -> Array:
        """Orientations (saccades, 4) in which the eye rests at motor positions (saccades, motors)."""
        ...

    def hold(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """Positions (saccades, motors) at which the eye rests in these orientations (saccades, 4).

        Only the driven motors move, the others stand at their rest; the inverse of `rest`.

        Raises:
            InputError: an orientation that the driven motors cannot hold.
        """
        ...

    def held(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """As `hold`, inside the motors' working range; NaN where that is out of reach."""
        ...

    def force(self, orientation: Array, motor: Array) -> Array | None:
        """Of fixations: what it costs to hold them, (saccades,); None for a plant whose elastics are not known.

        Where each motor pulls a pair of elastics the sum over pairs of the squared difference of their tensions [N^2];
        where there are more motors than axes the sum of the motors' squared changes from their pretension [rad^2].

        Args:
            orientation: of eyes at rest, (saccades, 4).
            motor: that hold them, (saccades, motors).
        """
        ...

    def turning_rates(self, orientation: Array, motor: Array) -> Array | None:
        """How fast a resting eye without inertia goes back to rest about x, y and z [1/s], (saccades, 3).

        None for a plant whose elastics are not known; arguments as `force`'s.
        """
        ...

    def motor_rates(self) -> Array:
        """Size of the pole [1/s] by which the eye follows each motor above all, at rest, (motors,); NaN if unknown."""
        ...

    def identity(self) -> dict[str, Any]:
        """What makes this plant this one, in plain values: `plant`, its name, and what its kind restores it from."""
        ...

    def twin(self) -> Plant | None:
        """A quicker plant of the same eye, on which what is good here may be looked for; None where there is none."""
        ...

    def drawn(self) -> mujoco.MjModel:
        """The eye that recordings draw, with its shapes (`orient_eye.eyes.model.build_model`)."""
        ...


@dataclass(frozen=True)
class Option:
    """A keyword of a plant, for the command line.

    Attributes:
        name: of the keyword; the option is the same with dashes.
        type: bool, int, float or str.
        default: what the plant takes it to be.
        help: for people.
    """

    name: str
    type: Any
    default: Any
    help: str


@dataclass(frozen=True)
class PlantKind:
    """An entry of `PLANTS`.

    Attributes:
        summary: what it is, for people.
        make: from the options, as keywords, to the plant; or where that stands, as "module:attribute".
        options: what can be chosen on the command line.
        restore: from `Plant.identity` to the plant; None where that is `make` with all but `plant` and `model`.
    """

    summary: str
    make: Callable[..., Plant] | str
    options: tuple[Option, ...] = ()
    restore: Callable[[dict[str, Any]], Plant] | str | None = None


_EYE = Option("eye", str, EYE, f"Preset of the eye ({', '.join(EYES)}), or an MJCF file of the same form.")
_RIG = Option("rig", str, None, "Limits of its motors: a rig's TOML file, or a shipped one (prototype).")
_GRAVITY = Option("gravity", bool, False, "With the gravity torque.")
_PRETENSION = Option("pretension", float, None, "Of an eye that has several: 1 or 2 of six.")

PLANTS: Registry[PlantKind] = Registry(
    "plant",
    {
        "lpf": PlantKind(
            "the low-pass surrogate",
            "orient_eye.plants.linear:LinearPlant",
            (
                Option("surrogate", str, "thesis", "A surrogate.json written by sysid, or the name of a shipped one."),
                _RIG,
            ),
            restore="orient_eye.plants.linear:restore",
        ),
        "mujoco": PlantKind(
            "the whole eye in MuJoCo",
            "orient_eye.plants.mujoco:MujocoPlant",
            (
                _EYE,
                Option("accurate", bool, False, "Integrate at 0.2 ms instead of the thesis' 1 ms."),
                _GRAVITY,
                _PRETENSION,
                _RIG,
            ),
        ),
        "tavares": PlantKind(
            "the thesis' simulator, compiled: an independent reference, and a fast one",
            "orient_eye.plants.tavares:TavaresPlant",
            (
                _EYE,
                Option("accurate", bool, False, "Integrate by Runge-Kutta's method instead of the thesis' Euler step."),
                _GRAVITY,
                Option("as_published", bool, False, "The author's program to the letter."),
                _PRETENSION,
                _RIG,
            ),
        ),
        "viscous": PlantKind(
            "the eye without its inertia, compiled: a non-linear surrogate",
            "orient_eye.plants.viscous:ViscousPlant",
            (_EYE, _GRAVITY, _PRETENSION, _RIG),
        ),
        "modal": PlantKind(
            "three low-pass surrogates in parallel, for all motors",
            "orient_eye.plants.modal:ModalPlant",
            (Option("surrogate", str, "thesis-3d", "A surrogate_3d.json of sysid --all-motors, or a shipped one."),),
            restore="orient_eye.plants.modal:restore",
        ),
    },
    PlantKind,
)
"""Name to kind of plant."""


def make_plant(name: str, **options: Any) -> Plant:
    """The plant of that name.

    Args:
        name: one of `PLANTS`.
        options: keywords of its class; those on the command line are in its `PlantKind.options`.

    Raises:
        InputError: unknown name or option.
    """
    kind = PLANTS[name]
    return _made(name, load(kind.make) if isinstance(kind.make, str) else kind.make, options)


def restore_plant(identity: dict[str, Any], **instead: Any) -> Plant:
    """The plant of an identity, as `Plant.identity` gives it.

    Args:
        identity: plain values.
        instead: options of its kind that take the place of the identity's.

    Raises:
        InputError: unknown plant, an identity its kind knows nothing of, or an option it has not.
    """
    name = str(identity.get("plant"))
    kind = PLANTS[name]
    if kind.restore is not None:
        restore = load(kind.restore) if isinstance(kind.restore, str) else kind.restore
        return _made(name, restore, {"identity": identity, **instead})
    options = {key: value for key, value in identity.items() if key not in ("plant", "model")} | instead
    known = [option.name for option in kind.options]
    if set(options) - set(known):  # an identity can be a stranger's: it chooses options, and nothing else of a class
        raise InputError(f"plant {name!r} has the options {', '.join(known) or '(none)'}, got {', '.join(options)}")
    return make_plant(name, **options)


def _made(name: str, make: Callable[..., Plant], options: dict[str, Any]) -> Plant:
    try:
        inspect.signature(make).bind(**options)
    except TypeError as error:
        known = ", ".join(option.name for option in PLANTS[name].options) or "none"
        raise InputError(f"plant {name!r}: {error}; its options are {known}") from error
    return make(**options)
