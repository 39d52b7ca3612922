"""orient-eye listing."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from orient_eye.checks import real, whole
from orient_eye.cli.another_plant import AnotherPlant
from orient_eye.cli.saccades import direction
from orient_eye.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from orient_eye.learning.sequences import Sequence
    from orient_eye.plants import Plant
    from orient_eye.statics import Held, Workspace

_LIMIT_DEG = 30.0
_HORIZON_S = 1.5  # of the saccades of a sequence
_SHOWN = 12  # saccades of a sequence
_MOST = 10_000  # saccades of all sequences
_COLUMNS = 4  # saccades beside each other


def _asked(metavar: str) -> Any:
    return tyro.conf.arg(metavar=metavar, help_behavior_hint="(optional)")


@dataclass(frozen=True)
class Listing:
    """Torsion of an eye with three motors, and Listing's law: what the eye can do, or what a policy does.

    Without POLICY: the statics of an eye. Where it can look, at which torsion the motors hold a direction, at which
    with the least force, and whether those orientations lie in a plane (--plant tavares, unless another is named).
    Leaves a run directory: result.json, statics.csv, workspace.png, torsion.png, plane.png. --gaze and --motors answer
    one question instead, and leave nothing.

    With POLICY, of all motors: a sequence of saccades, each from where the one before came to rest. Leaves result.json,
    sequence.csv, pictures, and a Rerun recording of the first saccades. What the numbers mean: docs/listing.md.

    $ orient-eye listing --plant tavares --eye eve_v3

    $ orient-eye listing --gaze 35 -35

    $ orient-eye listing --motors 12 20 -10

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
    limit: Annotated[float | None, tyro.conf.arg(help_behavior_hint=f"(default: {_LIMIT_DEG:g})")] = None
    """The plane is fitted to directions up to this angle from straight ahead, deg."""
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
        asked = {"--gaze": self.gaze, "--motors": self.motors, "--limit": self.limit}
        given = [name for name, value in asked.items() if value is not None]
        if self.torsion is not None and self.gaze is None:
            raise InputError("--torsion is that of a direction of gaze; name the direction too, by --gaze YAW PITCH")
        if given and self.policy is not None:
            raise InputError(f"{given[0]} asks about the eye alone; leave the policy out, or {given[0]}")
        if self.policy is not None:
            return self._sequences(self.policy)
        if len(given) > 1:
            raise InputError(f"{given[0]} and {given[1]} ask different questions; give one of them")
        plant = self._plant()
        if self.gaze is not None:
            return self._hold(plant, *direction(("yaw_deg", "pitch_deg"), self.gaze, "gaze"))
        if self.motors is not None:
            return _rest(plant, self.motors)
        return self._statics(plant)

    def _plant(self) -> "Plant":
        from orient_eye.plants import make_plant
        from orient_eye.statics import require_elastics

        plant = make_plant(self.another_plant.plant or "tavares", **self.another_plant.plant_options)
        require_elastics(plant)
        return plant

    def _hold(self, plant: "Plant", yaw: float, pitch: float) -> dict[str, Any]:
        """Motors for a direction."""
        import numpy as np

        from orient_eye.cli.tables import say
        from orient_eye.listing import directions, with_torsion
        from orient_eye.motor import names
        from orient_eye.statics import Held

        for name, angle in (("yaw", yaw), ("pitch", pitch), ("torsion", self.torsion or 0.0)):
            real(name, angle, -90.0, 90.0, unit="deg")
        held = Held.of(plant, directions([yaw], [pitch]))
        least, largest = held.range[0]
        if np.isnan(least):
            raise InputError(
                f"the motors of plant {plant.name!r} hold yaw {yaw:g}, pitch {pitch:g} deg at no torsion within their "
                "working range; choose a direction nearer to straight ahead"
            )
        torsion, motor, force = held.torsion[0], held.motor, held.force
        if self.torsion is not None:
            torsion, orientation = self.torsion, with_torsion(held.direction, [self.torsion])
            motor = plant.held(orientation, names(plant.motors))
            if np.isnan(motor).any():
                raise InputError(
                    f"at yaw {yaw:g}, pitch {pitch:g} deg the motors of plant {plant.name!r} hold torsions from "
                    f"{least:.2f} to {largest:.2f} deg, got {self.torsion:g}; choose one of those, or no --torsion"
                )
            found = plant.force(orientation, motor)
            force = held.force if found is None else found
        told = ", ".join(f"{m.name} {x:.3f} {m.unit}" for m, x in zip(plant.motors, motor[0], strict=True))
        say(f"yaw {yaw:g}, pitch {pitch:g}, torsion {torsion:.3f} deg is held by {told}, with {force[0]:.4f} N^2")
        say(f"least force: {held.force[0]:.4f} N^2, at torsion {held.torsion[0]:.3f} deg")
        say(f"the motors hold this direction at torsions from {least:.2f} to {largest:.2f} deg")
        return {
            "plant": plant.identity(),
            "gaze_deg": [yaw, pitch],
            "torsion_deg": float(torsion),
            "motors": dict(zip(names(plant.motors), motor[0].tolist(), strict=True)),
            "force_n2": float(force[0]),
            "least_force_n2": float(held.force[0]),
            "least_force_torsion_deg": float(held.torsion[0]),
            "torsion_range_deg": [float(least), float(largest)],
        }

    def _statics(self, plant: "Plant") -> dict[str, Any]:
        """The statics of an eye."""
        from dataclasses import asdict

        from orient_eye import statics
        from orient_eye.cli.tables import say
        from orient_eye.files import write_table
        from orient_eye.listing import fit_plane, with_torsion
        from orient_eye.run_directory import RunDirectory

        limit = _LIMIT_DEG if self.limit is None else self.limit
        space = statics.Workspace.of(plant)
        largest = float(space.reach_deg.min())
        can = f"the motors hold every direction up to {largest:.1f} deg"
        real("--limit", limit, 1.0, largest, unit="deg", advice=can)
        run = RunDirectory.create(self.out, "listing", {**asdict(self), "limit": limit})
        held = statics.Held.of(plant, statics.cone(limit))
        rows = _held_rows(plant, _corners(plant, limit))
        turn = statics.degrees_per_motor(plant)
        result = {
            "out": str(run.path),
            "plant": plant.identity(),
            "limit_deg": limit,
            "largest_cone_deg": largest,
            "farthest_deg": float(space.reach_deg.max()),
            "degrees_per_motor": [
                {"motor": motor.name, "torsion": t, "down": d, "left": x}
                for motor, (t, d, x) in zip(plant.motors, turn.tolist(), strict=True)
            ],
            "least_force": asdict(fit_plane(held.orientation)),
            "directions": rows,
        }
        _say_statics(plant, result)
        write_table(run.path / "statics.csv", _space_rows(plant, space))
        from orient_eye.figures import gaze, save

        law = {"Listing": with_torsion(held.direction, 0.0)}
        pictures = {
            "workspace": gaze.workspace(space, limit),
            "torsion": gaze.torsion_maps(space, limit),
            "plane": gaze.listing_plane(held.orientation, compared=law),
        }
        for name, figure in pictures.items():
            save(figure, run.path / f"{name}.png")
        run.write_json("result.json", result)
        say(f"in {run.path}: result.json, statics.csv, {', '.join(f'{name}.png' for name in pictures)}")
        return result

    def _sequences(self, name: str) -> dict[str, Any]:
        """What a policy does."""
        from dataclasses import asdict, replace

        import numpy as np

        from orient_eye.cli.tables import say
        from orient_eye.files import write_table
        from orient_eye.learning import sequences as made_by
        from orient_eye.learning.policy import Policy
        from orient_eye.progress import progress_bar
        from orient_eye.recording.sequence import record_sequence
        from orient_eye.run_directory import RunDirectory
        from orient_eye.task.table import rows_of
        from orient_eye.words import plant_in_words

        whole("--seed", self.seed, 0)
        whole("--sequences", self.sequences, 1, _MOST)
        fewest = -(-made_by.FEWEST // self.sequences)
        plane = f"a plane is fitted through {made_by.FEWEST} saccades or more, and {_MOST} take 1 GB"
        whole("--saccades", self.saccades, fewest, _MOST // self.sequences, advice=plane)
        policy = Policy.load(name)
        task, differences = self.another_plant.task(policy)
        random = np.random.default_rng(self.seed)
        start, target = made_by.drawn(task, self.sequences, self.saccades, random)
        if self.start == "fick":
            start = made_by.ficks_starts(task, self.sequences, random)
        run = RunDirectory.create(self.out, "listing", asdict(self), seed=self.seed)
        with progress_bar("making saccades", quiet=self.quiet) as advance:
            longer = replace(task, horizon_s=max(task.horizon_s, _HORIZON_S))  # so that each is seen to come to rest
            made = made_by.sequence(longer, policy.act, target, start, advance)
        result = {
            "out": str(run.path),
            "policy": name,
            "plant": task.plant.name,
            "task": longer.identity(),
            "differs_from_training": differences,
            "start": self.start,
            **made_by.listing_numbers(made),
            "stretching": made_by.stretching(made, policy.act),
            "imposed": made_by.imposed(task),
        }
        _say_sequences(result)
        run.write_json("result.json", result)
        write_table(run.path / "sequence.csv", rows_of(made_by.torsion_columns(made)))
        from orient_eye.figures import save

        pictures = _pictures(made)
        for picture, figure in pictures.items():
            save(figure, run.path / f"{picture}.png")
        shown = slice(min(_SHOWN, len(made)))
        record_sequence(
            run.path / "sequence.rrd",
            made.trajectory[shown],
            model=task.plant.drawn(),
            target=made.target[shown],
            notes=f"Saccades of a policy on plant `{plant_in_words(task.plant.identity())}`, one after the other.",
        )
        files = ", ".join(f"{picture}.png" for picture in pictures)
        say(f"in {run.path}: result.json, sequence.csv, {files}, sequence.rrd")
        say(f"the numbers are of all saccades, pictures over time and the recording of the first {shown.stop}")
        say(f"look at the saccades: orient-eye view {run.path}/sequence.rrd")
        return result


def _rest(plant: "Plant", position: tuple[float, ...]) -> dict[str, Any]:
    """Where an eye rests."""
    import numpy as np

    from orient_eye.cli.tables import say
    from orient_eye.listing import torsion
    from orient_eye.motor import names
    from orient_eye.rotations import to_euler

    if len(position) != len(plant.motors):
        told = ", ".join(names(plant.motors))
        raise InputError(f"plant {plant.name!r} has {len(plant.motors)} motors ({told}), got {len(position)} positions")
    for motor, where in zip(plant.motors, position, strict=True):
        real(motor.name, where, *motor.range, unit=motor.unit, advice="that is how far it turns")
    at = np.array([position], dtype=float)
    orientation = plant.rest(at)
    yaw, pitch, _ = (float(angle[0]) for angle in to_euler(orientation))
    rolled = float(torsion(orientation)[0])
    force = plant.force(orientation, at)
    result = {
        "plant": plant.identity(),
        "motors": dict(zip(names(plant.motors), position, strict=True)),
        "gaze_deg": [yaw, pitch],
        "torsion_deg": rolled,
        "orientation": orientation[0].tolist(),
        "force_n2": None if force is None else float(force[0]),
    }
    told = "" if force is None else f", with {force[0]:.4f} N^2"
    say(f"the eye rests at yaw {yaw:.3f}, pitch {pitch:.3f}, torsion {rolled:.3f} deg{told}")
    return result


def _corners(plant: "Plant", limit: float) -> "Held":
    """Straight ahead, and eight directions around it."""
    import numpy as np

    from orient_eye.movement.oblique import toward
    from orient_eye.statics import Held

    around = np.pi / 4 * np.arange(8)
    return Held.of(
        plant, toward(np.concatenate([[[0, 0]], limit * np.stack([np.cos(around), np.sin(around)], axis=1)]))
    )


def _held_rows(plant: "Plant", held: "Held") -> list[dict[str, Any]]:
    """Rows of directions that are held."""
    from orient_eye.movement.oblique import seen_from
    from orient_eye.rotations import to_euler
    from orient_eye.task.table import rows_of

    yaw, pitch, _ = to_euler(held.orientation)
    left, up = seen_from(held.direction).T
    columns = {
        "yaw_deg": yaw,
        "pitch_deg": pitch,
        "left_deg": left,
        "up_deg": up,
        **{motor.column: held.motor[:, i] for i, motor in enumerate(plant.motors)},
        "torsion_deg": held.torsion,
        "force_n2": held.force,
        "least_torsion_deg": held.range[:, 0],
        "largest_torsion_deg": held.range[:, 1],
    }
    return rows_of({name: values.round(9) + 0.0 for name, values in columns.items()})  # no -0


def _space_rows(plant: "Plant", space: "Workspace") -> list[dict[str, Any]]:
    """Rows of a workspace, straight ahead once."""
    return _held_rows(plant, space.held)[space.shift.shape[1] - 1 :]


def _say_statics(plant: "Plant", result: dict[str, Any]) -> None:
    from orient_eye.cli.tables import column, say, table

    turn = {"motor": lambda row: row["motor"], **{key: column(key, "+.3f") for key in ("torsion", "down", "left")}}
    say(table("The eye at rest turns by so many deg for a degree of a motor.", turn, result["degrees_per_motor"]))
    columns = {
        "yaw, pitch [deg]": lambda row: f"{row['yaw_deg']:.1f}, {row['pitch_deg']:.1f}",
        **{f"{motor.name} [{motor.unit}]": column(motor.column, ".2f") for motor in plant.motors},
        "torsion [deg]": column("torsion_deg", "+.2f"),
        "force [N^2]": column("force_n2", ".3f"),
        "held at torsions [deg]": lambda row: f"{row['least_torsion_deg']:+.1f} to {row['largest_torsion_deg']:+.1f}",
    }
    say(table("Directions held with the least force.", columns, result["directions"]))
    plane, limit = result["least_force"], result["limit_deg"]
    say(
        f"every direction up to {result['largest_cone_deg']:.1f} deg from straight ahead is held, some up to "
        f"{result['farthest_deg']:.1f} deg"
    )
    say(
        f"least force up to {limit:g} deg: Listing's plane with sd {plane['sd_deg']:.2f} deg and twist "
        f"{plane['twist']:+.3f} (Listing 0, Fick -1); about the surface so twisted sd {plane['twisted_sd_deg']:.3f} deg"
    )


def _say_sequences(result: dict[str, Any]) -> None:
    from orient_eye.cli.tables import column, number, say, table

    told = {
        "ends": "ends of the saccades",
        "on_the_way": "on the way",
        "least_force": "the same gaze, least force",
        "usual": "the same targets, usual command",
        "fick": "the same gaze, Fick's gimbal",
    }
    rows = [{"of": words, **result[key]} for key, words in told.items() if result[key] is not None]
    columns = {
        "sd [deg]": column("sd_deg", ".2f"),
        "tilt left [deg]": column("tilt_left_deg", "+.2f"),
        "tilt down [deg]": column("tilt_down_deg", "+.2f"),
        "twist": column("twist", "+.3f"),
        "sd about the twisted surface [deg]": column("twisted_sd_deg", ".3f"),
    }
    say(table("Listing's plane.", {"orientations": lambda row: row["of"], **columns}, rows, left=("orientations",)))
    first = {
        "after": lambda row: f"{row['saccades']} saccades",
        "sd [deg]": columns["sd [deg]"],
        "twist": columns["twist"],
        "last end beside the least force [deg]": column("last_beside_least_force_deg", ".3f"),
    }
    say(table(f"How it came about, from a start {_STARTS[result['start']]}.", first, result["first"]))
    error, path, blip = (result[key] for key in ("gaze_error_deg", "path_deviation", "torsion_blip_deg"))
    say(f"gaze ends off by {error['mean']:.3f} deg in the mean, {error['largest']:.3f} at most")
    median, most = (100 * path[of] for of in ("median", "p95"))
    say(f"paths deviate by {median:.1f} % of the amplitude in the median, 95 % of them by less than {most:.1f} %")
    correlation, stretching = result["component_correlation"], result["stretching"]
    say(
        f"components' velocities correlate by {number(correlation['median'], '.3f')} in the median, "
        f"{number(correlation['least'], '.3f')} at least"
    )
    say(
        f"the smaller component takes {number(stretching['smaller']['median'], '.2f')} times as long as alone (median "
        f"of {stretching['smaller']['compared']}), the larger {number(stretching['larger']['median'], '.2f')} times"
    )
    say(f"blips of torsion: median {blip['median']:.2f} deg, largest {blip['largest']:.2f} deg")
    if result["not_settled"]:
        say(f"{result['not_settled']} of {result['saccades']} saccades did not settle within the horizon", "yellow")
    say(result["imposed"])
    ends, beside = result["ends"], result["beside_least_force_deg"]
    apart = ""
    if beside is not None:
        apart = f"; beside the torsion of the least force {beside['mean']:+.2f} deg, sd {beside['sd']:.2f}"
    usual = result["usual"]
    alone = (
        "" if usual is None else f"; by the usual command alone sd {usual['sd_deg']:.2f}, twist {usual['twist']:+.2f}"
    )
    say(
        f"What came of it: ends within sd {ends['sd_deg']:.2f} deg of a plane, twist {ends['twist']:+.2f} (Listing 0, "
        f"Fick -1){alone}{apart}. Only what differs from the usual command has emerged."
    )


_STARTS = {"ahead": "straight ahead", "fick": "aside at the torsion of Fick's gimbal"}


def _pictures(made: "Sequence") -> "dict[str, Figure]":
    import numpy as np

    from orient_eye import listing, rotations
    from orient_eye.figures import gaze
    from orient_eye.learning.sequences import least_force, on_the_way
    from orient_eye.movement.oblique import end_of_shift

    looks, surface = rotations.gaze(made.measures.final), least_force(made.task)
    laws = {} if surface is None else {"least force": surface.orientation(looks)}
    laws["Fick's gimbal"] = listing.with_torsion(looks, listing.ficks_torsion(looks))
    shown = np.arange(min(_SHOWN, len(made)))
    oblique = np.argsort(-np.abs(end_of_shift(made.trajectory, made.measures)).min(axis=1))[:_COLUMNS]
    few = {name: (made.trajectory[which], made.measures[which]) for name, which in (("s", shown), ("o", oblique))}
    return {
        "plane": gaze.listing_plane(made.measures.final, on_the_way(made), laws),
        "sequence": gaze.saccade_sequence(*few["s"], made.target[shown]),
        "torsion": gaze.torsion_over_time(*few["s"]),
        "components": gaze.component_velocities(*few["o"]),
        "motors": gaze.motors_over_time(*few["o"]),
        "main_sequence": gaze.main_sequence(made.trajectory, made.measures),
    }
