"""Run a motor command that `orient-eye predict --command` wrote, on the eye in MuJoCo alone: no orient-eye in it.

    orient-eye predict POLICY --target 20 -10 --command there.csv
    python examples/replay_command.py there.csv

The file has the column t_s and one a motor, tau1_deg for motor1; motors without a column stay at 0. It prints where the
eye ends: yaw (positive to the left), pitch (positive down) and torsion, twice the arctangent of the rotation vector's
first component.
"""

import argparse
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

EYE = Path(__file__).parents[1] / "eye_mjcf" / "eye3.xml"
REST_S = 4.0
"""So long the eye is left to itself before the command and after it, until it rests."""


def read_motors(path: str | Path, model: mujoco.MjModel) -> NDArray[np.float64]:
    """Positions [rad] (steps, motors) at the model's own steps: at rest, along the command, at rest again."""
    with Path(path).open(encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        table = np.loadtxt(file, delimiter=",", ndmin=2)
    time = table[:, names.index("t_s")] + REST_S
    step_s = model.opt.timestep
    wanted = step_s * np.arange(round((time[-1] + REST_S) / step_s) + 1)
    motors = np.zeros((len(wanted), model.nu))
    for name in set(names) - {"t_s"}:
        if not name.endswith("_deg"):
            raise SystemExit(f"column {name}: this plays positions in deg; a rig's command goes to orient-eye simulate")
        motor = model.actuator(name.replace("tau", "motor").removesuffix("_deg")).id
        motors[:, motor] = np.deg2rad(np.interp(wanted, time, table[:, names.index(name)]))
    return motors


def replay(path: str | Path, eye: str | Path = EYE) -> tuple[float, float, float]:
    """Yaw, pitch and torsion [deg] of the eye after a command."""
    model = mujoco.MjModel.from_xml_path(str(eye))
    data = mujoco.MjData(model)
    motors = read_motors(path, model)
    for instant in motors[1:]:  # an arm stands where ctrl says one step later: each step is sent the next instant
        data.ctrl[:] = instant
        mujoco.mj_step(model, data)
    w, x, y, z = data.joint("eye").qpos
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    torsion = 2 * np.arctan(x / w)
    return float(np.rad2deg(yaw)), float(np.rad2deg(pitch)), float(np.rad2deg(torsion))


def main() -> None:
    """Read, run, and print where the eye ends."""
    parser = argparse.ArgumentParser(description="Run a motor command on the eye in MuJoCo, and say where it ends.")
    parser.add_argument("command", help="CSV file written by orient-eye predict --command")
    parser.add_argument("--eye", default=EYE, help="MJCF file of the eye")
    given = parser.parse_args()
    yaw, pitch, torsion = replay(given.command, given.eye)
    print(f"yaw {yaw:.4f}, pitch {pitch:.4f}, torsion {torsion:.4f} deg")


if __name__ == "__main__":
    main()
