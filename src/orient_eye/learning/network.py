"""Forward and backward passes of a small ReLU network, written out.

The networks of a saccade policy are so small that autograd's bookkeeping costs more than their arithmetic.
These passes read the parameters of ordinary torch layers and leave gradients in `.grad`, so that
optimizers, checkpoints and SB3's own code see nothing unusual; a test holds them against autograd.
"""

from collections.abc import Iterable

import torch
from torch import Tensor, nn


class Network:
    """Linear layers with ReLU between them.

    Args:
        modules: linear layers and ReLUs, in order.
    """

    def __init__(self, modules: Iterable[nn.Module]) -> None:
        modules = list(modules)
        self.layers = [module for module in modules if isinstance(module, nn.Linear)]
        self.ends_in_relu = isinstance(modules[-1], nn.ReLU)
        if any(not isinstance(module, nn.Linear | nn.ReLU) for module in modules):
            raise TypeError(f"only linear layers and ReLU, got {[type(module).__name__ for module in modules]}")

    def forward(self, x: Tensor) -> list[Tensor]:
        """Input and output of every layer, (batch, size) each; the last is the network's output."""
        values = [x]
        for i, layer in enumerate(self.layers):
            x = torch.addmm(layer.bias, x, layer.weight.t())
            if i + 1 < len(self.layers) or self.ends_in_relu:
                x.relu_()
            values.append(x)
        return values

    def backward(self, values: list[Tensor], gradient: Tensor, *, of_parameters: bool, of_input: bool) -> Tensor:
        """Propagate the loss's gradient back from the output.

        Args:
            values: of the forward pass.
            gradient: by the output, (batch, outputs).
            of_parameters: leave the parameters' gradients in `.grad`, in place of what is there.
            of_input: go on to the input.

        Returns:
            The gradient by the input, or by the first layer's output where `of_input` is false.
        """
        for i in reversed(range(len(self.layers))):
            layer = self.layers[i]
            if i + 1 < len(self.layers) or self.ends_in_relu:
                gradient = torch.ops.aten.threshold_backward(gradient, values[i + 1], 0)
            if of_parameters:
                layer.weight.grad = gradient.t() @ values[i]
                layer.bias.grad = gradient.sum(dim=0)
            if i or of_input:
                gradient = gradient @ layer.weight
        return gradient
