"""What the plants of the elastic eye have in common: its compiled model, and where it comes to rest."""

from abc import abstractmethod
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from orient_eye.eyes import model as eyes
from orient_eye.motor import check_driven, ranges
from orient_eye.plants import equilibrium
from orient_eye.plants.simulated import SimulatedPlant

Array = NDArray[np.float64]


class ElasticPlant(SimulatedPlant):
    """An eye that elastics turn.

    Args:
        options: keywords of the plant, which its identity shows: `eye` among them.
        step_s: of the integration.
        gravity: with the gravity torque as an actuator of the model.
    """

    def __init__(self, options: dict[str, Any], *, step_s: float, gravity: bool = False) -> None:
        self.options = options
        self.model = eyes.build_model(options["eye"], step_s=step_s, gravity=gravity, visual=False)
        self.motors = eyes.motors(self.model)
        self.tendons = tuple(self.model.tendon(i).name for i in range(self.model.ntendon))

    @abstractmethod
    def torque(self, orientation: Array, motor: Array) -> Array:
        """All torques but friction [N m] (n, 3), head frame, on an eye at rest in orientations (n, 4)."""

    def identity(self) -> dict[str, Any]:
        """Name, options and hash of the compiled model."""
        return {"plant": self.name, **self.options, "model": self._model_hash}

    @cached_property
    def _model_hash(self) -> str:
        return eyes.model_hash(self.model)

    def drawn(self) -> mujoco.MjModel:
        """Its own eye, with its shapes."""
        return eyes.build_model(self.options["eye"])

    def rest(self, motor: Array) -> Array:
        """See `orient_eye.plants.Plant`."""
        return equilibrium.rest_orientation(self.torque, motor)

    def hold(self, orientation: Array, driven: tuple[str, ...]) -> Array:
        """See `orient_eye.plants.Plant`."""
        index = check_driven(self.motors, driven, self.name)
        return equilibrium.rest_motor(self.torque, orientation, len(self.motors), index, ranges(self.motors))
