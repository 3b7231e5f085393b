"""A rigid body as four control points: its mass, its surface, its energy, and what it refuses."""

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.scene.rigid.pose import nearest_rigid, orthogonality_error, pose_of
from supple.scene.rotation import rotation_matrix
from supple.solvers.implicit.energies.elasticity import elasticity_of
from supple.solvers.implicit.energies.potential import HessianBlocks

BOX = sp.shapes.box_surface((1.0, 2.0, 3.0), (1, 1, 1))
TORUS = sp.shapes.torus_surface(0.5, 0.2, 0.2).transformed(scale=(1.0, 2.0, 0.7), translation=(4.0, 0.0, 0.0))


def body(shape=TORUS, name="palm", **values):
    return sp.RigidBody(name, shape, **({"density": 100.0} | values))


def system_of(*bodies, **scene):
    return build_system(sp.Scene(list(bodies), **scene))


def soft(name="soft", **body):
    return sp.Body(name, sp.shapes.box((1, 1, 1), (1, 1, 1)), sp.StableNeoHookean(youngs=1e4, poisson=0.3), **body)


def test_the_control_points_have_the_momenta_and_the_energy_of_every_affine_motion():
    rigid, rng = body(), np.random.default_rng(0)
    system, p = system_of(rigid), rigid.properties
    A, u = rng.normal(size=(3, 3)), rng.normal(size=3)
    r = rigid.mesh.vertices - p.center
    v = r @ A.T + u
    m = system.masses
    assert m.sum() == pytest.approx(p.mass, rel=1e-13)
    np.testing.assert_allclose(m @ rigid.mesh.vertices / m.sum(), p.center, atol=1e-12)
    energy = 0.5 * p.mass * u @ u + 0.5 * np.trace(A @ p.second_moment @ A.T)
    assert 0.5 * m @ np.einsum("ij,ij->i", v, v) == pytest.approx(energy, rel=1e-13)
    turning = A @ p.second_moment  # int rho v r^T about the center
    moment = np.array([turning[2, 1] - turning[1, 2], turning[0, 2] - turning[2, 0], turning[1, 0] - turning[0, 1]])
    np.testing.assert_allclose(m @ np.cross(r, v), moment, rtol=1e-12, atol=1e-12 * np.abs(turning).max())


def test_the_points_are_the_surface_in_every_affine_motion():
    rigid, rng = body(position=(1, 2, 3), rotation=(0.3, -0.2, 1.0)), np.random.default_rng(1)
    first = soft(position=(10, 0, 0))
    system = system_of(first, rigid)
    part = system.bodies[1]
    A, t = rng.normal(size=(3, 3)), rng.normal(size=3)
    x = system.rest_positions.copy()
    x[part.vertices] = x[part.vertices] @ A.T + t
    moved = system.split(x)
    np.testing.assert_allclose(moved["palm"], rigid.surface.vertices @ A.T + t, atol=1e-12)
    np.testing.assert_array_equal(moved["soft"], first.mesh.vertices)
    np.testing.assert_allclose(system.rest_points[part.points], rigid.surface.vertices, atol=1e-13)
    np.testing.assert_array_equal(system.triangles[part.triangles] - part.points.start, rigid.surface.triangles)


def test_a_tet_mesh_gives_its_surface_without_inner_vertices():
    mesh = sp.shapes.box((1, 1, 1), (2, 2, 2))
    rigid = body(mesh)
    assert len(rigid.points) == len(mesh.vertices) - 1
    assert rigid.properties.mass == pytest.approx(100.0)


def test_mass_density_and_inertia():
    assert body(BOX).properties.mass == pytest.approx(600.0)
    assert body(BOX, density=None, mass=3.0).properties.mass == 3.0
    own = body(BOX, density=None, mass=3.0, inertia=[3.0, 4.0, 5.0])
    np.testing.assert_allclose(own.properties.inertia, np.diag([3.0, 4.0, 5.0]), atol=1e-14)
    r = own.mesh.vertices - own.properties.center
    np.testing.assert_allclose(0.75 * (np.sum(r**2) * np.eye(3) - r.T @ r), np.diag([3.0, 4.0, 5.0]), atol=1e-12)


def energy_and_derivatives(system, x, project=False):
    energy = elasticity_of(system)
    gradient, blocks = np.zeros_like(x), HessianBlocks.zeros(len(system.tets), len(x))
    energy.add_gradient(x, gradient)
    energy.add_hessian(x, blocks, project)
    return energy.value(x), gradient, blocks.tets[0].copy()


def test_a_center_of_mass_that_is_not_that_of_the_solid():
    own = body(BOX, density=None, mass=3.0, inertia=[3.0, 4.0, 5.0], center=(0.1, 0.2, -0.3))
    np.testing.assert_allclose(own.mesh.vertices.mean(axis=0), [0.1, 0.2, -0.3], atol=1e-14)
    np.testing.assert_allclose(own.properties.inertia, np.diag([3.0, 4.0, 5.0]), atol=1e-14)
    np.testing.assert_allclose(own.weights @ own.mesh.vertices, own.points, atol=1e-14)


def test_the_energy_is_that_of_an_affine_body_and_its_derivatives_are_limits_of_differences():
    rigid, rng = body(stiffness=2e3), np.random.default_rng(2)
    system = system_of(rigid)
    F = rotation_matrix((1.0, 2.0, -0.5)) @ (np.eye(3) + 0.2 * rng.normal(size=(3, 3)))
    x = rigid.mesh.vertices @ F.T + 3.0
    corners = system.tets[0]
    value, gradient, hessian = energy_and_derivatives(system, x)
    assert value == pytest.approx(2e3 * rigid.properties.volume * np.sum((F.T @ F - np.eye(3)) ** 2), rel=1e-11)
    d = rng.normal(size=x.shape)
    errors = []
    for step in (1e-2, 1e-3):
        ahead, behind = (energy_and_derivatives(system, x + s * step * d) for s in (1.0, -1.0))
        slope = (ahead[0] - behind[0]) / (2.0 * step)
        bend = (ahead[1] - behind[1]) / (2.0 * step)
        exact = (hessian @ d[corners].ravel()).reshape(4, 3)
        errors.append([abs(slope - np.sum(gradient * d)), np.abs(bend[corners] - exact).max()])
    rate = np.log10(np.array(errors[0]) / errors[1])
    np.testing.assert_allclose(rate, 2.0, atol=0.05)


def test_the_projected_hessian_is_the_nearest_semidefinite_one():
    rigid, rng = body(stiffness=2e3), np.random.default_rng(3)
    system = system_of(rigid)
    squeezed = rigid.mesh.vertices @ (0.7 * np.eye(3) + 0.1 * rng.normal(size=(3, 3))).T
    true, projected = (energy_and_derivatives(system, squeezed, project)[2] for project in (False, True))
    assert np.linalg.eigvalsh(true)[0] < -1e-3 * np.linalg.norm(true)
    assert np.linalg.eigvalsh(projected)[0] > -1e-12 * np.linalg.norm(projected)
    stretched = rigid.mesh.vertices @ rotation_matrix((1.0, 2.0, 3.0)).T * 1.3
    true, projected = (energy_and_derivatives(system, stretched, project)[2] for project in (False, True))
    np.testing.assert_allclose(projected, true, atol=1e-12 * np.abs(true).max())


def test_a_pose_is_what_the_body_was_given():
    turn, spin = np.array([0.3, -2.0, 1.0]), np.array([1.0, 2.0, 3.0])
    rigid = body(position=(1, 2, 3), rotation=turn, velocity=(4, 5, 6), angular_velocity=spin)
    system = system_of(rigid)
    state = initial_state(system.scene)
    pose = pose_of(system.rest_positions, state.positions, state.velocities)
    np.testing.assert_allclose(pose.rotation, rotation_matrix(turn), atol=1e-13)
    np.testing.assert_allclose(pose.translation, (1, 2, 3), atol=1e-12)
    np.testing.assert_allclose(pose.velocity, (4, 5, 6), atol=1e-12)
    np.testing.assert_allclose(pose.angular_velocity, spin, atol=1e-12)


def test_the_nearest_rigid_place_keeps_center_and_angular_momentum_and_is_nearest():
    rest = body().mesh.vertices
    F = rotation_matrix((0.5, 1.0, -2.0)) @ (np.eye(3) + 0.1 * np.random.default_rng(4).normal(size=(3, 3)))
    x = rest @ F.T + 2.0
    there = nearest_rigid(rest, x)
    assert orthogonality_error(rest, there) < 1e-13 < orthogonality_error(rest, x)
    np.testing.assert_allclose(there.mean(axis=0), x.mean(axis=0), atol=1e-13)
    # Forces towards it have no moment, which is the condition for the least sum of squares.
    np.testing.assert_allclose(np.cross(there - x.mean(axis=0), x - there).sum(axis=0), 0.0, atol=1e-13)
    for k in range(3):
        turned = (there - there.mean(axis=0)) @ rotation_matrix(1e-3 * np.eye(3)[k]).T + there.mean(axis=0)
        assert np.sum((turned - x) ** 2) > np.sum((there - x) ** 2)
    mirrored = nearest_rigid(rest, rest * [1, 1, -1])
    assert np.linalg.det(mirrored[1:] - mirrored[0]) * np.linalg.det(rest[1:] - rest[0]) > 0.0


def test_the_default_stiffness_follows_the_heaviest_load():
    def kappa(*others, **scene):
        return sp.Scene([body(BOX), *others], **scene).bodies[0].kappa

    alone = kappa()
    assert kappa(body(BOX, name="light", density=1.0)) == pytest.approx(alone, rel=1e-3)
    assert kappa(body(BOX, name="heavy", density=1e6)) > 40.0 * alone
    assert kappa(gravity=(0, -98.1, 0)) == pytest.approx(10.0 * alone)
    assert kappa(gravity=(0, 0, 0)) == alone
    assert kappa(soft()) < kappa(sp.Body("stiff", soft().mesh, sp.StableNeoHookean(youngs=1e9, poisson=0.3)))
    assert sp.Scene([body(BOX, velocity=(100, 0, 0))]).bodies[0].kappa > 5.0 * alone
    assert sp.Scene([body(BOX, stiffness=7.0)]).bodies[0].kappa == 7.0
    ends = (alone_body := body(BOX)).name, (None, (0.0, 1.0, 0.0))
    slack, tense = (sp.Spring((ends[0], 0), ends[1], stiffness=1e6, rest_length=rest) for rest in (None, 0.0))
    assert kappa(loads=[slack]) == alone
    distance = np.linalg.norm(alone_body.place(alone_body.points)[0] - (0.0, 1.0, 0.0))
    length, volume = np.linalg.norm(np.ptp(alone_body.points, axis=0)), alone_body.properties.volume
    assert kappa(loads=[tense]) - alone == pytest.approx(1e6 * distance * length / volume / 4e-3)
    # In millimetres, with the density that keeps the weight per area: the same shapes under the same load.
    small = sp.RigidBody("small", BOX.transformed(scale=1e-3), density=1e5)
    assert sp.Scene([small]).bodies[0].kappa == pytest.approx(alone)


def test_given_positions_are_those_of_the_surface_and_must_be_rigid():
    rigid = body()
    scene = sp.Scene([rigid])
    there = rigid.surface.vertices @ rotation_matrix((0.1, 0.2, 3.0)).T + 5.0
    spinning = np.cross([1.0, 2.0, 3.0], there)
    state = initial_state(scene, {"palm": there}, {"palm": spinning})
    split = build_system(scene).split
    np.testing.assert_allclose(split(state.positions)["palm"], there, atol=1e-12)
    np.testing.assert_allclose(split(state.velocities)["palm"], spinning, atol=1e-11)
    bent = there.copy()
    bent[0] += 1e-3
    for wrong in (bent, 1.1 * there, there * [1, 1, -1]):
        with pytest.raises(sp.SceneError, match=r"initial_positions\['palm'\] is not a rigid motion of its surface"):
            initial_state(scene, {"palm": wrong})
    with pytest.raises(sp.SceneError, match=r"initial_positions\['palm'\] has shape \(4, 3\); the body's mesh needs"):
        initial_state(scene, {"palm": there[:4]})


PIN = sp.Pin("palm")


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: body(density=None), "rigid body 'palm': none of them given; give exactly one of density and mass"),
        (lambda: body(mass=1.0), "rigid body 'palm': density and mass given; give exactly one of density and mass"),
        (lambda: body(density=0.0), "rigid body 'palm': density is 0; it must be above zero"),
        (lambda: body(density=None, mass=0.0), "rigid body 'palm': mass is 0; it must be above zero"),
        (
            lambda: body(density=None, mass=1e-320),
            "rigid body 'palm': its mass is 9.99989e-321 kg; give one",
        ),
        (
            lambda: body(BOX, density=1e307),
            "rigid body 'palm': its mass is 6e[+]307 kg; give one from 1e-90 to 1e[+]90 kg",
        ),
        (
            lambda: body(density=None, mass=1, inertia=[1e308] * 3),
            "rigid body 'palm': inertia is 1e[+]308 kg",
        ),
        (lambda: body(inertia=[1, 1, 1]), "rigid body 'palm': inertia needs a mass"),
        (lambda: body(density=None, mass=1.0, center=(0, 0, 0)), "rigid body 'palm': center needs an inertia"),
        (lambda: body(center=(0, 0, 0)), "rigid body 'palm': center needs a mass and an inertia"),
        (lambda: body(density=None, mass=1.0, inertia=[1, 1, 3]), "rigid body 'palm': .*triangle inequality"),
        (lambda: body(BOX.flipped()), "rigid body 'palm': its surface is inside out"),
        (lambda: body("box"), "rigid body 'palm': shape is a str; give a SurfaceMesh or a TetMesh"),
        (lambda: body(stiffness=-1.0), "rigid body 'palm': stiffness is -1; it must be above zero"),
        (lambda: body(friction=-1.0), "rigid body 'palm': friction is -1"),
        (lambda: body(velocity=(1, 2)), "rigid body 'palm': velocity has shape"),
        (lambda: body(position=(1e12, 0, 0)), "rigid body 'palm': position is 1e[+]12 m from the origin"),
        (lambda: sp.Scene([body(), soft("palm")]), "body 'palm' and body 'palm' have the same name"),
        (lambda: sp.Scene([TORUS]), r"bodies\[0\] is a SurfaceMesh; give a Body or RigidBody"),
        (
            lambda: sp.Scene([body()], pins=[sp.Pin("palm", [0, 1])]),
            "pin of body 'palm': a rigid body is held as a whole; leave out `vertices`",
        ),
        (lambda: sp.Scene([body()], pins=[PIN, PIN]), "is already held by another pin"),
        (
            lambda: sp.Scene([body()], soft_targets=[sp.SoftTarget("palm", [0], 1.0)]),
            "soft target of body 'palm': body 'palm' is rigid; soft targets pull soft bodies; "
            "move a rigid one with a Pin or a Force",
        ),
    ],
)
def test_one_line_names_what_is_wrong(make, text):
    with pytest.raises(sp.SceneError, match=text):
        make()


def test_a_motion_that_would_deform_the_body():
    pin = sp.Pin("palm", motion=lambda t: np.zeros((4, 3)))
    system = system_of(body(), pins=[pin])
    with pytest.raises(sp.SceneError, match=r"pin of body 'palm': motion\(0\) has shape \(4, 3\); .* shape \(3,\)"):
        system.pin_targets(0.0)
