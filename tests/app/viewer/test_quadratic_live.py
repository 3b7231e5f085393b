"""A body of quadratic tets on the live page: it moves, is described, drawn with its skin, and XPBD refuses it."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.describe import describe
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.simulation_loop import SimulationLoop
from supple.app.viewer.messages import frame_of
from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.live_source import LiveSource


def test_it_falls_and_is_drawn():
    ball = sp.shapes.sphere(0.1, 0.1, order=2)
    skin = sp.shapes.sphere_surface(0.1, 0.05)
    body = sp.Body("ball", ball, sp.StableNeoHookean(youngs=1e5, poisson=0.45), skin=skin)
    live = LiveScene(LiveSource("ball", sp.Scene([body]), sp.Implicit(contact=None), 1 / 60))
    assert live.step().status == "converged"
    described = describe(live)
    (shown,) = described.bodies
    np.testing.assert_array_equal(shown.body.mesh.nodes, ball.nodes)
    loop = SimulationLoop(live, CommandQueue(), None)
    model = frame_of(replace(loop.snapshot(0.0), description=described)).model
    np.testing.assert_array_equal(model.tets, ball.tets)
    (drawn,) = model.bodies
    assert drawn.skin.corners.shape == (len(skin.vertices), 10)
    fallen = drawn.skin.positions(live.state.positions) - skin.vertices
    np.testing.assert_allclose(fallen, np.tile([0.0, -9.81 / 3600, 0.0], (len(fallen), 1)), atol=1e-9)


def test_xpbd_says_what_to_do():
    mesh = sp.shapes.box((1, 1, 1), (1, 1, 1), order=2)
    scene = sp.Scene([sp.Body("cube", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.3))])
    with pytest.raises(sp.SolverError, match=r"mesh.to_order\(1\)"):
        LiveScene(LiveSource("cube", scene, sp.XPBD(), 1 / 60))
