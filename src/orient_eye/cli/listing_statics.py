"""`orient-eye listing` without a policy: the statics of an eye."""

from typing import TYPE_CHECKING, Any

from orient_eye.checks import real
from orient_eye.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from orient_eye.cli.listing import Listing
    from orient_eye.plants import Plant
    from orient_eye.statics import Held, Workspace

    Array = NDArray[np.float64]

LIMIT_DEG = 30.0


def hold(plant: "Plant", yaw: float, pitch: float, asked_torsion: float | None) -> dict[str, Any]:
    """Motors of a plant that hold a direction, at a torsion or at that of the least force [deg].

    Raises:
        InputError: one that they do not hold.
    """
    import numpy as np

    from orient_eye.cli.tables import say
    from orient_eye.listing import directions, with_torsion
    from orient_eye.motor import names
    from orient_eye.statics import Held

    held = Held.of(plant, directions([yaw], [pitch]))
    least, largest = held.range[0]
    if np.isnan(least):
        raise InputError(
            f"the motors of plant {plant.name!r} hold yaw {yaw:g}, pitch {pitch:g} deg at no torsion within their "
            "working range; choose a direction nearer to straight ahead"
        )
    torsion, motor, force = held.torsion[0], held.motor, held.force
    if asked_torsion is not None:
        torsion, orientation = asked_torsion, with_torsion(held.direction, [asked_torsion])
        motor = plant.held(orientation, names(plant.motors))
        if np.isnan(motor).any():
            raise InputError(
                f"at yaw {yaw:g}, pitch {pitch:g} deg the motors of plant {plant.name!r} hold torsions from "
                f"{least:.2f} to {largest:.2f} deg, got {asked_torsion:g}; choose one of those, or no --torsion"
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


def statics_of(command: "Listing", plant: "Plant") -> dict[str, Any]:
    """What `orient-eye listing` does with its options, on an eye whose motors are as many as its axes.

    Raises:
        InputError: a limit that the motors do not reach, or a run directory that is none.
    """
    from dataclasses import asdict

    from orient_eye import statics
    from orient_eye.cli.tables import say
    from orient_eye.files import write_table
    from orient_eye.listing import fit_plane, with_torsion
    from orient_eye.run_directory import RunDirectory

    limit = LIMIT_DEG if command.limit is None else command.limit
    space = statics.Workspace.of(plant)
    largest = float(space.reach_deg.min())
    can = f"the motors hold every direction up to {largest:.1f} deg"
    real("--limit", limit, 1.0, largest, unit="deg", advice=can)
    run = RunDirectory.create(command.out, "listing", {**asdict(command), "limit": limit})
    held = statics.Held.of(plant, statics.cone(limit))
    rows = _held_rows(plant, statics.Held.of(plant, around(limit)))
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


def rest(plant: "Plant", position: tuple[float, ...]) -> dict[str, Any]:
    """Where an eye rests with its motors at a position.

    Raises:
        InputError: other motors than it has, or out of their range.
    """
    from orient_eye.cli.tables import say
    from orient_eye.listing import torsion
    from orient_eye.motor import names
    from orient_eye.rotations import to_euler

    at = motors_at(plant, position)
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


def motors_at(plant: "Plant", position: tuple[float, ...]) -> "Array":
    """A position of all motors, (1, motors).

    Raises:
        InputError: other motors than the plant has, or out of their range.
    """
    import numpy as np

    from orient_eye.motor import names

    if len(position) != len(plant.motors):
        told = ", ".join(names(plant.motors))
        raise InputError(f"plant {plant.name!r} has {len(plant.motors)} motors ({told}), got {len(position)} positions")
    for motor, where in zip(plant.motors, position, strict=True):
        low, high = (round(end, 6) for end in motor.range)
        real(motor.name, where, low, high, unit=motor.unit, advice="that is how far it turns")
    return np.array([position], dtype=float)


def around(limit: float) -> "Array":
    """Straight ahead, and eight directions around it at an angle [deg], (9, 3)."""
    import numpy as np

    from orient_eye.movement.oblique import toward

    angle = np.pi / 4 * np.arange(8)
    return toward(np.concatenate([[[0, 0]], limit * np.stack([np.cos(angle), np.sin(angle)], axis=1)]))


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
