"""Losses as functions of PyTorch and JAX, whose derivatives are those of `Sensitivity`."""

import sys

import numpy as np
import pytest
from tests.gradients import scenes
from tests.gradients.scenes import implicit

import supple as sp

START = [1.1, 0.9]


def sensitivity(loss=None):
    loss = loss or sp.Misfit("positions", "bar", np.full((20, 3), 0.1))
    return sp.Sensitivity(lambda p: scenes.cantilever([p[0], p[1], 1, 1]), loss, implicit(), dt=0.01, steps=3)


def test_torch():
    torch = pytest.importorskip("torch")
    value, gradient = sensitivity().value_and_gradient(START)
    run = sensitivity().torch()
    logarithms = torch.log(torch.tensor(START, dtype=torch.float64)).requires_grad_()
    loss = 3.0 * run(torch.exp(logarithms))
    loss.backward()
    assert loss.item() == pytest.approx(3.0 * value, rel=1e-12)
    assert logarithms.grad.numpy() == pytest.approx(3.0 * gradient * START, rel=1e-9)
    assert run(torch.tensor(START)).item() == pytest.approx(value, rel=1e-6)  # of 32 bits, without a gradient
    assert torch.autograd.gradcheck(run, logarithms.detach().exp().requires_grad_(), eps=1e-5, atol=1e-7, rtol=1e-4)


def test_a_loss_in_torch():
    torch = pytest.importorskip("torch")

    def highest(frame):
        y = torch.tensor(frame.positions["bar"], requires_grad=True)
        value = torch.logsumexp(20.0 * y[:, 1], 0)
        value.backward()
        return value.item(), {"bar": y.grad.numpy()}

    found = sensitivity(highest).check(START, 1, step=1e-5)
    assert found.relative <= 1e-6, str(found)


def test_jax():
    jax = pytest.importorskip("jax")
    value, gradient = sensitivity().value_and_gradient(START)
    with jax.enable_x64(True):
        run = sensitivity().jax()
        by = jax.jit(jax.value_and_grad(lambda q: 3.0 * run(jax.numpy.exp(q))))
        found, slope = by(jax.numpy.log(jax.numpy.array(START)))
    assert float(found) == pytest.approx(3.0 * value, rel=1e-12)
    assert np.asarray(slope) == pytest.approx(3.0 * gradient * START, rel=1e-9)


@pytest.mark.parametrize("name", ["torch", "jax"])
def test_what_is_not_installed_says_so(name, monkeypatch):
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(sp.SuppleError, match=rf"is not installed; pip install 'supple\[{name}\]'"):
        getattr(sensitivity(), name)()
