"""What saccades are called: whence and whither."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.movement.trajectory import Trajectory
from orient_eye.recording.curves import STILL_DEG, turned_by

Array = NDArray[np.float64]


def titles(trajectory: Trajectory, target: Array | None) -> list[str]:
    """Where each saccade goes, and whence if not from straight ahead; its number where there is no target."""
    if target is None:
        return [f"saccade {i}" for i in range(len(trajectory))]
    start = np.nan_to_num(trajectory.orientation[:, 0])
    pitch = any(abs(rotations.to_euler(q)[1]).max() > STILL_DEG for q in (start, target))
    turns = ("yaw", "pitch") if pitch else ("yaw",)
    titles = [attitude(q, turns) for q in target]
    if rotations.angle_between(start, rotations.FORWARD)[~trajectory.failed].max(initial=0) > STILL_DEG:
        titles = [f"{attitude(q, turns)} → {title}" for q, title in zip(start, titles, strict=True)]
    return titles


def attitude(orientation: Array, turns: Sequence[str], decimals: int = 1) -> str:
    """Some of yaw, pitch and torsion as text."""
    turned = turned_by(orientation)
    return ", ".join(f"{turned[turn]:+.{decimals}f}".removesuffix(".0") + "°" for turn in turns)
