"""The last movement in Rerun's viewer, for environments that are watched (`render_mode="human"`)."""

import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from orient_eye.movement.trajectory import Trajectory
from orient_eye.recording import record
from orient_eye.recording.viewer import started

if TYPE_CHECKING:
    import mujoco


class LiveViewer:
    """A window that shows one movement, and then the next instead."""

    def __init__(self) -> None:
        self._open = ExitStack()
        self._folder = self._open.enter_context(tempfile.TemporaryDirectory(prefix="orient-eye-"))
        self._shown = ExitStack()

    def show(self, trajectory: Trajectory, target: NDArray[np.float64], model: "mujoco.MjModel") -> None:
        """Show a batch of movements and their targets (saccades, 4).

        Raises:
            InputError: there is no screen.
        """
        file = record(Path(self._folder) / "movement.rrd", trajectory, model=model, target=target)
        self._shown.close()
        self._shown.enter_context(started(file))

    def close(self) -> None:
        """Close the window."""
        self._shown.close()
        self._open.close()
