"""A ball pressed on a half-space, against Hertz (1882): F = 4/3 E* sqrt(R) d^1.5, radius of contact sqrt(R d)."""

import numpy as np
import pytest

import supple as sp

RADIUS, YOUNGS, POISSON = 1.0, 1e6, 0.3
# The largest radius of contact, a / R = .02: there Hertz's paraboloid is a ball, and strains are small.
CONTACT = 0.02
APPROACH = CONTACT**2 / RADIUS
DHAT = 0.01 * APPROACH
# Half of the cells lie within FINE a, the others grow from there to FAR a, where the block ends.
FINE, FAR = 1.3, 15.0


def hertz(d):
    """The force [N] at an approach [m]."""
    return 4.0 / 3.0 * YOUNGS / (1.0 - POISSON**2) * np.sqrt(RADIUS) * d**1.5


def graded_block(cells):
    """A block of quadratic tets whose lower face is a ball's within 4 a, `cells` high and twice as wide and long.

    Returns the mesh, and the vertices of all of its faces but the lower one.
    """
    box = sp.shapes.box((2, 1, 2), (2 * cells, cells, 2 * cells))
    x, fine = box.vertices + np.array([0.0, 0.5, 0.0]), cells // 2
    layer = cells * np.abs(x).max(axis=1)
    growth = (FAR / FINE) ** (1.0 / (cells - fine))
    distance = FINE * np.where(layer < fine, layer / fine, growth ** np.maximum(layer - fine, 0.0))
    x *= (CONTACT * cells * distance / np.where(layer > 0.0, layer, 1.0))[:, None]
    quadratic = sp.TetMesh(x, box.tets).to_order(2)
    x = quadratic.vertices.copy()
    end = FAR * CONTACT * (1.0 - 1e-9)
    held = np.flatnonzero((x[:, 1] > end) | (np.abs(x[:, ::2]).max(axis=1) > end))
    reach = 4.0 * CONTACT
    r = np.minimum(np.hypot(x[:, 0], x[:, 2]), reach)
    x[:, 1] += (RADIUS - np.sqrt(RADIUS**2 - r**2)) * np.clip(1.0 - x[:, 1] / reach, 0.0, 1.0)
    return sp.TetMesh(x, quadratic.nodes), held


def boussinesq(x, force):
    """Displacements (k, 3) [m] of the half-space y > 0 by a force [N] along y at the origin (Boussinesq 1885)."""
    r, R = np.hypot(x[:, 0], x[:, 2]), np.linalg.norm(x, axis=1)
    shear = YOUNGS / (2.0 * (1.0 + POISSON))
    up = 2.0 * (1.0 - POISSON) / R + x[:, 1] ** 2 / R**3
    out = r * x[:, 1] / R**3 - (1.0 - 2.0 * POISSON) * r / (R * (R + x[:, 1]))
    along = out / np.where(r > 0.0, r, 1.0)
    return force / (4.0 * np.pi * shear) * np.column_stack([along * x[:, 0], up, along * x[:, 2]])


def pressed(cells, steps=1):
    """Forces and radii of contact as shares of Hertz's, of as many approaches.

    The block's faces are where those of half a space would be. An error of the force there has a part of
    .73 / FAR, a twentieth, in the result.
    """
    mesh, held = graded_block(cells)

    def moved(time):
        d = APPROACH * time
        return boussinesq(mesh.vertices[held], hertz(d)) - [0, d + 0.1 * DHAT, 0]

    material = sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON, density=1000.0)
    ball = sp.Body("ball", mesh, material, position=(0, 1.1 * DHAT, 0))
    pin = sp.Pin("ball", vertices=held, motion=moved)
    scene = sp.Scene([ball], [sp.HalfSpace(name="floor")], pins=[pin], gravity=(0, 0, 0))
    solver = sp.Implicit(integrator="static", contact=sp.IPCContact(dhat=DHAT))
    shares = []
    for frame in sp.simulate(scene, solver, 1.0 / steps, steps):
        assert frame.report.status == "converged"
        found = frame.contacts
        assert found is not None
        forces = found.forces[:, 1]
        # Undeformed, the ball would be below the floor by the way that it went less the gap at the start.
        d = APPROACH * frame.time - DHAT + forces @ found.distances / forces.sum()
        force = found.force_between("ball", "floor")[1]
        # Hertz's pressure has a mean square radius of two fifths of the circle's.
        squared = found.points[:, 0] ** 2 + found.points[:, 2] ** 2
        radius = np.sqrt(2.5 * (forces @ squared) / forces.sum())
        shares.append((force / hertz(d), radius / np.sqrt(RADIUS * d)))
    return np.array(shares)


def test_a_ball_on_a_half_space_agrees_with_hertz():
    ((force, radius),) = pressed(4)  # 1,536 tets, of which two cover the radius of contact
    assert force == pytest.approx(1.0, abs=0.08)  # measured: 1.070
    assert radius == pytest.approx(1.0, abs=0.01)  # measured: 1.001


@pytest.mark.slow
def test_the_force_of_a_ball_converges_to_that_of_hertz():
    ((coarse, _),) = pressed(6)  # 5,184 tets
    forces, radii = pressed(8, 4).T  # 12,288 tets
    assert coarse == pytest.approx(1.0, abs=0.03)  # measured: 1.016
    assert forces == pytest.approx(1.0, abs=0.015)  # measured: .993, 1.009, 1.003, 1.004
    assert radii == pytest.approx(1.0, abs=0.04)  # measured: .969, 1.005, 1.000, 1.002
