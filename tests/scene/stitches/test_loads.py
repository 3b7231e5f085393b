"""What stitches carry: the derivative of their energy, without what presses their sides together."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import initial_state
from supple.scene.stitches.measures import stitch_energies, stitch_loads

SOFT = sp.StableNeoHookean(youngs=1e4, poisson=0.3)
BOX = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))


def scene_of(stitch):
    return sp.Scene([sp.Body("low", BOX, SOFT), sp.Body("high", BOX, SOFT, position=(0, 0.11, 0))], stitches=[stitch])


def stitching_of(kind):
    reach = {"max_distance": 0.0101}
    if kind == "tets":
        return scene_of(sp.SoftVertexTriangleStitch("high", "low", youngs=1e4, poisson=0.3, **reach))
    return scene_of(sp.VertexEdgeStitch("high", "low", stiffness=30.0, **reach))


@pytest.mark.parametrize("kind", ["tets", "springs"])
def test_loads_are_derivatives_of_energies(kind):
    scene, rng = stitching_of(kind), np.random.default_rng(3)
    stitching, x = scene.stitching, initial_state(scene).positions
    x[8:] += (0.004, 0.01, -0.003)
    x += rng.normal(scale=5e-4, size=x.shape)
    loads = stitch_loads(stitching, stitching.points(x, 0.0))
    for k, vertex in enumerate(stitching.nodes()[:, 0]):
        force = np.zeros(3)
        for i in range(3):
            for sign in (1.0, -1.0):
                moved = x.copy()
                moved[vertex, i] += sign * 1e-7
                force[i] -= sign * stitch_energies(stitching, stitching.points(moved, 0.0))[k] / 2e-7
        assert loads[k] == pytest.approx(np.linalg.norm(force), rel=1e-5)


@pytest.mark.parametrize("kind", ["tets", "springs"])
def test_pressure_is_no_load(kind):
    scene = stitching_of(kind)
    stitching, x = scene.stitching, initial_state(scene).positions
    assert stitch_loads(stitching, stitching.points(x, 0.0)) == pytest.approx(0.0, abs=1e-9)
    x[8:, 1] -= 0.004
    assert stitch_loads(stitching, stitching.points(x, 0.0)) == pytest.approx(0.0, abs=1e-9)
    x[8:, 0] += 0.02
    assert (stitch_loads(stitching, stitching.points(x, 0.0)) > 0.01).all()


def test_seams_of_faces_that_touch_start_without_a_load():
    seam = sp.SoftVertexTriangleStitch("high", "low", max_distance=1e-6, youngs=1e4, poisson=0.3)
    bodies = [sp.Body("low", BOX, SOFT), sp.Body("high", BOX, SOFT, position=(0, 0.1, 0))]
    scene = sp.Scene(bodies, stitches=[seam])
    points = scene.stitching.points(initial_state(scene).positions, 0.0)
    assert (stitch_energies(scene.stitching, points) > 0.0).all()
    assert stitch_loads(scene.stitching, points) == pytest.approx(0.0, abs=1e-9)


def test_pairs_without_some_of_several_stitches_keep_their_laws():
    reach = {"max_distance": 0.0101}
    stitches = [
        sp.VertexVertexStitch("high", "low", stiffness=7.0, strength=2.0, name="one", **reach),
        sp.SoftVertexTriangleStitch("high", "low", youngs=1e4, poisson=0.3, strength=[1.0, 2.0, 3.0, 4.0], **reach),
        sp.VertexEdgeStitch("high", "low", stiffness=30.0, **reach),
        sp.SoftVertexTriangleStitch("low", "high", mu=[1.0, 2.0, 3.0, 4.0], lam=5.0, name="last", **reach),
    ]
    bodies = [sp.Body("low", BOX, SOFT), sp.Body("high", BOX, SOFT, position=(0, 0.11, 0))]
    whole = sp.Scene(bodies, stitches=stitches).stitching
    names = whole.names
    assert names.labels == ("one", "stitch of 'high' to 'low'", "stitch of 'high' to 'low'", "last")
    assert names.owner.tolist() == [1] * 4 + [3] * 4 + [0] * 4 + [2] * 4  # tets come first
    assert names.strength.tolist() == [1, 2, 3, 4] + [np.inf] * 4 + [2] * 4 + [np.inf] * 4
    broken = np.array([1, 6, 8, 15])
    left = whole.without(broken, broken[:1])
    assert left.tets.mu[3:].tolist() == [1.0, 2.0, 4.0]
    assert left.springs.stiffness.tolist() == [7.0] * 3 + [30.0] * 3
    assert np.array_equal(left.nodes(), np.delete(whole.nodes(), broken, axis=0))
    assert sorted(map(tuple, left.seams())) == sorted(map(tuple, np.delete(whole.nodes(), 1, axis=0)))
    assert {name: len(pairs) for name, pairs in names.named(broken).items()} == {
        "stitch of 'high' to 'low'": 2,
        "last": 1,
        "one": 1,
    }


def test_strength_is_above_zero():
    for bad in (0.0, -1.0, [1.0, 0.0], np.inf, "a"):
        with pytest.raises(sp.SceneError, match="strength"):
            sp.VertexVertexStitch("high", "low", max_distance=1, stiffness=1.0, strength=bad)
