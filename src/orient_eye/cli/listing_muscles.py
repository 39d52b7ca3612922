"""`orient-eye listing` without a policy, of an eye with more motors than axes: how they share the work."""

from typing import TYPE_CHECKING, Any

from orient_eye.checks import real
from orient_eye.cli.listing_statics import LIMIT_DEG, around, motors_at
from orient_eye.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from orient_eye.cli.listing import Listing
    from orient_eye.plants import Plant
    from orient_eye.plants.cables import Cables
    from orient_eye.statics import Ends, Postures, Softening

    Array = NDArray[np.float64]

_FARTHEST_DEG = 45.0  # of the directions that are compared: no cable hangs there
_RINGS = 10
_LEAST_RAD, _MOST_RAD, _STEPS_RAD = 0.1, 4.0, 79  # of co-contraction
_SHOWN_RAD = (0.5, 1.0, 1.5, 2.0, 2.5)


def hold(command: "Listing", plant: "Plant", cables: "Cables", yaw: float, pitch: float) -> dict[str, Any]:
    """Motors of a plant that hold a direction by the command's criterion.

    Raises:
        InputError: the eye does not stay there, or a cable hangs.
    """
    import numpy as np

    from orient_eye.cli.tables import say
    from orient_eye.listing import directions
    from orient_eye.statics import Postures

    criterion = _criterion(command)
    asked = None if command.torsion is None else np.array([command.torsion])
    found = Postures.of(cables, directions([yaw], [pitch]), criterion, command.co_contraction, asked)
    looks = f"yaw {yaw:g}, pitch {pitch:g}, torsion {found.torsion[0]:.3f} deg"
    if not found.state.good[0]:
        raise InputError(
            f"{looks} is not held by {criterion}: {found.state.fault(0)}; choose a direction nearer to straight ahead, "
            "or another criterion or torsion"
        )
    result = {
        "plant": plant.identity(),
        **_shared(command, cables),
        "gaze_deg": [yaw, pitch],
        "torsion_deg": float(found.torsion[0]),
        "cost": float(found.cost[0]),
        **_muscles(cables, found.motor[0], found.tension[0]),
        **_stiff(found.stiffness[0]),
        "stable": True,
    }
    say(f"{looks} is held by {criterion}, at a cost of {found.cost[0]:.4f} {_unit(criterion)}")
    _say_muscles(cables, result)
    return result


def rest(plant: "Plant", cables: "Cables", position: tuple[float, ...]) -> dict[str, Any]:
    """Where an eye rests with its motors at a position.

    Raises:
        InputError: other motors than it has, out of their range, a cable hangs, or the eye does not stay there.
    """
    from orient_eye.cli.tables import say
    from orient_eye.listing import torsion
    from orient_eye.plants.cables import LOOSE_N
    from orient_eye.rotations import gaze, to_euler
    from orient_eye.statics import working

    at = motors_at(plant, position)
    orientation = plant.rest(at)
    tension, state = cables.tension(orientation, at)[0], cables.state(orientation, at, working(cables))
    yaw, pitch, _ = (float(angle[0]) for angle in to_euler(orientation))
    rolled = float(torsion(orientation)[0])
    looks = f"yaw {yaw:.3f}, pitch {pitch:.3f}, torsion {rolled:.3f} deg"
    hanging = [motor.name for motor, pull in zip(cables.motors, tension, strict=True) if pull <= LOOSE_N]
    if hanging:
        raise InputError(f"the eye would rest at {looks} with {_hang(hanging)}; wind up all motors")
    if gaze(orientation)[0, 0] < 0:
        raise InputError(
            f"the eye turns over: past where it is stable, it would come to rest at {looks}; choose other motors"
        )
    if not state.good[0]:
        raise InputError(f"the eye does not rest at {looks}: {state.fault(0)}; choose other motors")
    result = {
        "plant": plant.identity(),
        "gaze_deg": [yaw, pitch],
        "torsion_deg": rolled,
        "orientation": orientation[0].tolist(),
        **_muscles(cables, at[0], tension),
        **_stiff(cables.stiffness(orientation, at)[0]),
        "stable": True,
    }
    say(f"the eye rests at {looks}")
    _say_muscles(cables, result)
    return result


def statics_of(command: "Listing", plant: "Plant", cables: "Cables") -> dict[str, Any]:
    """What `orient-eye listing` does with its options, on an eye with more motors than axes.

    Raises:
        InputError: a limit that is none, a criterion by which the eye does not look straight ahead, or a run directory
            that is none.
    """
    from dataclasses import asdict

    from orient_eye import statics
    from orient_eye.cli.tables import say
    from orient_eye.figures import save
    from orient_eye.files import write_table
    from orient_eye.movement.oblique import toward
    from orient_eye.plants.cables import CRITERIA
    from orient_eye.run_directory import RunDirectory

    limit = LIMIT_DEG if command.limit is None else command.limit
    real("--limit", limit, 1.0, _FARTHEST_DEG, unit="deg", advice="farther out cables hang")
    criterion, level = _criterion(command), command.co_contraction
    ends = statics.Ends.of(cables, criterion, level)
    run = RunDirectory.create(command.out, "listing", {**asdict(command), "limit": limit, "criterion": criterion})
    space = statics.Postures.of(cables, toward(ends.rings(_RINGS)).reshape(-1, 3), criterion, level)
    cone = statics.cone(limit)
    compared = {
        name: statics.Postures.of(cables, cone, name, level if CRITERIA[name].co_contraction else None)
        for name in CRITERIA
    }
    softening = _softening(cables)
    turn = statics.degrees_per_motor(plant)
    result = {
        "out": str(run.path),
        "plant": plant.identity(),
        **_shared(command, cables),
        "limit_deg": limit,
        "largest_cone_deg": float(ends.reach_deg.min()),
        "farthest_deg": float(ends.reach_deg.max()),
        "degrees_per_motor": [
            {"motor": motor.name, "torsion": t, "down": d, "left": x}
            for motor, (t, d, x) in zip(plant.motors, turn.tolist(), strict=True)
        ],
        "ends": _end_rows(ends),
        "criteria": {name: _compared(cables, postures) for name, postures in compared.items()},
        "unstable_from_co_contraction_rad": _finite(softening.unstable_from),
        "stiffness_ahead": [
            {"co_contraction_rad": c, "torsion": x, "pitch": y, "yaw": z, "least": least}
            for c, (x, y, z), least in zip(
                softening.co_contraction.tolist(), softening.about.tolist(), softening.least.tolist(), strict=True
            )
        ],
        "directions": _rows(cables, statics.Postures.of(cables, around(limit), criterion, level)),
    }
    _say_statics(cables, result)
    write_table(run.path / "statics.csv", _rows(cables, space)[len(ends.toward) - 1 :])  # straight ahead once
    pictures = _pictures(command, cables, ends, space, compared)
    for name, figure in pictures.items():
        save(figure, run.path / f"{name}.png")
    run.write_json("result.json", result)
    say(f"in {run.path}: result.json, statics.csv, {', '.join(f'{name}.png' for name in pictures)}")
    return result


def _pictures(
    command: "Listing", cables: "Cables", ends: "Ends", space: "Postures", compared: "dict[str, Postures]"
) -> "dict[str, Figure]":
    import numpy as np

    from orient_eye.figures import muscles
    from orient_eye.movement.oblique import toward
    from orient_eye.statics import Postures

    criterion, level = _criterion(command), command.co_contraction
    quarter = len(ends.toward) // 4
    meridians = []
    for first in (0, quarter):  # left, up
        angle = np.linspace(-ends.reach_deg[first + 2 * quarter], ends.reach_deg[first], 121)
        way = toward(angle[:, None] * ends.toward[first])
        meridians.append((angle, Postures.of(cables, way, criterion, level)))
    sideways = np.linspace(-_FARTHEST_DEG, _FARTHEST_DEG, 91)
    flat = toward(sideways[:, None] * ends.toward[0])
    least = {}
    for each in _SHOWN_RAD:
        state = Postures.of(cables, flat, "co-contraction", each).state
        least[each] = np.where(state.slack, np.nan, state.stiffness)
    correlations = {name: postures.correlation(cables.pairs) for name, postures in compared.items()}
    limit = LIMIT_DEG if command.limit is None else command.limit
    return {
        "reach": muscles.reach(ends, space.state.stiffness.reshape(-1, len(ends.toward)), limit),
        "planes": muscles.planes(compared),
        "motors": muscles.meridians(meridians[0], meridians[1], cables.motors, cables.pairs),
        "antagonists": muscles.antagonists(correlations, _pair_names(cables)),
        "stiffness": muscles.stiffness(_softening(cables), sideways, least),
    }


def _softening(cables: "Cables") -> "Softening":
    import numpy as np

    from orient_eye.statics import Softening

    return Softening.of(cables, np.linspace(_LEAST_RAD, _MOST_RAD, _STEPS_RAD))


def _criterion(command: "Listing") -> str:
    from orient_eye.plants.cables import CRITERIA

    return command.criterion or next(iter(CRITERIA))


def _unit(criterion: str) -> str:
    from orient_eye.plants.cables import CRITERIA

    return CRITERIA[criterion].unit


def _shared(command: "Listing", cables: "Cables") -> dict[str, Any]:
    """By which criterion."""
    from orient_eye.plants.cables import CRITERIA

    criterion = _criterion(command)
    level = cables.pretension if command.co_contraction is None else command.co_contraction
    return {"criterion": criterion, "co_contraction_rad": level if CRITERIA[criterion].co_contraction else None}


def _muscles(cables: "Cables", motor: "Array", tension: "Array") -> dict[str, Any]:
    from orient_eye.motor import names

    told = names(cables.motors)
    return {
        "motors": dict(zip(told, motor.tolist(), strict=True)),
        "tensions_n": dict(zip(told, tension.tolist(), strict=True)),
    }


def _stiff(stiffness: "Array") -> dict[str, Any]:
    import numpy as np

    about = dict(zip(("torsion", "pitch", "yaw"), np.diag(stiffness).tolist(), strict=True))
    least = float(np.linalg.eigvalsh((stiffness + stiffness.T) / 2)[0])
    return {"stiffness_nm_rad": about, "least_stiffness_nm_rad": least}


def _say_muscles(cables: "Cables", result: dict[str, Any]) -> None:
    from orient_eye.cli.tables import column, say, table

    rows = [
        {"motor": name, "angle": angle, "tension": result["tensions_n"][name]}
        for name, angle in result["motors"].items()
    ]
    columns = {
        "motor": lambda row: row["motor"],
        "angle [deg]": column("angle", ".3f"),
        "tension [N]": column("tension", ".3f"),
    }
    say(table("Motors and cables.", columns, rows, left=("motor",)))
    about = ", ".join(f"{value:.3f} ({axis})" for axis, value in result["stiffness_nm_rad"].items())
    say(f"stiffness [N m/rad]: {about}; {result['least_stiffness_nm_rad']:.3f} about the softest axis: stable")


def _hang(names: list[str]) -> str:
    return f"cable {names[0]} slack" if len(names) == 1 else f"cables {', '.join(names)} slack"


def _pair_names(cables: "Cables") -> list[str]:
    return [f"{cables.motors[i].name}/{cables.motors[j].name}" for i, j in cables.pairs]


def _finite(value: float) -> float | None:
    import math

    return value if math.isfinite(value) else None


def _end_rows(ends: "Ends") -> list[dict[str, Any]]:
    columns = (ends.toward.tolist(), ends.reach_deg, ends.cause, ends.unstable_deg, ends.slack_deg, ends.range_deg)
    return [
        {
            "left": left,
            "up": up,
            "reach_deg": float(far),
            "ended_by": cause,
            "unstable_from_deg": _finite(float(unstable)),
            "slack_from_deg": _finite(float(slack)),
            "range_from_deg": _finite(float(outside)),
        }
        for (left, up), far, cause, unstable, slack, outside in zip(*columns, strict=True)
    ]


def _compared(cables: "Cables", postures: "Postures") -> dict[str, Any]:
    """Listing's plane of a criterion, its antagonists, and what of it is not held."""
    from dataclasses import asdict

    import numpy as np

    from orient_eye.listing import fit_plane

    plane, state = fit_plane(postures.orientation), postures.state
    found = postures.correlation(cables.pairs).T.tolist()
    angles, tensions = (dict(zip(_pair_names(cables), each, strict=True)) for each in found)
    return {
        **asdict(plane),
        "tilt_left_deg": plane.tilt_deg[0],
        "tilt_down_deg": plane.tilt_deg[1],
        "tension_n": [float(postures.tension.min()), float(postures.tension.max())],
        "angles_correlate": angles,
        "tensions_correlate": tensions,
        "directions": len(postures.direction),
        "held": int(np.sum(state.good)),
        "slack": int(np.sum(state.slack)),
        "unstable": int(np.sum(~state.slack & (state.stiffness <= 0))),
        "out_of_range": int(np.sum(~state.inside)),
    }


def _rows(cables: "Cables", postures: "Postures") -> list[dict[str, Any]]:
    from orient_eye.movement.oblique import seen_from
    from orient_eye.rotations import to_euler
    from orient_eye.task.table import rows_of

    yaw, pitch, _ = to_euler(postures.orientation)
    left, up = seen_from(postures.direction).T
    columns = {
        "yaw_deg": yaw,
        "pitch_deg": pitch,
        "left_deg": left,
        "up_deg": up,
        **{motor.column: postures.motor[:, i] for i, motor in enumerate(cables.motors)},
        **{f"tension_{motor.name}_n": postures.tension[:, i] for i, motor in enumerate(cables.motors)},
        "torsion_deg": postures.torsion,
        "cost": postures.cost,
        "least_stiffness_nm_rad": postures.state.stiffness,
    }
    rows = rows_of({name: values.round(9) + 0.0 for name, values in columns.items()})  # no -0
    return [{**row, "held": bool(held)} for row, held in zip(rows, postures.state.good, strict=True)]


def _say_statics(cables: "Cables", result: dict[str, Any]) -> None:
    from orient_eye.cli.tables import column, say, table

    turn = {"motor": lambda row: row["motor"], **{key: column(key, "+.3f") for key in ("torsion", "down", "left")}}
    say(table("The eye at rest turns by so many deg for a degree of a motor.", turn, result["degrees_per_motor"]))
    columns = {
        "yaw, pitch [deg]": lambda row: f"{row['yaw_deg']:.1f}, {row['pitch_deg']:.1f}",
        **{f"{motor.name} [{motor.unit}]": column(motor.column, ".1f") for motor in cables.motors},
        "torsion [deg]": column("torsion_deg", "+.2f"),
        "tensions [N]": lambda row: _span([row[f"tension_{motor.name}_n"] for motor in cables.motors]),
        "least stiffness [N m/rad]": column("least_stiffness_nm_rad", ".3f"),
        "held": lambda row: "yes" if row["held"] else "no",
    }
    level = result["co_contraction_rad"]
    by = result["criterion"] + ("" if level is None else f", co-contraction {level:.4g} rad")
    say(table(f"Directions held by {by}.", columns, result["directions"]))
    compared = {
        "criterion": lambda row: row["criterion"],
        "sd [deg]": column("sd_deg", ".2f"),
        "tilt left [deg]": column("tilt_left_deg", "+.1f"),
        "tilt down [deg]": column("tilt_down_deg", "+.1f"),
        "twist": column("twist", "+.2f"),
        "sd about it [deg]": column("twisted_sd_deg", ".2f"),
        "tensions [N]": lambda row: _span(row["tension_n"]),
        "antagonists' angles correlate": lambda row: ", ".join(f"{x:+.2f}" for x in row["angles_correlate"].values()),
        "held": lambda row: f"{row['held']} of {row['directions']}",
    }
    rows = [{"criterion": name, **each} for name, each in result["criteria"].items()]
    limit = result["limit_deg"]
    say(table(f"Listing's plane up to {limit:g} deg, of each criterion.", compared, rows, left=("criterion",)))
    say(
        f"every direction up to {result['largest_cone_deg']:.1f} deg from straight ahead is held, some up to "
        f"{result['farthest_deg']:.1f} deg; what ends it: {_causes(result['ends'])}"
    )
    end = result["unstable_from_co_contraction_rad"]
    if end is not None:
        say(f"co-contraction softens the eye about its softest axis: straight ahead is unstable from {end:.2f} rad")


def _span(values: list[float]) -> str:
    return f"{min(values):.2f} to {max(values):.2f}"


def _causes(ends: list[dict[str, Any]]) -> str:
    count: dict[str, int] = {}
    for row in ends:
        count[row["ended_by"]] = count.get(row["ended_by"], 0) + 1
    return ", ".join(f"{cause} ({ways} of {len(ends)} ways)" for cause, ways in count.items())
