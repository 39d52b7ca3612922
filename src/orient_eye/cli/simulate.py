"""orient-eye simulate."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

if TYPE_CHECKING:
    from orient_eye.commands.motor_file import WrittenCommand
    from orient_eye.plants import Plant
    from orient_eye.state import State

_TURNED_AWAY_DEG = 60.0
"""From straight ahead: an eye that is not stable near there comes to rest beyond this."""
_TAUT_N = 1e-6
"""A cable with less tension hangs slack."""


@dataclass(frozen=True)
class Simulate:
    """Run any motor command on a plant: trajectory as CSV and NPZ, a Rerun recording, a picture.

    The command is a CSV file with the column t_s and one for each motor that moves: tau2_deg for motor2 (any
    sampling; straight lines between rows). Its first row is the rest position.

    $ orient-eye simulate --motor command.csv

    $ orient-eye simulate --motor command.csv --plant tavares --gravity

    Of the six-motor eye the columns are IR_deg, MR_deg, SR_deg, LR_deg, IO_deg, SO_deg, the angles of the spindles; a
    motor without a column stands at its pretension (57.8, 56.2, 56.8, 58.4, 56.5, 58.1 deg).

    $ orient-eye simulate --motor spindles.csv --eye six

    With --rig the motors have the rig's limits, and the file may have the columns of its driver (motor2_counts), as
    `orient-eye predict --rig` writes them.

    $ orient-eye simulate --motor there.csv --plant lpf --surrogate surrogate.json --rig rig.toml
    """

    motor: Path
    """CSV file of the motor command."""
    plant: str = "mujoco"
    """The plant that is moved."""
    plant_options: dict[str, Any] = field(default_factory=dict)
    horizon: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(default: the file's own)")] = None
    """Duration of the movement, s; the last row is held beyond the file's end."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/simulate-DATE-TIME)")] = None
    """Run directory, new or empty."""

    def run(self) -> dict[str, Any]:
        """Simulate and write the run directory."""
        import numpy as np

        from orient_eye.checks import real
        from orient_eye.cli.tables import say
        from orient_eye.commands.motor_file import read_command
        from orient_eye.constants import LONGEST_S, STEP_S
        from orient_eye.figures.trajectory import draw_trajectory
        from orient_eye.plants import make_plant
        from orient_eye.plants.cables import muscles_of
        from orient_eye.plants.limited_motor import peaks
        from orient_eye.plants.limits import wiring
        from orient_eye.recording import record
        from orient_eye.rotations import to_euler
        from orient_eye.run_directory import RunDirectory

        if self.horizon is not None:
            real("--horizon", self.horizon, STEP_S, LONGEST_S, unit="s")
        plant = make_plant(self.plant, **self.plant_options)
        rig = self.plant_options.get("rig")
        wired = None if rig is None else wiring(plant, rig)
        command = read_command(self.motor, plant.motors, wired, horizon_s=self.horizon)
        if asked := _likely_radians(self.motor, plant, command):
            say(f"note: {asked}", "yellow")
        movement = plant.move(command, _at_rest(self.motor, plant, command), self.horizon)
        trajectory = movement.trajectory()
        run = RunDirectory.create(self.out, "simulate", self)
        trajectory.save_npz(run.path / "trajectory.npz")
        trajectory.to_csv(run.path / "trajectory.csv")
        muscles = muscles_of(plant)
        draw_trajectory(trajectory, run.path / "trajectory.png", None if muscles is None else muscles.pairs)
        record(
            run.path / "trajectory.rrd",
            trajectory,
            model=plant.drawn(),
            titles=[self.motor.stem],
            notes=f"`{self.motor.name}` on plant `{self.plant}`.",
        )
        failed = bool(trajectory.failed[0])
        last = [float(np.round(angle[0, -1], 6)) for angle in to_euler(trajectory.orientation)]
        speed = float(np.linalg.norm(trajectory.angular_velocity[0], axis=-1).max())
        told, taken = command.peaks(), peaks(trajectory.motor, plant.step_s)
        motors = {
            motor.name: {
                "told_speed_deg_s": float(told[0][i]),
                "told_acceleration_deg_s2": float(told[1][i]),
                "peak_speed_deg_s": float(taken[0][0, i]),
                "peak_acceleration_deg_s2": float(taken[1][0, i]),
                "speed_limit_deg_s": motor.speed_limit,
                "acceleration_limit_deg_s2": motor.acceleration_limit,
            }
            for i, motor in enumerate(plant.motors)
        }
        result = {
            "out": str(run.path),
            "plant": plant.identity(),
            "samples": len(trajectory.time),
            "duration_s": float(trajectory.time[-1]),
            "final_yaw_pitch_roll_deg": None if failed else last,
            "peak_speed_deg_s": None if failed else speed,
            "limited": bool(movement.limited[0]),
            "saturated": bool(movement.saturated[0]),
            "motors": motors,
            "failed": failed,
        }
        run.write_json("result.json", result)
        if failed:
            say("the simulation diverged: the trajectory is empty (NaN)", "red")
        else:
            say(f"the eye ends at yaw {last[0]:.3f}, pitch {last[1]:.3f}, roll {last[2]:.3f} deg (Fick's angles)")
        _say_motors(motors, limited=bool(result["limited"]))
        say(f"in {run.path}: trajectory.csv, .npz, .png, .rrd (orient-eye view {run.path}/trajectory.rrd)")
        return result


def _likely_radians(path: Path, plant: "Plant", command: "WrittenCommand") -> str:
    """What to say of a command that is probably in radians; else nothing. Motors without a column say nothing."""
    import numpy as np

    from orient_eye.checks import likely_radians
    from orient_eye.motor import ranges, rests

    rest = rests(plant.motors)
    told = command.positions[:, (command.positions != rest).any(axis=0)]
    if not told.size:
        return ""
    largest = float(np.abs(told).max())
    if rest.any() and largest < np.deg2rad(ranges(plant.motors).max()):  # spindles are wound up by turns
        largest = float(np.ptp(told, axis=0).max())
    return likely_radians(f"{path}: the motor", largest)


def _at_rest(path: Path, plant: "Plant", command: "WrittenCommand") -> "State":
    """Where the eye stands at the first row.

    Raises:
        InputError: of an eye that spindles turn, it is not stable there, or a cable hangs slack.
    """
    import numpy as np

    from orient_eye.errors import InputError
    from orient_eye.eyes.model import Tendons
    from orient_eye.plants.elastic import ElasticPlant
    from orient_eye.rotations import FORWARD, angle_between
    from orient_eye.state import State

    start = State(plant.rest(command.rest), command.rest)
    if not isinstance(plant, ElasticPlant) or not (wound := Tendons.of(plant.model).wound != 0).any():
        return start
    ease = ", ".join(f"{motor.name} {motor.rest:.1f}" for motor in plant.motors)
    away = float(angle_between(start.orientation[0], FORWARD))
    if away > _TURNED_AWAY_DEG:
        raise InputError(
            f"{path}, first row: the eye would not stay near straight ahead, it turns away by {away:.0f} deg; wind "
            f"the motors up less, or less apart: at ease they stand at {ease} deg"
        )
    tensions = plant.tension(start.orientation, start.motor)[0]
    slack = [plant.tendons[i] for i in np.flatnonzero(wound & (tensions < _TAUT_N))]
    if slack:
        raise InputError(
            f"{path}, first row: slack cables do not hold the eye: {', '.join(slack)}; begin with the motors "
            f"wound up: at ease they stand at {ease} deg, as one does whose column is left out"
        )
    return start


def _say_motors(motors: dict[str, dict[str, Any]], *, limited: bool) -> None:
    """How fast each motor that moves is told to be and is, beside what it can; how hard, where there is a limit."""
    from orient_eye.cli.tables import say

    beyond = False
    for name, of in motors.items():
        if not of["told_speed_deg_s"] > 0:
            continue
        words = []
        for what, unit in (("speed_deg_s", "deg/s"), ("acceleration_deg_s2", "deg/s²")):
            told, limit = of[f"told_{what}"], of[what.replace("_deg", "_limit_deg")]
            if limit is not None:
                beyond |= told > limit * (1 + 1e-6)
                words.append(f"told {told:.0f}, makes {of[f'peak_{what}']:.0f} of {limit:.0f} {unit}")
            elif what == "speed_deg_s":
                words.append(f"{of[f'peak_{what}']:.0f} deg/s (no limit)")
        say(f"{name}: {'; '.join(words)}")
    if beyond:
        say("limited: the command is more than a motor can do, which goes after it as fast as it can", "yellow")
    elif limited:
        say("the command keeps the limits from row to row; between rows the motors bend its straight lines as they can")
