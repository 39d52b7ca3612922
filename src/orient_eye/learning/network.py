"""Forward and backward passes of a small ReLU network, written out.

The networks of a saccade policy are so small that autograd's bookkeeping costs more than their arithmetic.
These passes read the parameters of ordinary torch layers and write into their `.grad`; a test holds them
against autograd. For the same reason the parameters of a network lie in one vector, of which the layers'
are views and which an optimizer moves in one call.
"""

from collections.abc import Iterable

import torch
from torch import Tensor, nn
from torch.optim.adam import adam

from orient_eye.errors import InputError


def flatten(parameters: Iterable[nn.Parameter]) -> nn.Parameter:
    """One vector of parameters: each of them, and its gradient, becomes a view of the vector.

    Args:
        parameters: all on one device, of one type.
    """
    parameters = list(parameters)
    vector = nn.Parameter(torch.cat([parameter.detach().flatten() for parameter in parameters]))
    vector.grad = torch.zeros_like(vector)
    sizes = [parameter.numel() for parameter in parameters]
    for parameter, data, gradient in zip(parameters, vector.data.split(sizes), vector.grad.split(sizes), strict=True):
        parameter.data, parameter.grad = data.view_as(parameter), gradient.view_as(parameter)
    return vector


@torch.no_grad()
def take_step(optimizer: torch.optim.Optimizer) -> None:
    """The optimizer's step; of torch's Adam on one flat vector, without bookkeeping that outlasts the step."""
    group = optimizer.param_groups[0]
    vector = group["params"][0]
    if type(optimizer) is not torch.optim.Adam or vector not in optimizer.state:  # the first step makes the state
        optimizer.step()
        return
    state = optimizer.state[vector]
    moments = [state["exp_avg"]], [state["exp_avg_sq"]], [state["max_exp_avg_sq"]] if group["amsgrad"] else []
    beta1, beta2 = group["betas"]
    settings = {name: value for name, value in group.items() if name not in ("params", "betas")}
    adam([vector], [vector.grad], *moments, [state["step"]], beta1=beta1, beta2=beta2, **settings)


class Network:
    """Linear layers with ReLU between them.

    Args:
        modules: linear layers and ReLUs in turn, a linear layer last; their parameters have gradients to write
            to (`flatten`).
    """

    def __init__(self, modules: Iterable[nn.Module]) -> None:
        modules = list(modules)
        expected = [nn.ReLU if i % 2 else nn.Linear for i in range(len(modules) | 1)]
        if [type(module) for module in modules] != expected:
            names = [type(module).__name__ for module in modules]
            raise InputError(f"these are linear layers with ReLU between them only, got {names}")
        self.layers = [(layer.weight, layer.bias) for layer in modules if isinstance(layer, nn.Linear)]

    def forward(self, x: Tensor) -> list[Tensor]:
        """Input and output of every layer, (batch, size) each; the last is the network's output."""
        values = [x]
        for weight, bias in self.layers:
            if len(values) > 1:
                x.relu_()
            x = nn.functional.linear(x, weight, bias)
            values.append(x)
        return values

    def backward(self, values: list[Tensor], gradient: Tensor, *, of_parameters: bool, of_input: bool) -> Tensor:
        """Propagate the loss's gradient back from the output.

        Args:
            values: of the forward pass.
            gradient: by the output, (batch, outputs).
            of_parameters: write the parameters' gradients over what their `.grad` holds.
            of_input: go on to the input.

        Returns:
            The gradient by the input, or by the first layer's output where `of_input` is false.
        """
        for i, (weight, bias) in reversed(list(enumerate(self.layers))):
            if i + 1 < len(self.layers):
                torch.ops.aten.threshold_backward.grad_input(gradient, values[i + 1], 0, grad_input=gradient)
            if of_parameters:
                torch.mm(gradient.t(), values[i], out=weight.grad)
                torch.sum(gradient, dim=0, out=bias.grad)
            if i or of_input:
                gradient = gradient @ weight
        return gradient
