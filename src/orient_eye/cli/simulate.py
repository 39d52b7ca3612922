"""orient-eye simulate."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro


@dataclass(frozen=True)
class Simulate:
    """Run any motor command on a plant: trajectory as CSV and NPZ, a Rerun recording, a picture.

    The command is a CSV file with the columns t_s, tau1_deg, tau2_deg, tau3_deg (any sampling; straight
    lines between rows; leave out motors that stay at 0). Its first row is the rest position.
    """

    motor: Path
    """CSV file of the motor command."""
    plant: Literal["mujoco", "lpf", "tavares"] = "mujoco"
    """The MuJoCo eye, the low-pass surrogate, or the NumPy reference."""
    out: Annotated[Path | None, tyro.conf.arg(help_behavior_hint="(default: runs/simulate-DATE-TIME)")] = None
    """Run directory, new or empty."""
    eye: str = "thesis"
    """Preset of the eye, for mujoco and tavares: thesis or eve_v3."""
    accurate: bool = False
    """For mujoco: integrate at 0.2 ms instead of the thesis' 1 ms."""
    gravity: bool = False
    """For mujoco and tavares: with the gravity torque."""
    surrogate: str = "thesis"
    """For lpf: a surrogate.json, or the name of a shipped one."""
    horizon: Annotated[float | None, tyro.conf.arg(help_behavior_hint="(default: the file's own)")] = None
    """Duration [s]; the last row is held beyond the file's end."""

    def run(self) -> dict[str, Any]:
        """Simulate and write the run directory."""
        import numpy as np

        from orient_eye.cli import say
        from orient_eye.commands.motor_file import read_command, rest_position
        from orient_eye.figures import draw_trajectory
        from orient_eye.movement.trajectory import EyeState
        from orient_eye.plants import make_plant
        from orient_eye.recording import model_of, record
        from orient_eye.rotations import to_euler
        from orient_eye.run_directory import RunDirectory

        options: dict[str, Any] = {"surrogate": self.surrogate} if self.plant == "lpf" else {"eye": self.eye}
        if self.plant != "lpf":
            options["gravity"] = self.gravity
        if self.plant == "mujoco":
            options["accurate"] = self.accurate
        _refuse_options_of_other_plants(self)
        plant = make_plant(self.plant, **options)
        command = read_command(self.motor, plant, horizon_s=self.horizon)
        start = EyeState(plant.rest_orientation(rest_position(self.motor, plant)))
        trajectory = plant.simulate(command, start)
        run = RunDirectory.create(self.out, "simulate", self)
        trajectory.save_npz(run.path / "trajectory.npz")
        trajectory.to_csv(run.path / "trajectory.csv")
        draw_trajectory(trajectory, run.path / "trajectory.png")
        record(
            run.path / "trajectory.rrd",
            trajectory,
            model=model_of(plant.identity()),
            titles=[self.motor.stem],
            notes=f"`{self.motor.name}` on plant `{self.plant}`.",
        )
        last = [float(np.round(angle[0, -1], 6)) for angle in to_euler(trajectory.orientation)]
        result = {
            "out": str(run.path),
            "plant": plant.identity(),
            "samples": len(trajectory.time),
            "duration_s": float(trajectory.time[-1]),
            "final_yaw_pitch_roll_deg": last,
            "peak_speed_deg_s": float(np.linalg.norm(trajectory.angular_velocity[0], axis=-1).max()),
            "failed": bool(trajectory.failed[0]),
        }
        run.write_json("result.json", result)
        if trajectory.failed[0]:
            say("[red]the simulation diverged: the trajectory is empty (NaN)[/red]")
        say(f"the eye ends at yaw {last[0]:.3f}, pitch {last[1]:.3f}, roll {last[2]:.3f} deg")
        say(f"in {run.path}: trajectory.csv, .npz, .png, .rrd (orient-eye view {run.path}/trajectory.rrd)")
        return result


def _refuse_options_of_other_plants(options: Simulate) -> None:
    from orient_eye.errors import InputError

    wrong = {
        "--accurate": options.accurate and options.plant != "mujoco",
        "--gravity": options.gravity and options.plant == "lpf",
        "--eye": options.eye != "thesis" and options.plant == "lpf",
        "--surrogate": options.surrogate != "thesis" and options.plant != "lpf",
    }
    for name, given in wrong.items():
        if given:
            raise InputError(f"{name} does nothing on plant {options.plant!r}; leave it out or choose another plant")
