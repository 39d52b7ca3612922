"""A policy in torch: the features of its networks, and the whole of it as a module."""

from typing import TYPE_CHECKING

import numpy as np
import torch
from torch import Tensor, nn

from orient_eye.learning.features import GAZE_INPUTS, UNIT_DEG

if TYPE_CHECKING:
    from orient_eye.learning.policy import Policy

_UNIT_RAD = float(np.deg2rad(UNIT_DEG))


def gaze_features(observations: Tensor) -> Tensor:
    """`orient_eye.learning.features.gaze_features` (batch, 6) of observations, two quaternions, (batch, 8)."""
    a, b = observations.split(4, dim=1)
    (aw, av), (bw, bv) = a.split((1, 3), dim=1), b.split((1, 3), dim=1)
    turn_w = (a * b).sum(dim=1, keepdim=True)  # turn = b a^-1
    turn_v = aw * bv - bw * av + torch.linalg.cross(av, bv)
    # Rotation vectors of both at once: angle times axis.
    w, v = torch.stack([aw, turn_w], dim=1), torch.stack([av, turn_v], dim=1)
    size = torch.linalg.vector_norm(v, dim=2, keepdim=True).clamp_min(1e-7)
    half_angle = torch.atan2(size, w.abs()) * torch.sign(w)
    return (v * (half_angle / size)).flatten(1) * (2 / _UNIT_RAD)


class TorchPolicy(nn.Module):
    """The mean of a policy as a module, float32 unless moved: differentiable, and open to further training.

        module = policy.torch_module()
        action = module(start, target)                   # quaternions (batch, 4) -> (batch, numbers), in units

    Args:
        policy: whose layers are copied.
    """

    low: Tensor
    high: Tensor
    log: Tensor

    def __init__(self, policy: "Policy") -> None:
        super().__init__()
        self.inputs = policy.inputs
        layers: list[nn.Module] = []
        for weight, bias in zip(policy.weights, policy.biases, strict=True):
            layer = nn.Linear(*weight.shape)
            layer.weight.data = torch.tensor(weight.T, dtype=torch.float32)
            layer.bias.data = torch.tensor(bias, dtype=torch.float32)
            layers += [layer, nn.ReLU()]
        self.layers = nn.Sequential(*layers[:-1])
        for name, bound in (("low", policy.low), ("high", policy.high)):
            self.register_buffer(name, torch.tensor(bound, dtype=torch.float32))
        self.register_buffer("log", torch.tensor(policy.log))

    def forward(self, start: Tensor, target: Tensor) -> Tensor:
        """Actions in units, (batch, numbers), of orientations (batch, 4)."""
        seen = torch.cat([start, target], dim=1)
        x = self.layers(gaze_features(seen) if self.inputs == GAZE_INPUTS else seen)
        shares = (torch.tanh(x) + 1) / 2
        linear = self.low + shares * (self.high - self.low)
        ratio = torch.where(self.log, self.high / self.low, 1.0)
        return torch.where(self.log, self.low * ratio**shares, linear)
