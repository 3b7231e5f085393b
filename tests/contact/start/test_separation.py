"""Moving bodies apart: as a whole, by little, upwards rather than down, and never where it does not help."""

import numpy as np
import pytest

import supple as sp
from supple.contact.start.intersections import intersections_of
from supple.contact.start.separation import default_gap, separate
from supple.contact.start.surfaces import start_surfaces
from supple.errors import SceneError
from supple.model.system import build_system, initial_state
from supple.scene.contact_pairs import pair_table

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4)


def cube(name, position, size=1.0, rotation=(0, 0, 0), density=1000.0):
    mesh = sp.shapes.box((size, size, size), (2, 2, 2))
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=density)
    return sp.Body(name, mesh, material, position=position, rotation=rotation)


def apart(scene, positions=None):
    x = initial_state(scene, positions).positions
    return intersections_of(start_surfaces(build_system(scene), x, 0.0), pair_table(scene)) == []


def test_separate_scenes_are_not_changed():
    scene = sp.Scene([cube("a", (0, 0.6, 0))], [sp.HalfSpace()])
    result = separate(scene)
    assert result.moves == ()
    assert result.scene is scene


def test_the_lighter_of_two_moves_by_the_overlap_and_the_gap():
    scene = sp.Scene([cube("a", (0, 0, 0), density=1), cube("b", (0.8, 0.1, 0.2))])
    result = separate(scene, gap=0.01)
    (move,) = result.moves
    assert move.body == "a"
    assert move.shift == pytest.approx([-0.21, 0, 0], abs=1e-9)
    assert np.asarray(result.scene.body("a").position) == pytest.approx(move.shift)
    assert apart(result.scene)


def test_a_stack_rises_from_the_floor():
    scene = sp.Scene([cube(f"c{i}", (0, 0.49 + 0.99 * i, 0)) for i in range(5)], [sp.HalfSpace()])
    result = separate(scene, gap=0.001)
    assert [move.body for move in result.moves] == [f"c{i}" for i in range(5)]
    for i, move in enumerate(result.moves):
        assert move.shift == pytest.approx([0, 0.011 * (i + 1), 0], abs=1e-9)
    assert apart(result.scene)


@pytest.mark.parametrize(
    ("obstacle", "position", "up"),
    [
        (sp.obstacles.Box(center=(0, -0.5, 0), size=(4, 1, 4)), (0, 0.4, 0), True),
        (sp.obstacles.Sphere(center=(0, -2, 0), radius=2), (0, 0.4, 0), True),
        (sp.obstacles.Sphere(center=(0, 0, 0), radius=2, inside=True), (0, 1.5, 0), False),
        (sp.obstacles.Box(center=(0, 2, 0), size=(4, 4, 4), inside=True), (0, 0.4, 0), True),
        (
            sp.obstacles.TriangleObstacle(surface=sp.SurfaceMesh([(-5, 0, -5), (0, 0, 9), (9, 0, -5)], [[0, 1, 2]])),
            (0, 0.4, 0),
            True,
        ),
    ],
    ids=["box", "sphere", "bowl", "room", "sheet"],
)
def test_out_of_every_kind_of_obstacle(obstacle, position, up):
    result = separate(sp.Scene([cube("a", position)], [obstacle]))
    (move,) = result.moves
    assert move.shift[1] > 0 if up else move.shift[1] < 0
    assert np.linalg.norm(move.shift) < 0.5
    assert apart(result.scene)


def test_balls_separate_along_the_line_of_their_centers():
    mesh = sp.shapes.sphere(radius=0.5, edge_length=0.12)
    bodies = [sp.Body(n, mesh, RUBBER, position=p) for n, p in (("a", (0, 0, 0)), ("b", (0.5, 0.5, 0.5)))]
    result = separate(sp.Scene(bodies))
    (move,) = result.moves
    overlap = 1.0 - np.sqrt(0.75)
    assert overlap < np.linalg.norm(move.shift) < 1.5 * overlap
    assert apart(result.scene)


def test_turned_cubes_in_a_heap():
    rng = np.random.default_rng(3)
    bodies = [cube(f"c{i}", (1.25 * i, 0.6 + 0.1 * i, 0), rotation=rng.uniform(-1, 1, 3)) for i in range(4)]
    result = separate(sp.Scene(bodies, [sp.HalfSpace()]))
    assert len(result.moves) >= 2
    assert apart(result.scene)
    for move in result.moves:
        assert np.linalg.norm(move.shift) <= 0.5 * np.sqrt(3)


def test_deformed_starts_and_chosen_vertices_move_along():
    load = sp.Force("b", sp.InBox((0.5, -1, -1), (2, 1, 1)), (0, 1, 0))
    face = sp.Pressure("b", 1.0, region=sp.InBox((1.3, -1, -1), (2, 1, 1)))
    scene = sp.Scene([cube("a", (0, 0, 0)), cube("b", (0.9, 0, 0))], forces=[load], loads=[face])
    placed = scene.body("b").place(scene.body("b").mesh.vertices)
    chosen = load.select(placed)
    given = {"b": 0.9 * (placed - placed.mean(axis=0)) + placed.mean(axis=0)}
    result = separate(scene, initial_positions=given)
    (move,) = result.moves
    assert np.allclose(result.initial_positions["b"], given["b"] + move.shift)
    moved = result.scene.body("b")
    assert np.array_equal(result.scene.forces[0].select(moved.place(moved.mesh.vertices)), chosen)
    assert np.array_equal(result.scene.loads[0].triangles(moved), face.triangles(scene.body("b")))
    assert apart(result.scene, result.initial_positions)


NOT_SEPARABLE = {
    "one inside the other": (lambda: sp.Scene([cube("a", (0, 0, 0)), cube("b", (0, 0, 0), 0.2)]), "body 'b'"),
    "the same place": (lambda: sp.Scene([cube("a", (0, 0, 0)), cube("b", (0, 0, 0))]), "cannot be separated by"),
    "both pinned": (
        lambda: sp.Scene([cube("a", (0, 0, 0)), cube("b", (0.9, 0, 0))], pins=[sp.Pin("a", [0]), sp.Pin("b", [0])]),
        "pins hold what would have to move",
    ),
    "pinned in the floor": (
        lambda: sp.Scene([cube("a", (0, 0, 0))], [sp.HalfSpace()], [sp.Pin("a", [0])]),
        "pins hold",
    ),
    "deep below the floor": (lambda: sp.Scene([cube("a", (0, -1, 0))], [sp.HalfSpace()]), "'HalfSpace 1'"),
    "no room between two planes": (
        lambda: sp.Scene([cube("a", (0, 0, 0))], [sp.HalfSpace((0, -0.4, 0)), sp.HalfSpace((0, 0.4, 0), (0, -1, 0))]),
        "cannot be separated by a small",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", NOT_SEPARABLE)
def test_the_error_for_scenes_that_cannot_be_separated_names_the_two(what):
    make, message = NOT_SEPARABLE[what]
    with pytest.raises(sp.SceneError, match=message) as caught:
        separate(make())
    text = str(caught.value)
    assert "\n" not in text
    assert "'a'" in text


def test_the_gap_is_a_hundredth_of_an_edge():
    system = build_system(sp.Scene([cube("a", (0, 0, 0))]))
    assert default_gap(system) == pytest.approx(0.01 * (2 * 0.5 + np.sqrt(0.5)) / 3)


def stitched_cubes(low, high, first="low", second="high"):
    """Two cubes a hundredth apart, one upon the other, stitched where they face each other."""
    stitch = sp.SoftVertexTriangleStitch(first, second, max_distance=0.05, youngs=1e5, poisson=0.4)
    return [cube("low", low), cube("high", high)], stitch


def test_stitched_bodies_move_as_one():
    bodies, stitch = stitched_cubes((0, 0.4, 0), (0, 1.41, 0))
    scene = sp.Scene(bodies, [sp.HalfSpace()], stitches=[stitch])
    result = separate(scene, gap=0.001)
    assert [move.body for move in result.moves] == ["low", "high"]
    for move in result.moves:
        assert move.shift == pytest.approx([0, 0.101, 0], abs=1e-9)
    before, after = scene.stitching, result.scene.stitching
    assert np.array_equal(before.nodes(), after.nodes())
    assert after.tets.rest_shape_inverse == pytest.approx(before.tets.rest_shape_inverse, rel=1e-9, abs=1e-9)


def test_stitched_bodies_are_weighed_together():
    bodies, stitch = stitched_cubes((0, 0, 0), (0, 1.01, 0))
    heavier = cube("third", (0.9, 0.5, 0), density=1500.0)
    result = separate(sp.Scene([*bodies, heavier], stitches=[stitch]), gap=0.001)
    assert [move.body for move in result.moves] == ["third"]
    assert apart(result.scene)


def test_stitched_bodies_that_intersect_are_an_error():
    bodies, stitch = stitched_cubes((0, 0, 0), (0, 0.97, 0))
    with pytest.raises(SceneError, match=r"'low' overlaps body 'high' .* they are stitched together, and move as one"):
        separate(sp.Scene(bodies, stitches=[stitch]))


def test_bodies_stitched_to_a_pinned_one_stay():
    bodies, stitch = stitched_cubes((0, 0.4, 0), (0, 1.41, 0))
    pin = sp.Pin("high", vertices=[0])
    with pytest.raises(SceneError, match="pins or stitches hold what would have to move"):
        separate(sp.Scene(bodies, [sp.HalfSpace()], stitches=[stitch], pins=[pin]))


def test_bodies_stitched_to_an_obstacle_stay():
    corners = [(-5, -0.51, -5), (0, -0.51, 9), (9, -0.51, -5)]
    sheet = sp.obstacles.TriangleObstacle(surface=sp.SurfaceMesh(corners, [[0, 1, 2]]), name="sheet")
    stitch = sp.SoftVertexTriangleStitch("a", "sheet", max_distance=0.05, youngs=1e5, poisson=0.4)
    scene = sp.Scene([cube("a", (0, 0, 0))], [sheet, sp.HalfSpace(point=(0, -0.4, 0))], stitches=[stitch])
    with pytest.raises(SceneError, match="pins or stitches hold what would have to move"):
        separate(scene)
