"""orient-eye listing."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from orient_eye.checks import real
from orient_eye.cli.another_plant import AnotherPlant
from orient_eye.cli.listing_sequences import sequences_of
from orient_eye.cli.listing_statics import LIMIT_DEG
from orient_eye.cli.saccades import direction
from orient_eye.errors import InputError

if TYPE_CHECKING:
    from orient_eye.plants import Plant


def _asked(metavar: str) -> Any:
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="(optional)")


@dataclass(frozen=True)
class Listing:
    """Torsion of an eye that turns about all axes, and Listing's law: what the eye can do, or what a policy does.

    Without POLICY: the statics of an eye. Where it can look, at which torsion the motors hold a direction, at which
    with the least force, and whether those orientations lie in a plane (--plant tavares, unless another is named).
    Leaves a run directory: result.json, statics.csv, workspace.png, torsion.png, plane.png. --gaze and --motors answer
    one question instead, and leave nothing.

    Of an eye with more motors than axes (--plant tavares --eye six) they share the work by a criterion. Leaves
    result.json, statics.csv, reach.png, planes.png, motors.png, antagonists.png, stiffness.png (docs/six.md).

    With POLICY, of all motors: a sequence of saccades, each from where the one before came to rest. Leaves result.json,
    sequence.csv, pictures, and a Rerun recording of the first saccades. What the numbers mean: docs/listing.md.

    $ orient-eye listing --plant tavares --eye eve_v3

    $ orient-eye listing --gaze 35 -35

    $ orient-eye listing --motors 12 20 -10

    $ orient-eye listing --plant tavares --eye six --criterion least-force --co-contraction 1.5

    $ orient-eye listing runs/my-run --saccades 200 --start fick
    """

    policy: Annotated[
        str | None, tyro.conf.Positional, tyro.conf.arg(metavar="POLICY", help_behavior_hint="(optional)")
    ] = None
    """Run directory, policy folder, or name of a shipped policy."""
    gaze: Annotated[tuple[float, ...] | None, _asked("YAW PITCH")] = None
    """Which motors hold this direction, deg, positive to the left and down; at the torsion of the least force, or at
    --torsion."""
    torsion: Annotated[float | None, _asked("ANGLE")] = None
    """Torsion for --gaze, deg; 0 obeys Listing's law."""
    motors: Annotated[tuple[float, ...] | None, _asked("POSITION ...")] = None
    """Where the eye rests with its motors at these positions, deg."""
    limit: Annotated[float | None, tyro.conf.arg(help_behavior_hint=f"(default: {LIMIT_DEG:g})")] = None
    """The plane is fitted to directions up to this angle from straight ahead, deg."""
    criterion: Annotated[str | None, _asked("NAME")] = None
    """How more motors than axes share the work: least-change (of their pretension; the default), least-force,
    co-contraction or least-difference."""
    co_contraction: Annotated[float | None, _asked("ANGLE")] = None
    """For a criterion that has one: mean angle of antagonists' spindles, in rad, as pretensions 1 and 2 are named;
    least-force keeps at least that, co-contraction just that. Left out: their pretension."""
    saccades: int = 200
    """Saccades in a sequence of the policy."""
    sequences: int = 1
    """Sequences, side by side."""
    start: Literal["ahead", "fick"] = "ahead"
    """The first saccades start straight ahead, or aside at the torsion of Fick's gimbal."""
    seed: int = 0
    """Of the generator that draws the targets."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/listing-DATE-TIME)")] = None
    """Run directory, new or empty."""
    another_plant: AnotherPlant = field(default_factory=AnotherPlant)
    quiet: bool = False
    """Show no progress bar."""

    def run(self) -> dict[str, Any]:
        """Answer, or measure and write the run directory."""
        asked = {
            "--gaze": self.gaze, "--motors": self.motors, "--limit": self.limit, "--criterion": self.criterion,
            "--co-contraction": self.co_contraction,
        }  # fmt: skip
        given = [name for name, value in asked.items() if value is not None]
        if self.torsion is not None and self.gaze is None:
            raise InputError("--torsion is that of a direction of gaze; name the direction too, by --gaze YAW PITCH")
        if given and self.policy is not None:
            raise InputError(f"{given[0]} asks about the eye alone; leave the policy out, or {given[0]}")
        if self.policy is not None:
            return sequences_of(self, self.policy)
        if len(given) > 1 and given[1] in ("--motors", "--limit"):
            raise InputError(f"{given[0]} and {given[1]} ask different questions; give one of them")
        if self.motors is not None and len(given) > 1:
            raise InputError(f"with --motors nothing is shared out by a criterion; leave {given[1]} out")
        plant = self._plant()
        from orient_eye.cli import listing_muscles as of_more
        from orient_eye.cli import listing_statics as of_three
        from orient_eye.statics import cables_of, check_criterion

        cables = cables_of(plant)
        check_criterion(cables, self.criterion, self.co_contraction)
        if self.gaze is not None:
            yaw, pitch = direction(("yaw_deg", "pitch_deg"), self.gaze, "gaze")
            for name, angle in (("yaw", yaw), ("pitch", pitch), ("torsion", self.torsion or 0.0)):
                real(name, angle, -90.0, 90.0, unit="deg")
            if cables is None:
                return of_three.hold(plant, yaw, pitch, self.torsion)
            return of_more.hold(self, plant, cables, yaw, pitch)
        if self.motors is not None:
            if cables is None:
                return of_three.rest(plant, self.motors)
            return of_more.rest(plant, cables, self.motors)
        return of_three.statics_of(self, plant) if cables is None else of_more.statics_of(self, plant, cables)

    def _plant(self) -> "Plant":
        from orient_eye.plants import make_plant
        from orient_eye.statics import require_elastics

        plant = make_plant(self.another_plant.plant or "tavares", **self.another_plant.plant_options)
        require_elastics(plant)
        return plant
