"""Stitches of a scene: given and found pairs, numbers, rest shapes, and errors."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.scene.registry import PARTS
from supple.scene.rotation import rotation_matrix
from supple.scene.stitches.stitch import Stitch

SOFT = sp.StableNeoHookean(youngs=1e4, poisson=0.3)
BOX = sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2))
SHEET = sp.SurfaceMesh([[9, 9, 9], [-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[1, 3, 2], [1, 4, 3]])


def scene(*stitches, gap=0.01, turned=(0, 0, 0), shift=(0, 0, 0), obstacles=()):
    """Two boxes, one `gap` above the other, both turned and shifted."""
    R = rotation_matrix(turned)
    bodies = [
        sp.Body(name, BOX, SOFT, position=R @ [0, y, 0] + shift, rotation=turned)
        for name, y in (("low", -0.1), ("high", 0.1 + gap))
    ]
    return sp.Scene(bodies, obstacles, stitches=stitches)


def soft(first="high", second="low", **more):
    return sp.SoftVertexTriangleStitch(first, second, **({"youngs": 1e4, "poisson": 0.3} | more))


@pytest.mark.parametrize("turned", [(0, 0, 0), (0.3, -1.0, 2.0)])
def test_pairs_are_found_in_the_world(turned):
    found = scene(soft(max_distance=0.0101), turned=turned, shift=(3, -2, 5)).stitching
    (part,) = found.ranges
    assert sorted(part.pairs.vertices.tolist()) == np.flatnonzero(BOX.vertices[:, 1] < -0.099).tolist()
    assert part.pairs.distances == pytest.approx(np.full(9, 0.01), rel=1e-9)
    top = np.all(BOX.vertices[BOX.surface.triangles][:, :, 1] > 0.099, axis=1)
    assert top[part.pairs.rows].all()
    # Each vertex is above a corner of several triangles: the lowest number it is.
    for vertex, row in zip(part.pairs.vertices, part.pairs.rows, strict=True):
        above = BOX.vertices[vertex] * [1, -1, 1]
        corner = int(np.argmin(np.linalg.norm(BOX.vertices - above, axis=1)))
        assert row == min(t for t in np.flatnonzero(top) if corner in BOX.surface.triangles[t])
    assert len(found.tets) == 9
    assert np.all(found.tets.vertices[:, 0] >= len(BOX.vertices))
    assert np.all(found.tets.vertices[:, 1:] < len(BOX.vertices))
    assert not found.tets.offset.any()


@pytest.mark.parametrize("gap", [1e-3, 0.01])
@pytest.mark.parametrize("pairing", ["closest", "all"])
def test_the_same_pairs_are_found_far_from_the_origin(gap, pairing):
    """Where round-off is a thousand times larger, it must still not decide which of equally near triangles it is."""
    rng = np.random.default_rng(0)
    here = scene(soft(max_distance=gap + 1e-9, pairing=pairing), gap=gap).stitching.tets.vertices
    for _ in range(4):
        place = {"turned": rng.normal(size=3), "shift": 100.0 * rng.normal(size=3)}
        there = scene(soft(max_distance=gap + 1e-9, pairing=pairing), gap=gap, **place).stitching.tets.vertices
        assert np.array_equal(there, here)


@pytest.mark.parametrize("turned", [(0, 0, 0), (0.3, -1.0, 2.0)])
@pytest.mark.parametrize(("shift", "size"), [((0, 0, 0), 1.0), ((3, -2, 5), 1.0), ((0, 0, 0), 0.03)])
def test_faces_that_touch_are_paired_with_each_other(turned, shift, size):
    """All triangles around a corner are at the distance 0, and all heights are 0: the vertex's normal decides."""
    mesh = sp.shapes.box((0.5 * size, 0.1 * size, 0.1 * size), (5, 3, 3))
    R = rotation_matrix(turned)
    bodies = [
        sp.Body(name, mesh, SOFT, position=R @ [x * size, 0, 0] + shift, rotation=turned)
        for name, x in (("a", 0.25), ("b", 0.75))
    ]
    (part,) = sp.Scene(bodies, stitches=[soft("a", "b", max_distance=1e-6 * size)]).stitching.ranges
    assert len(part.pairs.rows) == 16
    end = mesh.vertices[:, 0] < -0.2499 * size
    assert end[mesh.surface.triangles[part.pairs.rows]].all()


def test_the_default_distance_is_a_hundredth_of_the_mean_edge():
    for scale in (1.0, 0.03):
        box = sp.shapes.box((0.2 * scale, 0.2 * scale, 0.2 * scale), (2, 2, 2))
        bodies = [sp.Body("low", box, SOFT), sp.Body("high", box, SOFT, position=(0, 0.2 * scale, 0))]
        tets = sp.Scene(bodies, stitches=[soft(max_distance=1e-6 * scale)]).stitching.tets
        assert tets.offset.all()
        heights = 3.0 * tets.rest_volumes / (0.5 * (0.1 * scale) ** 2)
        of_triangle = 0.1 * scale * (2 + np.sqrt(2)) / 3
        assert heights.max() == pytest.approx(0.01 * of_triangle, rel=1e-9)
        # At some vertices of the upper box the mean edge is shorter.
        assert heights.min() >= 0.01 * 0.1 * scale


def test_the_default_distance_to_a_large_triangle_is_that_of_the_fine_mesh():
    sheet = sp.obstacles.TriangleObstacle(name="sheet", surface=SHEET)
    tets = scene(soft("low", "sheet", max_distance=1e-6), obstacles=[sheet]).stitching.tets
    assert tets.offset.all()
    assert (3.0 * tets.rest_volumes / 2.0).max() <= 0.01 * 0.1 * np.sqrt(2)


def test_pairing_all_finds_every_triangle_in_reach():
    pairs = scene(soft(max_distance=0.0101, pairing="all")).stitching.ranges[0].pairs
    top = np.flatnonzero(np.all(BOX.vertices[BOX.surface.triangles][:, :, 1] > 0.099, axis=1))
    wanted = set()
    for vertex in np.flatnonzero(BOX.vertices[:, 1] < -0.099):
        corner = int(np.argmin(np.linalg.norm(BOX.vertices - BOX.vertices[vertex] * [1, -1, 1], axis=1)))
        # ... the sides of the lower box, too, whose upper edge is as near.
        wanted |= {(int(vertex), t) for t, tri in enumerate(BOX.surface.triangles) if corner in tri}
    assert set(zip(pairs.vertices.tolist(), pairs.rows.tolist(), strict=True)) == wanted
    assert len(wanted) > len(top)


def test_springs_join_vertices_and_edges():
    vertex = sp.VertexVertexStitch("high", "low", max_distance=0.0101, stiffness=10.0)
    edge = sp.VertexEdgeStitch("high", "low", max_distance=0.0101, stiffness=10.0, rest_length=0.02)
    given = sp.VertexEdgeStitch("high", "low", pairs=[[0, 3], [1, 5]], stiffness=[1.0, 2.0], rest_length=[0.0, 0.1])
    found = scene(vertex, edge, given).stitching
    assert [len(part.pairs.rows) for part in found.ranges] == [9, 9, 2]
    assert found.springs.rest_lengths[:9] == pytest.approx(np.full(9, 0.01))
    assert found.springs.rest_lengths[9:].tolist() == [0.02] * 9 + [0.0, 0.1]
    assert found.springs.stiffness[18:].tolist() == [1.0, 2.0]
    ends = found.springs.vertices[18:, 1:]
    assert np.array_equal(ends, BOX.surface.edges[[3, 5]])
    x = initial_state(scene()).positions
    lengths = np.linalg.norm(found.springs.extensions(x), axis=1)
    assert lengths[:18] == pytest.approx(np.full(18, 0.01))
    assert lengths[18:] == pytest.approx(found.ranges[2].pairs.distances)


def test_values_may_be_given_for_each_pair():
    stitch = sp.SoftVertexTriangleStitch(
        "high", "low", pairs=[[0, 1], [4, 7]], mu=[1.0, 2.0], lam=[3.0, 4.0], min_separate_distance=[0.5, 1e-6]
    )
    tets = scene(stitch).stitching.tets
    assert tets.mu.tolist() == [1.0, 2.0]
    assert tets.lam.tolist() == [3.0, 4.0]
    assert tets.offset.tolist() == [True, False]
    engineering = soft(pairs=[[0, 1], [4, 7]], youngs=[1e5, 2e5], poisson=[0.25, 0.1])
    assert engineering.mu == pytest.approx([4e4, 2e5 / 2.2])
    assert engineering.lam == pytest.approx([4e4, 2e5 * 0.1 / (1.1 * 0.8)])


@pytest.mark.parametrize("shift", [(0, 0, 0), (100, -70, 30)])
@pytest.mark.parametrize("given", [{"max_distance": 1e-6}, {"pairs": [[k, 0] for k in range(27)]}])
def test_touching_pairs_have_the_distance_zero(shift, given):
    """Otherwise springs of 1e-17 m would report stretches of 1e13."""
    touching = sp.VertexEdgeStitch("high", "low", stiffness=1.0, **given)
    one = scene(touching, gap=0.0, turned=(0.3, -1.0, 2.0), shift=shift)
    (part,) = one.stitching.ranges
    nearest = part.pairs.distances < 1e-9
    assert nearest.all() or "pairs" in given
    assert not part.pairs.distances[nearest].any()
    assert not one.stitching.springs.rest_lengths[nearest].any()


def test_a_stitch_can_be_made_from_another_one():
    harder = replace(soft(pairs=[[0, 1]], youngs=1e5, poisson=0.25), damping=0.1)
    assert (float(harder.mu), float(harder.lam), harder.damping) == (4e4, 4e4, 0.1)
    assert float(replace(harder, youngs=2e5, mu=None, lam=None).mu) == 8e4
    with pytest.raises(sp.SceneError, match="give one pair, not both"):
        replace(harder, youngs=2e5)


def test_energy_density_checks_the_shape_of_F():
    for wrong in ("x", [[1, 2], [3]], np.eye(2)):
        with pytest.raises(sp.SceneError, match="its last two axes must be"):
            soft(pairs=[[0, 1]]).energy_density(wrong)


def test_rest_shapes_do_not_depend_on_the_start_of_the_simulation():
    one = scene(soft(max_distance=0.0101))
    squashed = initial_state(one, {"low": BOX.vertices * [1, 0.5, 1] + [0, -0.3, 0]})
    assert np.array_equal(build_system(one, squashed).stitching.tets.vertices, one.stitching.tets.vertices)
    assert np.array_equal(
        build_system(one, squashed).stitching.tets.rest_shape_inverse, one.stitching.tets.rest_shape_inverse
    )


def test_stitches_to_triangle_obstacles_follow_their_motion():
    moving = sp.Keyframes([0, 1], [[0, 0, 0], [0, 0, 2]])
    sheet = sp.obstacles.TriangleObstacle(name="sheet", surface=SHEET, motion=moving)
    one = scene(soft("low", "sheet", max_distance=1e-6), gap=1.0, obstacles=[sp.HalfSpace(point=(0, -9, 0)), sheet])
    found = one.stitching
    assert found.anchors.owner.tolist() == [1] * len(found.anchors)
    assert len(found.anchors) == 4
    n = found.body_vertices
    assert found.tets.vertices[:, 1:].min() >= n
    x = initial_state(one).positions
    for time, z in ((0.0, 0.0), (0.5, 1.0), (1.0, 2.0)):
        there = found.points(x, time)[n:]
        assert np.allclose(there, SHEET.vertices[found.anchors.vertices] + [0, 0, z])
    assert (found.elements()[:, 1:] == -1).all()
    assert set(found.anchored_vertices()) == set(found.tets.vertices[:, 0])
    joined = found.joined_components(np.repeat([0, 1], len(BOX.vertices)).astype(np.int32))
    assert joined.max() == 1, "the box above is not joined"


def test_stitched_bodies_are_one_component():
    third = sp.Body("third", BOX, SOFT, position=(5, 0, 0))
    bodies = [*scene().bodies, third]
    system = build_system(sp.Scene(bodies, stitches=[soft(max_distance=0.02)]))
    assert system.components.max() == 2
    joined = system.joined_components
    assert [len(np.unique(joined[part.vertices])) for part in system.bodies] == [1, 1, 1]
    assert joined[system.bodies[0].vertices][0] == joined[system.bodies[1].vertices][0]
    assert joined[system.bodies[2].vertices][0] != joined[0]


def test_the_error_for_nothing_in_reach_names_the_smallest_distance():
    with pytest.raises(sp.SceneError) as caught:
        build_system(scene(soft(max_distance=0.005, name="seam")))
    assert "stitch 'seam'" in str(caught.value)
    assert "smallest distance is 0.01 m" in str(caught.value)


LOWEST = BOX.vertices[6] - [0, 0.1, 0]
FLAT = sp.SurfaceMesh(
    [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], LOWEST, np.add(LOWEST, [1, 0, 0]), np.add(LOWEST, [0, 0, 1])],
    [[0, 1, 2], [0, 1, 3], [4, 5, 6]],
)
REFUSED = {
    "itself": (lambda: soft("low", "low", max_distance=1), "joins a body with itself"),
    "neither": (lambda: soft(), "none of them given; give exactly one of pairs and max_distance"),
    "both": (lambda: soft(pairs=[[0, 0]], max_distance=1), "pairs and max_distance given; give exactly one"),
    "pairing": (lambda: soft(max_distance=1, pairing="some"), "pairing is 'some'; give 'closest' or 'all'"),
    "far": (lambda: soft(max_distance=-1), "max_distance is -1"),
    "shape": (lambda: soft(pairs=[0, 1]), "pairs must be a list"),
    "negative": (lambda: soft(pairs=[[0, -1]]), "pairs holds -1"),
    "twice": (lambda: soft(pairs=[[0, 1], [0, 1]]), "names a pair twice"),
    "fractions": (lambda: soft(pairs=[[0.5, 1]]), "whole numbers"),
    "moduli": (lambda: soft(pairs=[[0, 0]], mu=1.0), "give mu and lam, or youngs and poisson"),
    "half": (lambda: soft(pairs=[[0, 0]], poisson=0.5), "poisson is 0.5"),
    "no poisson": (lambda: soft(pairs=[[0, 0]], poisson=0.0), "poisson is 0; it must be above zero"),
    "youngs": (lambda: soft(pairs=[[0, 0]], youngs=np.nan), "youngs is nan"),
    "lam": (
        lambda: sp.SoftVertexTriangleStitch("high", "low", pairs=[[0, 0]], mu=1.0, lam=0.0),
        "lam is 0; it must be above zero",
    ),
    "d": (lambda: soft(pairs=[[0, 0]], min_separate_distance=0.0), "min_separate_distance is 0"),
    "damping": (lambda: soft(pairs=[[0, 0]], damping=-1.0), "damping is -1"),
    "stiffness": (lambda: sp.VertexVertexStitch("high", "low", pairs=[[0, 0]], stiffness=0.0), "stiffness is 0"),
    "rest length": (
        lambda: sp.VertexEdgeStitch("high", "low", pairs=[[0, 0]], stiffness=1.0, rest_length=-1.0),
        "rest_length is -1",
    ),
    "vertex": (lambda: soft(pairs=[[99, 0]]), "number 99 of 27 vertices"),
    "triangle": (lambda: soft(pairs=[[0, 99]]), "number 99 of 48 triangles"),
    "edge": (lambda: sp.VertexEdgeStitch("high", "low", pairs=[[0, 999]], stiffness=1.0), "number 999 of 72 edges"),
    "count": (lambda: soft(pairs=[[0, 0], [1, 1]], youngs=[1.0, 2.0, 3.0]), "3 values for 2 pairs"),
    "unlike": (lambda: soft(pairs=[[0, 0]], youngs=[1.0, 2.0], poisson=[0.1] * 3), "youngs has 2 values and poisson 3"),
    "counts": (lambda: soft(pairs=[[0, 0], [1, 1]], youngs=[1.0] * 3), "youngs has 3 values for 2 pairs"),
    "thin": (
        lambda: soft("low", "flat", pairs=[[6, 2]], min_separate_distance=1e-18),
        "in the plane of triangle 2",
    ),
    "body": (lambda: soft("top", pairs=[[0, 0]]), "body 'top' does not exist"),
    "second": (lambda: soft("low", "top", pairs=[[0, 0]]), "body or obstacle 'top' does not exist"),
    "floor": (lambda: soft("low", "floor", pairs=[[0, 0]]), "stitches join bodies and TriangleObstacles"),
    "flat": (lambda: soft("low", "flat", pairs=[[0, 0]]), "triangle 0 of obstacle 'flat' has no area"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_errors(case):
    make, text = REFUSED[case]
    obstacles = [sp.HalfSpace(name="floor", point=(0, -5, 0)), sp.obstacles.TriangleObstacle(name="flat", surface=FLAT)]
    with pytest.raises(sp.SceneError) as caught:
        build_system(scene(make(), obstacles=obstacles))
    assert text in str(caught.value)


def test_every_kind_is_registered_and_public():
    def kinds(base):
        return {sub for direct in base.__subclasses__() for sub in ({direct} | kinds(direct))}

    concrete = {kind for kind in kinds(Stitch) if not getattr(kind, "__abstractmethods__", None)}
    assert concrete == set(PARTS["stitches"].kinds)
    assert all(getattr(sp, kind.__name__) is kind for kind in concrete)
