"""Where a step begins in which pins move: bodies go on as they do, as far as nothing is in the way."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.inversion_guard import InversionGuard
from supple.solvers.implicit.step_limits import StepLimits
from supple.solvers.implicit.stepping.integrators import integrator_of
from supple.solvers.implicit.stepping.substep import _going_on, _without_forces

H = 0.01


def begun(height, way, integrator="backward_euler"):
    """Positions (8, 3) of a cube that is held at its top and moves along `way`, and where its step begins."""
    cube = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)
    body = sp.Body("cube", cube, rubber, position=(0, height, 0), velocity=tuple(np.asarray(way) / H))
    top = np.flatnonzero(cube.vertices[:, 1] > cube.vertices[:, 1].max() - 1e-9)
    motion = sp.Keyframes([0.0, H], displacements=[(0, 0, 0), way])
    scene = sp.Scene([body], [sp.HalfSpace()], pins=[sp.Pin("cube", top, motion)])
    workspace = sp.Implicit().prepare(build_system(scene))
    system, state = workspace.system, workspace.extended(initial_state(scene))
    limits = StepLimits(InversionGuard.at(system, state.positions), workspace.contact, workspace.tools.clock)
    plan = integrator_of(integrator).plan(system, state, H)
    x = state.positions
    there = _going_on(x, _without_forces(system, plan, system.pin_targets(H)), limits)
    return x[:8], there[:8]


def test_nothing_in_the_way():
    x, there = begun(0.1, (0.01, 0.02, 0.0))
    np.testing.assert_allclose(there - x, np.broadcast_to([0.01, 0.02, 0.0], x.shape), atol=1e-15)


# The floor is 10 mm below the cube, which keeps a tenth of the distance.
@pytest.mark.parametrize(("way", "share"), [(0.018, 0.5), (0.036, 0.0)])
def test_a_floor_in_the_way(way, share):
    x, there = begun(0.06, (0.0, -way, 0.0))
    np.testing.assert_allclose(there - x, np.broadcast_to([0.0, -share * way, 0.0], x.shape), atol=1e-12)
