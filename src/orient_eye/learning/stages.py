"""The Rerun recording of a training run: the same saccades at several stages of learning."""

from pathlib import Path

import numpy as np

from orient_eye.errors import InputError
from orient_eye.learning.evaluation import Yardstick
from orient_eye.movement.trajectory import Trajectory, concatenate
from orient_eye.recording import record
from orient_eye.task.saccade import SaccadeTask


def record_stages(task: SaccadeTask, folder: Path, table: Yardstick) -> Path:
    """Put the evaluation saccades of a run's `stages/` into its recording.rrd, the optimum last.

    Raises:
        InputError: no stage was kept.
    """
    files = sorted((folder / "stages").glob("*.npz"))
    if not files:
        raise InputError(f"{folder} has no stages to record")
    parts = [Trajectory.load_npz(file) for file in files]
    parts.append(task.plain.trajectory(table.start, table.optimum.action, table.target))
    names = [f"trained {int(file.stem)} %" for file in files] + ["searched optimum"]
    return record(
        folder / "recording.rrd",
        concatenate(parts),
        model=task.plant.drawn(),
        target=np.concatenate([table.target] * len(parts)),
        titles=table.titles * len(parts),
        groups=[name for name in names for _ in table.size_deg],
        notes=f"Evaluation saccades of the training run `{folder.name}` on plant `{task.plant.name}`, at several "
        "stages of the training, and with the best action a search found.",
    )
