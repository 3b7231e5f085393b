"""Derivatives by fields are those by parameters that change one entry, or all entries in some proportion."""

import numpy as np
import pytest
from tests.gradients import scenes
from tests.gradients.scenes import implicit

import supple as sp

WAYS = np.random.default_rng(2)


def bar_of(vertices=None, moduli=None, damping=0.0, **placed):
    mesh = sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1))
    vertices = mesh.vertices if vertices is None else vertices
    youngs = 1e5 if moduli is None else 1e5 * moduli
    rubber = sp.StableNeoHookean(youngs=youngs, poisson=0.35, damping=damping, density=1000)
    return sp.Body("bar", sp.TetMesh(vertices, mesh.tets), rubber, **placed)


def one(scene_of, solver, steps=5):
    count = len(sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1)).vertices)
    loss = sp.Misfit("positions", "bar", WAYS.standard_normal((count, 3)) * 0.1)
    return sp.Sensitivity(scene_of, loss, solver, dt=0.01, steps=steps)


@pytest.mark.parametrize("integrator", ["static", "bdf2"])
def test_moduli(integrator):
    count = len(bar_of().mesh.tets)
    along = WAYS.standard_normal(count)

    def scene_of(p):
        body = bar_of(moduli=np.exp(p[0] * along), damping=0.0 if integrator == "static" else 0.02)
        return sp.Scene([body], pins=[sp.Pin("bar", scenes.end(body, -1))])

    found = one(scene_of, implicit(integrator), 2).gradient([0.0], moduli=True)
    assert found.moduli["bar"] @ along == pytest.approx(found.by_parameters[0], rel=1e-6)


def test_moduli_where_the_barrier_follows_them():
    count = len(bar_of().mesh.tets)
    along = WAYS.uniform(0.5, 1.5, count)

    def scene_of(p):
        body = bar_of(moduli=np.exp(p[0] * along), position=(0, 0.0502, 0), velocity=(0, -0.3, 0))
        return sp.Scene([body], obstacles=[sp.HalfSpace(name="floor")])

    found = one(scene_of, implicit(), 5).gradient([0.0], moduli=True)
    assert found.moduli["bar"] @ along == pytest.approx(found.by_parameters[0], rel=1e-6)


@pytest.mark.parametrize("integrator", ["static", "bdf2"])
def test_rest_positions(integrator):
    """Pins hold vertices where they start, and the body is turned."""
    start = bar_of().mesh.vertices
    along = 0.1 * WAYS.standard_normal(start.shape)
    held = scenes.end(bar_of(), -1)

    def scene_of(p):
        body = bar_of(start + p[0] * along, rotation=(0, 0, 0.5))
        return sp.Scene([body], pins=[sp.Pin("bar", held, motion=lambda t: (0.0, 0.2 * t, 0.0))])

    found = one(scene_of, implicit(integrator), 3).gradient([0.0], rest=True)
    assert np.vdot(found.rest_positions["bar"], along) == pytest.approx(found.by_parameters[0], rel=1e-5)


def test_parameters_can_be_chosen():
    cantilever = one(scenes.cantilever, implicit())
    all_of_them = cantilever.gradient(np.ones(4)).by_parameters
    assert cantilever.gradient(np.ones(4), [2, 0]).by_parameters == pytest.approx(all_of_them[[2, 0]], rel=1e-12)
    assert len(cantilever.gradient(np.ones(4), []).by_parameters) == 0
