"""Values of a scene: every impossible value raises an error that names it."""

import numpy as np
import pytest

import supple as sp
from supple.scene.located import LocatedError

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
CUBE_TETS = [[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]]
MESH = sp.TetMesh(CUBE, CUBE_TETS)
RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
SKIN = MESH.surface


def body(name="cube", **changes):
    return sp.Body(**{"name": name, "mesh": MESH, "material": RUBBER, **changes})


BAD_BODIES = [
    ({"name": ""}, "name is ''"),
    ({"name": 7}, "name is 7"),
    ({"name": "a/b"}, "a name is at most"),
    ({"name": "x" * 101}, "a name is at most"),
    ({"name": "two\nlines"}, "a name is at most"),
    ({"mesh": SKIN}, "mesh is a SurfaceMesh"),
    ({"material": "rubber"}, "material is 'rubber'"),
    ({"skin": MESH}, "skin is a TetMesh"),
    ({"position": (1, 2)}, r"position has shape \(2,\)"),
    ({"position": (1, 2, np.nan)}, "position is .*must be finite"),
    ({"position": "here"}, "position is 'here'"),
    ({"position": (1e12, 0, 0)}, "too far for edges of 1 m"),
    ({"velocity": (np.inf, 0, 0)}, "velocity is .*must be finite"),
    ({"rotation": None}, "rotation"),
    ({"angular_velocity": [[0, 0, 1]]}, r"angular_velocity has shape \(1, 3\)"),
    ({"friction": -0.1}, "friction is -0.1; it must be zero or more"),
    ({"friction": True}, "friction is True"),
    ({"material": sp.StableNeoHookean(youngs=[1e5] * 5, poisson=0.4)}, "youngs has 5 values for 6 tets"),
    ({"material": sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=[1.0] * 7)}, "density has 7 values for 6 tets"),
]


@pytest.mark.parametrize(("changes", "words"), BAD_BODIES)
def test_bad_bodies(changes, words):
    with pytest.raises(sp.SceneError, match=words) as caught:
        body(**changes)
    assert changes.get("name") is not None or "body 'cube'" in str(caught.value)


BAD_MATERIALS = [
    (sp.StableNeoHookean, {"youngs": 0.0, "poisson": 0.4}, "youngs is 0; .* above zero"),
    (sp.StableNeoHookean, {"youngs": np.nan, "poisson": 0.4}, "youngs is nan"),
    (sp.StableNeoHookean, {"youngs": "soft", "poisson": 0.4}, "youngs is 'soft'"),
    (sp.StableNeoHookean, {"youngs": [1.0, -2.0], "poisson": 0.4}, r"youngs is -2 \(tet 1\)"),
    (sp.StableNeoHookean, {"youngs": [[1.0]], "poisson": 0.4}, r"youngs has shape \(1, 1\)"),
    (sp.StableNeoHookean, {"youngs": 1e5, "poisson": 0.5}, "poisson is 0.5"),
    (sp.StableNeoHookean, {"youngs": 1e5, "poisson": -1.0}, "poisson is -1"),
    (sp.StableNeoHookean, {"youngs": 1e5, "poisson": np.nan}, "poisson is nan"),
    (sp.StableNeoHookean, {"youngs": 1e5, "poisson": 0.4, "density": -1000.0}, "density is -1000"),
    (sp.StableNeoHookean, {"youngs": 1e5, "poisson": 0.4, "damping": -1.0}, "damping is -1"),
    (sp.EdgesAndVolume, {"edge_compliance": -1e-6}, "edge_compliance is -1e-06"),
    (sp.EdgesAndVolume, {"volume_compliance": np.inf}, "volume_compliance is inf"),
]


@pytest.mark.parametrize(("kind", "values", "words"), BAD_MATERIALS)
def test_bad_materials(kind, values, words):
    with pytest.raises(sp.SceneError, match=f"{kind.__name__}: {words}"):
        kind(**values)


BAD_PINS = [
    ({"vertices": []}, "non-empty list of whole numbers"),
    ({"vertices": [0.5]}, "non-empty list of whole numbers"),
    ({"vertices": [[0, 1]]}, "non-empty list of whole numbers"),
    ({"vertices": "all"}, "non-empty list of whole numbers"),
    ({"vertices": [True, False]}, "non-empty list of whole numbers"),
    ({"vertices": [1, 1]}, "names a vertex twice"),
    ({"vertices": [3, -1]}, "holds -1, which is negative"),
    ({"vertices": [2**40]}, "more than any mesh has"),
    ({"vertices": [0], "motion": "up"}, "motion is 'up'"),
    ({"vertices": [0], "name": ""}, "name is ''"),
]


@pytest.mark.parametrize(("changes", "words"), BAD_PINS)
def test_bad_pins(changes, words):
    with pytest.raises(sp.SceneError, match=words):
        sp.Pin("cube", **changes)


def test_bad_boxes_of_pins():
    with pytest.raises(sp.SceneError, match="swap them"):
        sp.InBox((1, 0, 0), (0, 1, 1))
    with pytest.raises(sp.SceneError, match="InBox: low"):
        sp.InBox((np.nan, 0, 0), (0, 1, 1))


def test_a_box_selects_the_vertices_on_and_inside_it_where_the_body_is_placed():
    box = sp.InBox((10, 0, 0), (10, 1, 1))
    pin = sp.Pin("cube", box)
    placed = body(position=(10, 0, 0)).place(CUBE)
    assert pin.select(placed).tolist() == [0, 1, 2, 3]


BAD_OBSTACLES = [
    (sp.HalfSpace, {"normal": (0, 0, 0)}, "normal has no length"),
    (sp.HalfSpace, {"point": (0, np.nan, 0)}, "point is"),
    (sp.HalfSpace, {"friction": -1}, "friction is -1"),
    (sp.HalfSpace, {"friction": np.inf}, "friction is inf"),
    (sp.HalfSpace, {"motion": 3}, "motion is 3"),
    (sp.HalfSpace, {"name": "a:b"}, "a name is at most"),
    (sp.obstacles.Box, {"size": (1, 0, 1)}, "every edge must be above zero"),
    (sp.obstacles.Box, {"size": (1, 1)}, r"size has shape \(2,\)"),
    (sp.obstacles.Box, {"rotation": "x"}, "rotation is 'x'"),
    (sp.obstacles.Sphere, {"radius": 0}, "radius is 0"),
    (sp.obstacles.Sphere, {"radius": "1"}, "radius is '1'"),
    (sp.obstacles.TriangleObstacle, {}, "surface is missing; give surface="),
    (sp.obstacles.TriangleObstacle, {"surface": MESH}, "give a SurfaceMesh"),
]


@pytest.mark.parametrize(("kind", "values", "words"), BAD_OBSTACLES)
def test_bad_obstacles(kind, values, words):
    with pytest.raises(sp.SceneError, match=words):
        kind(**values)


BAD_KEYFRAMES = [
    ({"times": []}, "times is empty"),
    ({"times": [0, 1, 1]}, r"times\[2\] = 1 s does not come after 1 s"),
    ({"times": [[0]]}, r"times has shape \(1, 1\); it must have shape \('k',\)"),
    ({"times": [0, 1], "displacements": [[0, 0, 0]]}, r"displacements has shape \(1, 3\)"),
    ({"times": [0], "displacements": [[0, 0]]}, r"displacements has shape \(1, 2\)"),
    ({"times": [0], "displacements": [[0, 0, np.inf]]}, "displacements holds a value that is not finite"),
    ({"times": [0], "displacements": "up"}, "displacements is .up.; give a list of numbers"),
    ({"times": [0, 1], "angles": [0]}, r"angles has shape \(1,\)"),
    ({"times": [0], "angles": [1], "axis": (0, 0, 0)}, "axis has no length"),
    ({"times": [0]}, "give displacements, angles, or both"),
    ({"times": [0], "angles": [1], "rotations": [[0, 0, 1]]}, "angles and rotations are both given"),
    ({"times": [0, 1], "rotations": [[0, 0, 1]]}, r"rotations has shape \(1, 3\)"),
    ({"times": [0], "rotations": [[0, 0, np.nan]]}, "rotations holds a value that is not finite"),
]


@pytest.mark.parametrize(("values", "words"), BAD_KEYFRAMES)
def test_bad_keyframes(values, words):
    with pytest.raises(sp.SceneError, match=words):
        sp.Keyframes(**values)


BAD_SCENES = [
    ({"bodies": []}, "bodies are missing"),
    ({"bodies": None}, "bodies is None"),
    ({"bodies": [MESH]}, r"bodies\[0\] is a TetMesh; give a Body"),
    ({"bodies": [body(), body()]}, "body 'cube' and body 'cube' have the same name; give each"),
    ({"obstacles": [sp.Pin("cube", [0])]}, r"obstacles\[0\] is a Pin; give a Obstacle"),
    (
        {"obstacles": [sp.HalfSpace(name="floor"), sp.obstacles.Sphere(name="floor")]},
        "obstacle 'floor' and obstacle 'floor' have the same name",
    ),
    ({"obstacles": [sp.HalfSpace(name="cube")]}, "body 'cube' and obstacle 'cube' have the same name; give each body"),
    ({"pins": [sp.Pin("ball", [0])]}, "body 'ball' does not exist; there are 'cube'"),
    ({"pins": [sp.Pin("cube", [8])]}, "vertex 8 does not exist; the body has 8"),
    ({"pins": [sp.Pin("cube", sp.InBox((5, 5, 5), (6, 6, 6)))]}, "its box holds no vertex; the body reaches from"),
    ({"pins": [sp.Pin("cube", [0, 1]), sp.Pin("cube", [1, 2])]}, "vertex 1 is already held by another pin"),
    ({"gravity": (0, -9.81)}, "gravity has shape"),
    ({"gravity": (0, np.nan, 0)}, "gravity is"),
]


@pytest.mark.parametrize(("changes", "words"), BAD_SCENES)
def test_bad_scenes(changes, words):
    with pytest.raises(sp.SceneError, match=words):
        sp.Scene(**{"bodies": [body()], **changes})


def test_unnamed_obstacles_get_their_kind_and_number():
    floor, wall = sp.HalfSpace(), sp.HalfSpace(friction=0.5)
    named = sp.HalfSpace(name="HalfSpace 2")
    scene = sp.Scene([body()], [floor, wall, sp.obstacles.Sphere(), named])
    assert [o.name for o in scene.obstacles] == ["HalfSpace 1", "HalfSpace 3", "Sphere 1", "HalfSpace 2"]
    assert [o.friction for o in scene.obstacles] == [0.0, 0.5, 0.0, 0.0]
    assert floor.name is None


def test_unnamed_obstacles_get_a_name_that_no_body_has():
    scene = sp.Scene(
        [body(name="HalfSpace 1"), body(name="Sphere 2")],
        [sp.HalfSpace(), sp.obstacles.Sphere(), sp.obstacles.Sphere()],
    )
    assert [o.name for o in scene.obstacles] == ["HalfSpace 2", "Sphere 1", "Sphere 3"]


def test_scenes_are_frozen():
    scene = sp.Scene([body()])
    with pytest.raises(AttributeError):
        scene.gravity = (0, 0, 0)  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(ValueError, match="read-only"):
        np.asarray(scene.gravity)[1] = 0.0
    assert scene.body("cube") is scene.bodies[0]
    with pytest.raises(sp.SceneError, match="body 'ball' does not exist; there are 'cube'"):
        scene.body("ball")


def test_keyframes_are_piecewise_linear_and_constant_outside():
    motion = sp.Keyframes([1.0, 2.0, 4.0], [[0, 0, 0], [1, 0, 0], [1, -2, 0]], [0.0, 0.0, np.pi], (0, 0, 2), (1, 0, 0))
    for time, shift in [(0.0, (0, 0, 0)), (1.5, (0.5, 0, 0))]:
        R, t = motion.pose(time)
        np.testing.assert_allclose(R, np.eye(3))
        np.testing.assert_allclose(t, shift)
    for time in (4.0, 99.0):
        R, t = motion.pose(time)
        np.testing.assert_allclose(R, np.diag([-1.0, -1.0, 1.0]), atol=1e-15)
        np.testing.assert_allclose(R @ [1, 0, 0] + t, [2, -2, 0], atol=1e-15)


def test_rotation_vectors_turn_about_themselves():
    placed = body(rotation=np.array([1, 1, 1]) * 2 * np.pi / 3 / np.sqrt(3), position=(1, 0, 0)).place(np.eye(3))
    # a third of a turn about the diagonal carries x to y, y to z and z to x
    np.testing.assert_allclose(placed, np.eye(3)[[1, 2, 0]] + [1, 0, 0], atol=1e-15)
    np.testing.assert_array_equal(body().place(CUBE), CUBE)


def test_obstacle_poses_follow_functions_and_keyframes():
    lift = sp.HalfSpace(motion=lambda t: (0, 2 * t, 0))
    np.testing.assert_allclose(lift.pose(1.5)[1], [0, 3, 0])
    with pytest.raises(sp.SceneError, match="shape"):
        sp.obstacles.Sphere(motion=lambda t: np.zeros((8, 3))).pose(0.0)


def test_loads_are_of_every_kind(tmp_path):
    """Forces and soft targets too, with errors where they are given; a scene file has them in its list as well."""
    bodies = [body("a")]
    loads = [sp.Force("a", [1], (0, 0, 2.0)), sp.Pressure("a", 3.0), sp.SoftTarget("a", [2], 5.0)]
    scene = sp.Scene(bodies, forces=[sp.Force("a", [0], (0, 0, 1.0))], loads=loads)
    assert [force.force[2] for force in scene.forces] == [1.0, 2.0]
    assert (scene.loads, scene.soft_targets) == (tuple(loads[1:2]), tuple(loads[2:]))
    with pytest.raises(LocatedError, match="vertex 999 does not exist") as caught:
        sp.Scene(bodies, loads=[loads[1], sp.Force("a", [999], (0, 0, 1.0))])
    assert caught.value.keys == ("loads", 1, "vertices")
    with pytest.raises(sp.SceneError, match=r"loads\[0\] is a Pin; give a Load or Force or SoftTarget"):
        sp.Scene(bodies, loads=[sp.Pin("a", [1])])
    path = tmp_path / "scene.yaml"
    path.write_text(
        "bodies: [{name: a, shape: {kind: box}, material: {kind: arap, youngs: 1e4, poisson: 0.3}}]\n"
        "loads:\n"
        "  - {kind: pressure, body: a, pressure: 3}\n"
        "  - {kind: soft_target, body: a, vertices: [2], stiffness: 5}\n"
        "  - {kind: force, body: a, vertices: [1], force: [0, 0, 2]}\n"
    )
    scene = sp.load_scene(path)
    assert [len(part) for part in (scene.loads, scene.forces, scene.soft_targets)] == [1, 1, 1]
    path.write_text(path.read_text().replace("[1]", "[999]"))
    with pytest.raises(sp.SceneError, match=r"scene.yaml:5: .*vertex 999 does not exist"):
        sp.load_scene(path)
