"""`Implicit(max_iterations=1)`: one linearization a step, for real time."""

from __future__ import annotations

import numpy as np

import supple as sp
from supple.mesh import shapes


def cantilever() -> sp.Scene:
    mesh = shapes.box((1.0, 0.1, 0.1), (24, 2, 2))
    wall = np.flatnonzero(mesh.vertices[:, 0] < mesh.vertices[:, 0].min() + 1e-9)
    material = sp.StableNeoHookean(youngs=1e6, poisson=0.4, density=1000.0)
    return sp.Scene([sp.Body("beam", mesh, material)], pins=[sp.Pin("beam", wall)])


def test_a_beam_swings_as_with_the_whole_method():
    tips = []
    for most in (120, 1):
        frames = list(sp.simulate(cantilever(), sp.Implicit(max_iterations=most), 1 / 60, 30))
        assert all(frame.report.details.substeps == 1 for frame in frames)
        tips.append(np.array([frame.positions["beam"][:, 1].min() for frame in frames]))
    assert frames[5].report.status == "iteration_limit"
    assert frames[5].report.iterations == 1
    assert np.abs(tips[1] - tips[0]).max() < 0.03 * np.abs(tips[0]).max()
