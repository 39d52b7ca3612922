"""An outcome as a table: one row a saccade, plain values. Everything that lists saccades asks here."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye.plants.limited_motor import peaks
from orient_eye.state import State
from orient_eye.task.judge import plain_reward
from orient_eye.task.saccade import Outcome, SaccadeTask

Array = NDArray[np.float64]


def outcome_columns(task: SaccadeTask, start: State, target: Array, action: Array, outcome: Outcome) -> dict[str, Any]:
    """Columns of what came of saccades, each (saccades,).

    Where they go, told by the angles of the task's targets (start_yaw_deg, target_yaw_deg, ...); F of each motor that
    is driven and the numbers of the action; C where the pulse has one; where the eye comes to rest and by how much
    that is off; the measures; the reward with its weighted terms; and what went wrong.
    """
    targets, actions, measures = task.targets, task.actions.plain, outcome.measures
    action = task.actions.as_plain(start, target, action)
    columns: dict[str, Any] = {}
    for name, orientation in (("start", start.orientation), ("target", target)):
        columns |= _angles(name, targets.angles, targets.angles_of(orientation))
    driven = [i for i, motor in enumerate(task.plant.motors) if motor.name in {n.motor for n in actions.numbers}]
    several = len(driven) > 1
    for i in driven:
        motor = task.plant.motors[i]
        columns[f"F_{motor.name}_{motor.unit}" if several else f"F_{motor.unit}"] = start.motor[:, i]
    for name, number, values in zip(actions.names, actions.numbers, action.T, strict=True):
        columns[name if number.unit == "1/s" else f"{name}_{number.unit}"] = values
    C = getattr(outcome.command, "C", None)
    if C is not None and np.any(C):
        for i in driven:
            columns[f"C_{task.plant.motors[i].name}" if several else "C"] = np.asarray(C, float)[:, i]
    final = targets.angles_of(measures.final)
    columns |= _angles("final", targets.angles, final)
    off = np.round((final - targets.angles_of(target) + 180) % 360 - 180, 9)
    columns |= {f"final_{name.replace('_deg', '_error_deg')}": off[:, k] for k, name in enumerate(targets.angles)}
    return {
        **columns,
        "amplitude_deg": measures.amplitude_deg,
        "duration_ms": 1e3 * measures.settling_time_s,
        "peak_velocity_deg_s": measures.peak_velocity_deg_s,
        "overshoot": measures.overshoot,
        "skewness": measures.skewness,
        **plain_reward(outcome.reward, task.weights),
        "settled": measures.settled,
        "saturated": outcome.saturated,
        "limited": outcome.limited,
        "too_fast": outcome.too_fast,
        "failed": measures.failed,
    }


def rows_of(columns: dict[str, Any], missing: float | None = None) -> list[dict[str, Any]]:
    """One dictionary of plain values a saccade; `missing` for what is no finite number."""
    count = len(next(iter(columns.values())))
    return [{name: _plain(values[i], missing) for name, values in columns.items()} for i in range(count)]


def outcome_rows(
    task: SaccadeTask, start: State, target: Array, action: Array, outcome: Outcome
) -> list[dict[str, Any]]:
    """`outcome_columns` as rows."""
    return rows_of(outcome_columns(task, start, target, action, outcome))


def with_peaks(task: SaccadeTask, outcome: Outcome, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows of `outcome_rows` with how fast and hard their motors move, and how much they can.

    Args:
        task: whose saccades they are.
        outcome: of them.
        rows: of the same saccades.
    """
    motors = task.plant.motors
    speed, acceleration = peaks(outcome.movement.trajectory().motor, task.plant.step_s)
    driven = [i for i, motor in enumerate(motors) if motor.name in {n.motor for n in task.actions.numbers}]
    made = [dict(row) for row in rows]
    for i in driven:
        name, motor = f"_{motors[i].name}" if len(driven) > 1 else "", motors[i]
        for key, unit, values, limit in (
            ("motor_speed", "deg_s", speed[:, i], motor.speed_limit),
            ("motor_acceleration", "deg_s2", acceleration[:, i], motor.acceleration_limit),
        ):
            for row, value in zip(made, values, strict=True):
                row[f"{key}{name}_{unit}"] = float(value) if np.isfinite(value) else None
                row[f"{key}_limit{name}_{unit}"] = limit
    return made


def _angles(what: str, names: tuple[str, ...], values: Array) -> dict[str, Array]:
    return {f"{what}_{name}": np.round(values[:, k], 9) for k, name in enumerate(names)}


def _plain(value: Any, missing: float | None) -> Any:
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    return float(value) if np.isfinite(value) else missing
