"""Rods in `XPBD`: gradients of the projections, the shapes of `Implicit`, momentum, and contact at their radius."""

import numpy as np
import pytest
from tests.ropes import line, rope

import supple as sp
from supple.materials.rods.elements import PAIRED


def beam(edges, length=0.2, **more):
    """Along x, with one more edge before 0."""
    x = np.concatenate([[-length / edges], np.linspace(0.0, length, edges + 1)])
    given = {"youngs": 1e6, "poisson": 0.3, "radius": 0.005, "damping": 0.05}
    return sp.Rod("rod", np.column_stack([x, 0 * x, 0 * x]), sp.RodMaterial(**given | more))


def test_slopes_of_strains_are_their_derivatives():
    rng = np.random.default_rng(2)
    points = np.cumsum(np.array([[0.1, 0, 0]] * 4) + 0.03 * rng.normal(size=(4, 3)), axis=0)
    edges = [[0, 1], [2, 1], [3, 1]]
    rod = sp.Rod("rod", points, sp.RodMaterial(youngs=1e6, radius=0.02), edges=edges)
    elements = rod.elements(np.zeros(3, dtype=bool))
    x, d = rod.points + 0.005 * rng.normal(size=rod.points.shape), rng.normal(size=rod.points.shape)
    step = 1e-6
    differences = (elements.bends(x + step * d) - elements.bends(x - step * d)) / (2.0 * step)
    slopes = np.einsum("ckvi,vp->ckpi", elements.bend_slopes(x)[1], PAIRED)
    nodes = elements.nodes[elements.joints].reshape(-1, 8)
    np.testing.assert_allclose(np.einsum("ckpi,cpi->ck", slopes, d[nodes]), differences, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("twisted", [False, True])
def test_it_comes_to_rest_as_in_the_implicit_solver(twisted):
    """A cantilever with a force at its tip; twisted: with an end that turns, of a rod that is bent by half a turn."""
    rod, edges = beam(6, damping=0.3), 6
    B = rod.material.bending_stiffness
    pins, forces = [sp.Pin("rod", [0, 1])], [sp.Force("rod", [edges + 1], force=(0.0, -0.3 * B / 0.04, 0.0))]
    if twisted:
        turns = sp.Keyframes([0.0, 0.3], rotations=[[0, 0, 0], [1.5, 0, 0]])
        pins.append(sp.Pin("rod", [edges, edges + 1], motion=turns))
        forces = [sp.Force("rod", [3], force=(0.0, -2.0 * B / 0.04, 0.0))]
    scene = sp.Scene([rod], gravity=(0, 0, 0), pins=pins, forces=forces)
    *_, wanted = sp.simulate(scene, sp.Implicit(integrator="static", contact=None), 1.0, 1)
    *_, frame = sp.simulate(scene, sp.XPBD(substeps=30, contact=None), 1 / 60, 60)
    moved = wanted.positions["rod"] - rod.points
    error = np.linalg.norm(frame.positions["rod"] - wanted.positions["rod"], axis=1).max()
    assert error < 0.03 * np.linalg.norm(moved, axis=1).max()


def test_free_rods_keep_their_momentum_and_spin(tmp_path):
    rod = beam(6, damping=0.0, youngs=1e5).changed(velocity=(1.0, 0.0, 0.0), angular_velocity=(3.0, 5.0, 2.0))
    path = tmp_path / "rod.h5"
    for _ in sp.simulate(sp.Scene([rod], gravity=(0, 0, 0)), sp.XPBD(), 1 / 60, 20, sinks=[sp.Recorder(path)]):
        pass
    for name in ("linear_momentum", "angular_momentum"):
        series = sp.read_recording(path).series(name)
        np.testing.assert_allclose(series[-1], series[0], atol=1e-3 * np.linalg.norm(series[0]))


def soft_rope(name, points, **more):
    return rope(name, points, 1e5, 0.01, **more)


def test_rods_lie_on_a_floor_and_on_each_other_at_their_radius(tmp_path):
    bodies = [
        soft_rope("below", line(8, 0.2), position=(0, 0.006, 0)),
        soft_rope("above", line(8, 0.2, 2), position=(0, 0.017, 0)),
    ]
    path = tmp_path / "rods.h5"
    scene = sp.Scene(bodies, obstacles=[sp.obstacles.HalfSpace(friction=0.5)])
    *_, frame = sp.simulate(scene, sp.XPBD(), 1 / 60, 40, sinks=[sp.Recorder(path)])
    low, high = (frame.positions[name][:9] for name in ("below", "above"))
    assert low[:, 1].min() == pytest.approx(0.005, abs=1e-4)
    assert high[4, 1] - low[4, 1] == pytest.approx(0.01, abs=5e-4)
    report = sp.check_recording(path)
    assert {"tunnelling", "intersection", "obstacles"}.isdisjoint(one.name for one in report.failures), str(report)


def test_a_fast_rod_does_not_pass_another(tmp_path):
    bodies = [
        soft_rope("held", line(10, 0.2)),
        soft_rope("fast", line(11, 0.2, 2), position=(0.003, 0.1, 0), velocity=(0, -20.0, 0)),
    ]
    path = tmp_path / "rods.h5"
    scene = sp.Scene(bodies, pins=[sp.Pin("held", [0, 1, 9, 10])])
    *_, frame = sp.simulate(scene, sp.XPBD(), 1 / 60, 6, sinks=[sp.Recorder(path)])
    gap = frame.positions["fast"][4:8, 1].mean() - frame.positions["held"][4:7, 1].mean()
    assert gap > 0.0
    assert "tunnelling" not in [one.name for one in sp.check_recording(path).failures]
