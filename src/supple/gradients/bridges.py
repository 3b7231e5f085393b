"""A simulation within PyTorch and JAX: a loss as one of their functions, whose derivative is the adjoint's."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SuppleError


class Differentiable(Protocol):
    """A function of parameters (q,) with its gradient: a `Sensitivity`."""

    def value(self, p: ArrayLike) -> float: ...
    def value_and_gradient(self, p: ArrayLike) -> tuple[float, NDArray[np.float64]]: ...


def torch_function(loss: Differentiable) -> Callable[[Any], Any]:
    """The loss as a function of PyTorch."""
    try:
        torch = import_module("torch")
    except ImportError:
        raise _missing("PyTorch", "torch") from None

    class Simulated(torch.autograd.Function):
        @staticmethod
        def forward(ctx: Any, p: Any) -> Any:
            at = p.detach().cpu().double().numpy()
            if not p.requires_grad:
                return p.new_tensor(loss.value(at), dtype=torch.float64)
            value, gradient = loss.value_and_gradient(at)
            ctx.save_for_backward(torch.from_numpy(gradient).to(p))
            return p.new_tensor(value, dtype=torch.float64)

        @staticmethod
        def backward(ctx: Any, *above: Any) -> Any:
            (gradient,) = ctx.saved_tensors
            return above[0].to(gradient) * gradient

    return Simulated.apply


def jax_function(loss: Differentiable) -> Callable[[Any], Any]:
    """The loss as a function of JAX."""
    try:
        jax = import_module("jax")
    except ImportError:
        raise _missing("JAX", "jax") from None

    def run(p: Any) -> tuple[Any, Any]:
        value, gradient = loss.value_and_gradient(np.asarray(p, dtype=np.float64))
        return np.asarray(value, dtype=p.dtype), gradient.astype(p.dtype)

    def forward(p: Any) -> tuple[Any, Any]:
        shapes = jax.ShapeDtypeStruct((), p.dtype), jax.ShapeDtypeStruct(p.shape, p.dtype)
        return jax.pure_callback(run, shapes, p)

    simulated = jax.custom_vjp(lambda p: forward(p)[0])
    simulated.defvjp(forward, lambda gradient, above: (above * gradient,))
    return simulated


def _missing(title: str, extra: str) -> SuppleError:
    return SuppleError(f"this needs {title}, which is not installed; pip install 'supple[{extra}]'")
