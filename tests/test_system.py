"""The arrays of a System: masses, components, pins; and the state at the start."""

import numpy as np
import pytest

import supple as sp
from supple.model.state import State
from supple.model.system import build_system, initial_state

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
CUBE_TETS = [[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]]


def cube(scale=1.0):
    return sp.TetMesh(scale * CUBE, CUBE_TETS)


def rubber(**changes):
    return sp.StableNeoHookean(**{"youngs": 1e5, "poisson": 0.4, "density": 1200.0, **changes})


def two_cubes(**changes):
    a = sp.Body("a", cube(), rubber(), position=(0, 2, 0))
    b = sp.Body("b", cube(0.5), rubber(density=np.linspace(500.0, 1000.0, 6)), **changes)
    return sp.Scene([a, b])


def test_masses_of_each_body_sum_to_density_times_volume():
    system = build_system(two_cubes())
    masses = system.split(system.masses)
    assert masses["a"].sum() == pytest.approx(1200.0, rel=1e-14)
    assert masses["b"].sum() == pytest.approx(float(np.linspace(500.0, 1000.0, 6) @ cube(0.5).volumes), rel=1e-14)
    # vertex 1 of the cube belongs to two of its six tets, vertex 0 to all
    assert masses["a"][0] == pytest.approx(1200.0 / 4)
    assert masses["a"][1] == pytest.approx(1200.0 / 12)


def test_indices_of_the_second_body_are_shifted_and_arrays_have_the_documented_types():
    system = build_system(two_cubes())
    b = system.bodies[1]
    assert system.tets[b.tets].min() == 8
    assert system.edges[b.edges].min() == 8
    assert system.triangles[b.triangles].min() == 8
    assert (system.tets[b.tets] - 8 == cube().tets).all()
    for name in ("tets", "edges", "triangles", "components"):
        assert getattr(system, name).dtype == np.int32
    for name in ("rest_positions", "masses", "rest_shape_inverse", "rest_volumes", "rest_lengths"):
        assert getattr(system, name).dtype == np.float64
    for name in ("tets", "edges", "triangles", "rest_positions", "rest_shape_inverse"):
        assert getattr(system, name).flags.c_contiguous


def test_rest_shapes_are_not_placed_but_the_initial_state_is():
    scene = two_cubes(position=(5, 0, 0), rotation=(0, np.pi / 2, 0))
    system, state = build_system(scene), initial_state(scene)
    b = system.bodies[1].vertices
    np.testing.assert_allclose(system.rest_positions[b], 0.5 * CUBE)
    # a quarter turn about y carries x to -z and z to x
    expected = 0.5 * np.column_stack([CUBE[:, 2], CUBE[:, 1], -CUBE[:, 0]]) + [5, 0, 0]
    np.testing.assert_allclose(state.positions[b], expected, atol=1e-15)


def test_components_are_connected_pieces_also_inside_one_body():
    apart = sp.TetMesh(np.concatenate([CUBE, CUBE + 5.0]), CUBE_TETS + (np.array(CUBE_TETS) + 8).tolist())
    scene = sp.Scene([sp.Body("pair", apart, rubber()), sp.Body("one", cube(), rubber())])
    components = build_system(scene).components
    assert [len(set(components[i : i + 8])) for i in (0, 8, 16)] == [1, 1, 1]
    assert len(set(components)) == 3


def test_spin_and_velocity_give_the_momenta_of_a_rigid_body():
    scene = two_cubes(velocity=(1, 2, 3), angular_velocity=(0, 0, 4))
    system, state = build_system(scene), initial_state(scene)
    b = system.bodies[1].vertices
    m, x, v = system.masses[b], state.positions[b], state.velocities[b]
    center = m @ x / m.sum()
    np.testing.assert_allclose(m @ v / m.sum(), [1, 2, 3], rtol=1e-13)
    np.testing.assert_allclose(v - [1, 2, 3], np.cross([0, 0, 4], x - center), atol=1e-12)


def test_given_positions_and_velocities_replace_those_of_the_scene():
    scene = two_cubes(velocity=(1, 0, 0))
    state = initial_state(scene, {"b": CUBE + 7.0}, {"a": np.full((8, 3), 2.0)})
    np.testing.assert_array_equal(state.positions[8:], CUBE + 7.0)
    np.testing.assert_array_equal(state.velocities[:8], 2.0)
    np.testing.assert_array_equal(state.velocities[8:], np.tile([1.0, 0.0, 0.0], (8, 1)))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"c": CUBE}, "body 'c' does not exist"),
        ({"b": CUBE[:5]}, r"shape \(5, 3\)"),
        ({"b": CUBE * np.nan}, "row 0 is not finite"),
        ({"b": "here"}, "not an array of numbers"),
    ],
)
def test_impossible_initial_positions_are_named(given, words):
    with pytest.raises(sp.SceneError, match=words):
        initial_state(two_cubes(), given)


class TestPins:
    slide = sp.Keyframes([0.0, 1.0], [[0, 0, 0], [2, 0, 0]])
    turn = sp.Keyframes([0.0, 2.0], angles=[0.0, np.pi], axis=(0, 1, 0), pivot=(1, 0, 0))

    def scene(self, motion):
        body = sp.Body("a", cube(), rubber(), position=(0, 2, 0))
        return sp.Scene([sp.Body("z", cube(), rubber()), body], pins=[sp.Pin("a", [0, 3], motion)])

    def test_pinned_vertices_are_global_and_have_no_inverse_mass(self):
        system = build_system(self.scene(None))
        assert system.pinned_vertices.tolist() == [8, 11]
        assert system.inverse_masses[[8, 11]].tolist() == [0.0, 0.0]
        free = np.delete(np.arange(16), [8, 11])
        np.testing.assert_allclose(system.inverse_masses[free], 1.0 / system.masses[free])

    def test_targets_follow_keyframes(self):
        system = build_system(self.scene(self.slide))
        np.testing.assert_allclose(system.pin_targets(0.5), CUBE[[0, 3]] + [1, 2, 0])
        np.testing.assert_allclose(system.pin_targets(9.0), CUBE[[0, 3]] + [2, 2, 0])
        turned = build_system(self.scene(self.turn)).pin_targets(2.0)
        np.testing.assert_allclose(turned, [2, 2, 0] + CUBE[[0, 3]] * [-1, 1, -1], atol=1e-15)

    def test_targets_follow_a_function_for_all_or_for_each(self):
        item = build_system(self.scene(lambda t: [[t, 0, 0], [0, t, 0]]))
        np.testing.assert_allclose(item.pin_targets(3.0) - item.pin_targets(0.0), [[3, 0, 0], [0, 3, 0]])

    @pytest.mark.parametrize(
        ("motion", "words"),
        [
            (lambda t: [0, 0], r"shape \(2,\)"),
            (lambda t: [np.inf, 0, 0], "not finite"),
            (lambda t: "up", "must be an array of numbers"),
        ],
    )
    def test_a_function_that_returns_nonsense_is_named(self, motion, words):
        with pytest.raises(sp.SceneError, match=f"pin of body 'a'.*{words}"):
            build_system(self.scene(motion)).pin_targets(1.0)

    @pytest.mark.parametrize("motion", [None, slide, turn, lambda t: [0, t * t, 0]])
    def test_a_restart_in_the_middle_keeps_the_anchors(self, motion):
        scene = self.scene(motion)
        system = build_system(scene)
        x = initial_state(scene).positions.copy()
        x[system.pinned_vertices] = system.pin_targets(0.7)
        again = build_system(scene, State(0.7, x, np.zeros_like(x)))
        np.testing.assert_allclose(again.pin_targets(1.3), system.pin_targets(1.3), atol=1e-14)

    def test_a_start_at_time_zero_is_held_where_it_is(self):
        scene = self.scene(self.slide)
        x = np.add(initial_state(scene).positions, [0, 0, 0.25])
        system = build_system(scene, State(0.0, x, np.zeros_like(x)))
        np.testing.assert_allclose(system.pin_targets(1.0), CUBE[[0, 3]] + [2, 2, 0.25])
