"""What a plant returns: a batch of saccades over time, and its files.

    trajectory = plant.move(command).trajectory()   # command (saccades, time, motors) [deg]
    trajectory.yaw_deg                              # (saccades, time)
    trajectory.save_npz("saccades.npz"); trajectory[3].to_csv("fourth.csv")

The .npz is the durable record: arrays named as the attributes, and nothing that needs pickle.
"""

import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from orient_eye import rotations
from orient_eye.constants import LONGEST_S
from orient_eye.errors import InputError
from orient_eye.files import read_bytes, write_atomically
from orient_eye.motor import Motor, names
from orient_eye.resources import printable

Array = NDArray[np.float64]
_LARGEST_BYTES = 2**31
_LARGEST = 1e20  # of numbers, as in tables


@dataclass(frozen=True)
class Trajectory:
    """A batch of saccades; the first axis is always the saccade.

    Attributes:
        time: [s], (time,), from 0.
        orientation: unit quaternion w, x, y, z, eye to head, (saccades, time, 4).
        angular_velocity: head frame [deg/s], (saccades, time, 3).
        command: where the motors were told to be, in their units, (saccades, time, motors).
        motor: where they were, (saccades, time, motors).
        tension: of the elastics [N], (saccades, time, tendons); None where the plant has none.
        failed: (saccades,), True where the simulation diverged or its command was not finite. All
            numbers of such a saccade are NaN; the others are not touched by it.
        motors: what moved the eye, (motors,).
        tendon_names: (tendons,).
    """

    time: Array
    orientation: Array
    angular_velocity: Array
    command: Array
    motor: Array
    tension: Array | None
    failed: NDArray[np.bool_]
    motors: tuple[Motor, ...]
    tendon_names: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.orientation)

    def __getitem__(self, which: int | slice | NDArray[Any]) -> "Trajectory":
        """Some of the saccades, still as a batch: an integer gives a batch of one."""
        if isinstance(which, (int, np.integer)):
            which = np.array([which])
        arrays = {name: getattr(self, name) for name in _ROWS}
        chosen: dict[str, Any] = {name: None if a is None else a[which] for name, a in arrays.items()}
        return replace(self, **chosen)

    @property
    def motor_names(self) -> tuple[str, ...]:
        """Of the motors, (motors,)."""
        return names(self.motors)

    @property
    def yaw_deg(self) -> Array:
        """Horizontal orientation [deg], positive to the left, (saccades, time)."""
        return rotations.to_euler(self.orientation)[0]

    @property
    def pitch_deg(self) -> Array:
        """Vertical orientation [deg], positive down, (saccades, time)."""
        return rotations.to_euler(self.orientation)[1]

    @property
    def roll_deg(self) -> Array:
        """Torsion [deg], positive: the upper pole to the right, (saccades, time)."""
        return rotations.to_euler(self.orientation)[2]

    def save_npz(self, path: str | Path) -> Path:
        """Write all arrays to an .npz file that opens without pickle: of the motors, names and units."""
        arrays = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "motors"}
        arrays |= {"motor_names": [m.name for m in self.motors], "motor_units": [m.unit for m in self.motors]}
        if self.tension is None:
            del arrays["tension"]

        def write(temporary: Path) -> None:
            with temporary.open("wb") as file:  # given a name, numpy would add .npz to it
                np.savez_compressed(file, **arrays)

        return write_atomically(path, write)

    @classmethod
    def load_npz(cls, path: str | Path) -> "Trajectory":
        """Read what `save_npz` wrote.

        Raises:
            InputError: the file is missing or is not a trajectory.
        """
        hint = "give an .npz file that orient-eye wrote"
        content = read_bytes(path, most=_LARGEST_BYTES, hint=hint)
        try:
            arrays = _unpacked(content)
            tendons = tuple(map(str, arrays.pop("tendon_names")))
            described = zip(arrays.pop("motor_names"), arrays.pop("motor_units"), strict=True)
            motors = tuple(Motor(str(name), str(unit)) for name, unit in described)
            read = cls(tension=arrays.pop("tension", None), **arrays, motors=motors, tendon_names=tendons)
            read._check()
        except Exception as error:  # whatever a stranger's file makes zipfile and NumPy raise
            raise InputError(f"{printable(path)} is not a trajectory file: {error}; {hint}") from error
        return read

    def _check(self) -> None:
        """Raise InputError unless shapes fit, time rises from 0, and saccades that did not fail are finite numbers."""
        count, samples, motors, tendons = len(self.failed), len(self.time), len(self.motors), len(self.tendon_names)
        rows = {"orientation": 4, "angular_velocity": 3, "command": motors, "motor": motors}
        if self.tension is not None:
            rows["tension"] = tendons
        wanted: dict[str, tuple[int, ...]] = {"time": (samples,), "failed": (count,)}
        wanted |= {name: (count, samples, width) for name, width in rows.items()}
        for name, shape in wanted.items():
            array, kind = getattr(self, name), bool if name == "failed" else float
            if (array.shape, array.dtype) != (shape, kind):
                raise InputError(f"{name} has shape {shape}, {kind.__name__}, got {array.shape}, {array.dtype}")
        if not (samples and self.time[0] == 0 and (np.diff(self.time) >= 1e-9).all() and self.time[-1] <= LONGEST_S):
            raise InputError(f"time rises from 0 to {LONGEST_S:g} s at most")
        for name in rows:
            if not (np.abs(getattr(self, name)[~self.failed]) <= _LARGEST).all():
                raise InputError(f"{name} holds finite numbers, up to {_LARGEST:g}, but for failed saccades")
        if (np.abs(np.linalg.norm(self.orientation[~self.failed], axis=-1) - 1) > 0.01).any():
            raise InputError("orientation holds unit quaternions")

    def columns(self) -> dict[str, Array]:
        """The batch as columns of a table, each (saccades, time).

        Names: t_s; q_w, q_x, q_y, q_z; yaw_deg, pitch_deg, roll_deg; omega_x_deg_s, omega_y_deg_s,
        omega_z_deg_s; tau1_deg ... (motor positions); command_tau1_deg ... (where they were told to be);
        tension_NAME_N ... (where there are tendons).
        """
        found = {"t_s": np.broadcast_to(self.time, (len(self), len(self.time)))}
        found |= {f"q_{part}": self.orientation[..., i] for i, part in enumerate("wxyz")}
        found |= dict(zip(("yaw_deg", "pitch_deg", "roll_deg"), rotations.to_euler(self.orientation), strict=True))
        found |= {f"omega_{axis}_deg_s": self.angular_velocity[..., i] for i, axis in enumerate("xyz")}
        for prefix, values in (("", self.motor), ("command_", self.command)):
            found |= {f"{prefix}{motor.column}": values[..., i] for i, motor in enumerate(self.motors)}
        if self.tension is not None:
            found |= {f"tension_{name}_N": self.tension[..., i] for i, name in enumerate(self.tendon_names)}
        return found

    def to_csv(self, path: str | Path) -> Path:
        """Write a batch of one as a table of `columns`, one row a sample.

        Raises:
            InputError: the batch holds more than one saccade.
        """
        if len(self) != 1:
            raise InputError(f"a CSV holds one saccade, this trajectory has {len(self)}; pick one: trajectory[0]")
        columns = {name: values[0] for name, values in self.columns().items()}
        return write_atomically(
            path,
            lambda temporary: np.savetxt(
                temporary,
                np.column_stack(list(columns.values())),
                fmt="%.9g",
                delimiter=",",
                header=",".join(columns),
                comments="",
            ),
        )


def _unpacked(content: bytes) -> dict[str, Any]:
    """Arrays of an .npz file, whose archive may promise more than any of ours holds.

    Raises:
        Exception: whatever it makes zipfile and NumPy raise.
    """
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > _LARGEST_BYTES:
            raise ValueError(f"it unpacks to more than {_LARGEST_BYTES // 2**20} MB")
    with np.load(io.BytesIO(content), allow_pickle=False) as file:
        return dict(file)


_ROWS = ("orientation", "angular_velocity", "command", "motor", "tension", "failed")


def concatenate(parts: Sequence[Trajectory]) -> Trajectory:
    """One batch from batches of the same plant and the same times.

    Raises:
        InputError: their times, motors or tendons differ.
    """
    first = parts[0]
    for part in parts[1:]:
        same = (part.motor_names, part.tendon_names) == (first.motor_names, first.tendon_names)
        if not same or not np.array_equal(part.time, first.time) or (part.tension is None) != (first.tension is None):
            raise InputError("only trajectories of the same plant and the same times can be one batch")
    arrays = {name: [getattr(part, name) for part in parts] for name in _ROWS}
    joined: dict[str, Any] = {k: None if a[0] is None else np.concatenate(a) for k, a in arrays.items()}
    return replace(first, **joined)
