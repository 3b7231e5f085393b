"""Poisson's ratio: its range, and that an auxetic bar becomes wider when it is stretched."""

import numpy as np
import pytest

import supple as sp
from supple.errors import SceneError
from supple.materials.elastic import ELASTIC_MATERIALS

YOUNGS, AUXETIC = 1e5, -0.3


@pytest.mark.parametrize("kind", ELASTIC_MATERIALS)
def test_the_range_is_from_above_minus_one_to_below_one_half(kind):
    for poisson in (-0.999, 0.0, 0.499):
        assert kind(youngs=YOUNGS, poisson=poisson).poisson == poisson
    for poisson in (-1.0, 0.5, np.nan):
        with pytest.raises(SceneError, match=r"poisson is .*; it must be above -1 and below 0\.5"):
            kind(youngs=YOUNGS, poisson=poisson)
    with pytest.raises(SceneError, match=r"poisson is 'soft'; give a number above -1 and below 0\.5"):
        kind(youngs=YOUNGS, poisson="soft")


def lateral_stretch(along):
    """Of a stable Neo-Hookean bar with free sides: P_22 = 0 gives b^2 = (1 + mu / lam (1 - 1 / along)) / along."""
    mu, lam = sp.StableNeoHookean(youngs=YOUNGS, poisson=AUXETIC).lame_parameters()
    return float(np.sqrt((1.0 + mu / lam * (1.0 - 1.0 / along)) / along))


@pytest.mark.parametrize(
    ("solver", "dt", "steps", "tolerance"),
    [
        pytest.param(sp.Implicit(integrator="static", contact=None), 1.0, 1, 1e-6, id="implicit"),
        pytest.param(sp.XPBD(substeps=60, contact=None), 1 / 60, 90, 1e-2, id="xpbd"),
    ],
)
@pytest.mark.parametrize("along", [1.05])
def test_an_auxetic_bar_in_both_solvers(solver, dt, steps, tolerance, along):
    """A bar held at its ends in the homogeneous state, and disturbed between them, returns to that state."""
    across = lateral_stretch(along)
    assert (across - 1.0) * (along - 1.0) > 0.0
    mesh = sp.shapes.box((0.1, 0.2, 0.1), (2, 4, 2))
    exact = mesh.vertices * (across, along, across)
    ends = np.flatnonzero(np.abs(mesh.vertices[:, 1]) > 0.1 - 1e-9)
    start = exact + np.random.default_rng(0).uniform(-1e-3, 1e-3, exact.shape)
    start[ends] = exact[ends]
    material = sp.StableNeoHookean(youngs=YOUNGS, poisson=AUXETIC, damping=0.002)
    scene = sp.Scene(bodies=[sp.Body("bar", mesh, material)], pins=[sp.Pin("bar", ends)], gravity=(0, 0, 0))
    *_, frame = sp.simulate(scene, solver, dt, steps, initial_positions={"bar": start})
    assert frame.report.status == "converged"
    error = np.abs(frame.positions["bar"] - exact).max()
    assert error <= tolerance * abs(across - 1.0) * 0.05
