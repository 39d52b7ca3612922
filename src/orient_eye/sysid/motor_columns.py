"""What the motors of a table did, in degrees: a motor's own column, or the drive of an axis by its rig."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from orient_eye.errors import InputError
from orient_eye.motor import Motor
from orient_eye.rig import Rig
from orient_eye.tables import Table

Array = NDArray[np.float64]
_UNNAMED = Motor("motor")  # its column is motor_deg
_USUAL = Motor("motor2")
_OTHER_UNITS = ("_rad", "_counts")
_MOVES_DEG = 0.5  # of a motor that should stand: less is noise


@dataclass(frozen=True)
class Driven:
    """What drives the eye in a table.

    Attributes:
        name: of the motor or drive.
        columns: it was read from, for people.
        position: [deg], as it stands in the table, (rows,).
        motors: positions of the motors that the table tells [deg], each (rows,).
        warnings: what is unusual.
    """

    name: str
    columns: str
    position: Array
    motors: dict[str, Array]
    warnings: tuple[str, ...] = ()


def driven_by_motor(table: Table, motor: str | None) -> Driven:
    """The drive where there is no rig: the column of a motor, None for motor_deg, else tau2_deg.

    Raises:
        InputError: no such column.
    """
    drive = Motor(motor) if motor else _UNNAMED if _UNNAMED.column in table else _USUAL
    if drive.column not in table:
        wanted = drive.column if motor else f"{_UNNAMED.column} or {_USUAL.column}"
        raise InputError(
            f"{table.path} has no position of the motor: no column {wanted}; it has {', '.join(table.columns)}"
            f"{other_units(table)}"
        )
    position = table[drive.column]
    motors = {m.name: table.columns[m.column] for m in (drive, *_numbered(table))}
    return Driven(drive.name, drive.column, position, motors)


def driven_by_rig(table: Table, rig: Rig, axis: str) -> Driven:
    """The drive of an axis: from its motors' columns in the driver's units or in deg, else from a column of its own.

    Raises:
        InputError: a motor has no column.
    """
    told, columns = {}, {}
    for motor in rig.motors:
        for column in dict.fromkeys((motor.column, f"{motor.name}_deg", Motor(motor.name).column)):
            if column in table:
                value = table[column]
                told[motor.name] = motor.from_driver(value) if column == motor.column else value
                columns[motor.name] = column
                break
    drive = rig.axes[axis]
    missing = [name for name in drive if name not in told]
    own = rig.drive(axis).column
    if missing and own in table:
        return Driven(rig.drive_name(axis), own, table[own], {})
    if missing:
        needs = ", ".join(f"{rig.motor(name).column} (or {name}_deg)" for name in missing)
        raise InputError(
            f"{table.path}: the {axis} drive of rig {rig.name!r} needs the columns {needs}; the table has "
            f"{', '.join(table.columns)}"
        )
    position = np.asarray(sum(c * told[name] for name, c in drive.items()))
    idle = {name: float(np.ptp(values)) for name, values in told.items() if name not in drive}
    moving = [f"{name} by {way:.1f} deg" for name, way in idle.items() if way > _MOVES_DEG]
    warnings = (f"motors of other axes move too ({', '.join(moving)}): the model knows nothing of them",)
    used = ", ".join(columns[name] for name in drive)
    return Driven(rig.drive_name(axis), used, position, told, warnings if moving else ())


def axis_of(rig: Rig, axis: str | None) -> str:
    """The axis that is meant: the one asked for, or the rig's only one.

    Raises:
        InputError: the rig does not turn it, or it turns several and none is named.
    """
    if axis is None and len(rig.axes) != 1:
        raise InputError(f"rig {rig.name!r} turns {', '.join(rig.axes)}: name one of these by --axis")
    axis = axis or next(iter(rig.axes))
    rig.shares(axis)
    return axis


def other_units(table: Table) -> str:
    """What to do about columns in other units than deg; empty where there are none."""
    found = [name for name in table.columns if name.endswith(_OTHER_UNITS)]
    if not found:
        return ""
    return (
        f". For {', '.join(found)}: describe the motor's unit in a rig file (docs/rigs.md) and give it by --rig, or "
        "convert the numbers to degrees and name the column motor_deg"
    )


def _numbered(table: Table) -> list[Motor]:
    """The motors whose columns are there: tau1_deg and so on."""
    possible = [Motor(f"motor{i}") for i in range(1, len(table.columns) + 1)]
    return [motor for motor in possible if motor.column in table]
