"""Energies of rods: derivatives, invariance, known bends and twists, joints of several edges; the check's own sum."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.derivatives import assert_derivatives, hessian_product

import supple as sp
from supple.results.check.rods import StoredByRod
from supple.solvers.implicit.energies.damping import StrainRate
from supple.solvers.implicit.energies.rods import RodEnergy, RodViscosity

NO_TETS = np.zeros((0, 4), dtype=np.int32)
MATERIAL = sp.RodMaterial(youngs=1e6, poisson=0.3, radius=0.02, damping=0.1)


def branching(seed=3, **more):
    steps = np.array([[0.1, 0.0, 0.0]] * 6) + 0.03 * np.random.default_rng(seed).normal(size=(6, 3))
    edges = [[0, 1], [2, 1], [2, 3], [2, 4], [4, 5]]
    return sp.Rod("rod", np.cumsum(steps, axis=0), MATERIAL, edges=edges, **more)


def free(rod):
    return np.zeros(len(rod.mesh.line), dtype=bool)


def moved(rod, seed=0):
    return rod.points + 0.004 * np.random.default_rng(seed).normal(size=rod.points.shape)


@pytest.mark.parametrize("more", [{}, {"rest": "straight"}, {"twist": 3.0}])
def test_energy_and_damping_have_their_derivatives_and_projected_hessians_are_not_below_zero(more):
    rod = branching(**more)
    elements = rod.elements(free(rod))
    viscosity = RodViscosity(elements)
    damping = viscosity.damping(StrainRate(3.0, viscosity.strains(rod.points)))
    x = moved(rod)
    d = 0.01 * np.random.default_rng(1).normal(size=x.shape)
    for term in (RodEnergy(elements), damping):
        assert_derivatives(term, hessian_product(term, NO_TETS, x, d), x, d, 0.02)
        units = np.eye(x.size).reshape(-1, *x.shape)
        whole = np.array([hessian_product(term, NO_TETS, x, unit, project=True).ravel() for unit in units])
        np.testing.assert_allclose(whole, whole.T, atol=1e-12 * np.abs(whole).max())
        assert np.linalg.eigvalsh(whole).min() > -1e-12 * np.abs(whole).max()


def test_energy_is_zero_at_rest_and_does_not_change_as_the_rod_moves_rigidly():
    rod = branching()
    elements, x = rod.elements(free(rod)), moved(rod)
    R = Rotation.from_rotvec([0.3, -2.0, 1.0]).as_matrix()
    assert elements.energy(rod.points) < 1e-20
    assert elements.energy(x @ R.T + [1.0, 2.0, 3.0]) == pytest.approx(elements.energy(x), rel=1e-10)


@pytest.mark.parametrize("angle", [0.1, -1.0, 2.5])
def test_bends_and_twists_are_twice_the_tangent_of_half_of_the_angle_between_two_edges(angle):
    B, C = MATERIAL.bending_stiffness, MATERIAL.twisting_stiffness
    straight = sp.Rod("rod", [[0, 0, 0], [1, 0, 0], [2, 0, 0]], MATERIAL)
    elements = straight.elements(free(straight))
    bent = sp.Rod("rod", [[0, 0, 0], [1, 0, 0], [1 + np.cos(angle), 0, np.sin(angle)]], MATERIAL)
    strain = 2.0 * np.tan(0.5 * angle)
    assert elements.energy(bent.points) == pytest.approx(0.5 * B * strain**2)
    twisted, rows = straight.points.copy(), straight.mesh.material_points[1]
    twisted[rows] = twisted[rows] @ Rotation.from_rotvec([angle, 0.0, 0.0]).as_matrix().T
    assert elements.energy(twisted) == pytest.approx(0.5 * C * strain**2)


def test_rest_shapes_may_be_straight_or_twisted():
    bent = sp.Rod("rod", [[0, 0, 0], [1, 0, 0], [1, 1, 0]], MATERIAL, rest="straight")
    assert bent.elements(free(bent)).energy(bent.points) == pytest.approx(2.0 * MATERIAL.bending_stiffness)
    twisted = sp.Rod("rod", [[0, 0, 0], [1, 0, 0], [2, 0, 0]], MATERIAL, twist=0.5)
    wanted = 0.5 * MATERIAL.twisting_stiffness * (2.0 * np.tan(0.25)) ** 2
    assert twisted.elements(free(twisted)).energy(twisted.points) == pytest.approx(wanted)


def test_three_edges_at_a_point_turn_as_welded_ends():
    # One turns against two others: half of its length in series with both halves of theirs, 1/(1/2 + 1/4) B/l.
    points = [[0, 0, 0], [-1, 0, 0], [np.cos(1.0), 0, np.sin(1.0)], [np.cos(1.0), 0, -np.sin(1.0)]]
    rod = sp.Rod("rod", points, MATERIAL, edges=[[0, 1], [0, 2], [0, 3]])
    elements, angle = rod.elements(free(rod)), 1e-3
    turned = rod.points.copy()
    rows = [1, *rod.mesh.material_points[0]]
    turned[rows] = turned[rows] @ Rotation.from_rotvec([0.0, angle, 0.0]).as_matrix().T
    assert elements.energy(turned) == pytest.approx(0.5 * 4.0 / 3.0 * MATERIAL.bending_stiffness * angle**2, rel=1e-4)


@pytest.mark.parametrize("more", [{}, {"rest": "straight", "twist": 1.0}])
@pytest.mark.parametrize("held", [[], [0], [1, 2]])
def test_the_check_sums_the_same_energy(more, held):
    rod, own = branching(**more), np.zeros(5, dtype=bool)
    own[held] = True
    x = moved(rod)
    assert StoredByRod(rod, own).energy(x) == pytest.approx(rod.elements(own).energy(x), rel=1e-10)


def test_it_turns_about_its_axis_as_a_solid_cylinder():
    rod = sp.Rod("rod", [[0, 0, 0], [1, 0, 0]], MATERIAL)
    masses, r = rod.lumped_masses(), np.linalg.norm(rod.points[:, 1:], axis=1)
    mass = MATERIAL.density * np.pi * MATERIAL.radius**2
    assert masses.sum() == pytest.approx(mass)
    assert masses @ r**2 == pytest.approx(0.5 * mass * MATERIAL.radius**2)


@pytest.mark.parametrize(
    ("points", "edges", "text"),
    [
        ([[0, 0, 0]], None, "it has one point"),
        ([[0, 0, 0], [0, 0, 0]], None, "points 0 and 1 .* are the same"),
        ([[0, 0, 0], [1, 0, 0], [0.5, 0, 0]], None, "edges 0 and 1 lie on each other"),
        ([[0, 0, 0], [1, 0, 0]], [[0, 1.5]], "not pairs of whole numbers"),
        ([[0, 0, 0], [1, 0, 0]], [[0, -1]], "not pairs of whole numbers"),
        ([[0, 0, 0], [1, 0, 0]], [[0, 2]], "edge 0 is \\[0, 2\\]"),
        ([[0, 0, 0], [1, 0, 0]], [[0, 1], [1, 0]], "is given twice"),
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1]], "point 2 .* belongs to no edge"),
        ([[0, 0, 0], [np.nan, 0, 0]], None, "not finite"),
    ],
)
def test_wrong_lines_are_refused_in_the_words_of_the_caller(points, edges, text):
    with pytest.raises(sp.SceneError, match=f"rod 'rope'.*{text}"):
        sp.Rod("rope", points, MATERIAL, edges=edges)


def test_what_rods_do_not_have_is_refused_by_its_name():
    scene = sp.Scene([sp.Rod("rope", [[0, 0, 0], [1, 0, 0], [2, 0, 0]], MATERIAL)], pins=[sp.Pin("rope", [0, 1])])
    loss = sp.Misfit("positions", "rope", np.zeros((7, 3)))
    with pytest.raises(sp.SolverError, match="rods are not differentiated"):
        sp.Sensitivity(lambda p: scene, loss, sp.Implicit(), 1 / 60, 1).value_and_gradient([1.0])
    with pytest.raises(sp.SolverError, match="newmark"):
        list(sp.simulate(scene, sp.Implicit(integrator="newmark"), 1 / 60, 1))
    *_, frame = sp.simulate(scene, sp.Implicit(), 1 / 60, 1)
    with pytest.raises(sp.SceneError, match="body 'rope' is a rod, which has no tets"):
        _ = frame.stress["rope"]
