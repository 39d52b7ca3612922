"""A small pool of files that people bring, good and bad; for tests that name them on a command line."""

from pathlib import Path

import numpy as np

Array = np.ndarray
TIME = np.arange(0, 0.6, 0.005)
MOTOR = np.where(TIME < 0.1, 0.0, 10.0)
EYE = np.where(TIME < 0.1, 0.0, 14.7 * (1 - np.exp(-17.5 * (TIME - 0.1))))
SENT_S = np.arange(500) / 1000
SENT = 13.6 * (1 - np.exp(-35 * SENT_S))


def write_pool(folder: Path) -> Path:
    """Write them."""
    step = "t_s,motor_deg,eye_deg"
    half = np.deg2rad(EYE) / 2
    tables: dict[str, tuple[str, tuple[Array, ...]]] = {
        "step.csv": (step, (TIME, MOTOR, EYE)),
        "step_rad.csv": (step, (TIME, np.deg2rad(MOTOR), np.deg2rad(EYE))),
        "step_ms.csv": (step, (1000 * TIME, MOTOR, EYE)),
        "step_far.csv": (step, (TIME, 1e12 * MOTOR, 1e12 * EYE)),
        "still.csv": (step, (TIME, MOTOR, 0 * EYE)),
        "step_q.csv": (
            "t_s,motor_deg,q_w,q_x,q_y,q_z",
            (TIME, MOTOR, np.cos(half), 0 * half, 0 * half, np.sin(half)),
        ),
        "sent.csv": ("t_s,tau2_deg", (SENT_S, SENT)),
        "sent_ms.csv": ("t_s,tau2_deg", (1000 * SENT_S, SENT)),
        "sent_us.csv": ("t_s,tau2_deg", (1e6 * SENT_S, SENT)),
        "sent_rad.csv": ("t_s,tau2_deg", (SENT_S, np.deg2rad(SENT))),
        "far.csv": ("t_s,tau2_deg", (SENT_S, 100 * SENT)),
    }
    time = np.arange(0, 1.5, 0.002)
    gaze, three, alike = (
        sum(size * np.tanh((time - at) * 50) for at, size in moments.items())
        for moments in ({0.5: 10}, {0.3: 3, 0.7: 6, 1.1: 9}, {0.3: 9, 0.7: -9, 1.1: 9})
    )
    tables |= {
        "gaze.csv": ("t,x", (time, gaze)),
        "gaze_ms.csv": ("t,x", (1000 * time, gaze)),
        "gaze_back.csv": ("t,x", (time[::-1], gaze)),
        "gaze_gaps.csv": ("t,x", (time, np.nan * gaze)),
        "gaze_rad.csv": ("t,x", (time, np.deg2rad(gaze))),
        "three.csv": ("t,x", (time, three)),
        "alike.csv": ("t,x", (time, alike)),
    }
    for name, (header, columns) in tables.items():
        np.savetxt(folder / name, np.column_stack(columns), delimiter=",", header=header, comments="")
    texts = {
        "command.csv": "t_s,tau2_deg\n0,0\n0,8\n0.3,8\n",
        "empty.csv": "",
        "header.csv": "t_s,tau2_deg\n",
        "cut.csv": "t_s,tau2_deg\n0,0\n0.1\n",
        "words.csv": "t_s,tau2_deg\n0,0\n0.1,ten\n",
        "nan.csv": "t_s,tau2_deg\n0,0\n0.1,nan\n",
        "back.csv": "t_s,tau2_deg\n0,0\n0.2,1\n0.1,2\n",
        "pairs.csv": "start_yaw_deg,target_yaw_deg\n0,20\n-10,5\n",
        "pairs_far.csv": "start_yaw_deg,target_yaw_deg\n0,20\n# a comment\n-10,500\n",
        "pairs_same.csv": "start_yaw_deg,target_yaw_deg\n0,20\n\n5,5\n",
        "pairs_nan.csv": "start_yaw_deg,target_yaw_deg\n0,20\n,5\n",
        "garbage.xml": "<mujoco><worldbody><body></worldbody></mujoco>",
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "garbage.csv").write_bytes(bytes(range(256)))
    (folder / "folder").mkdir()
    (folder / "folder" / "file.txt").write_text("there", encoding="utf-8")
    return folder
