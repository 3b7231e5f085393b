"""A ball pressed on a half-space, against Hertz (1882): F = 4/3 E* sqrt(R) d^1.5 over a circle of radius sqrt(R d)."""

import numpy as np
import pytest

import supple as sp

RADIUS, HEIGHT, WIDTH = 1.0, 0.8, 0.6
YOUNGS, POISSON = 1e6, 0.3
DHAT, APPROACH = 1e-4, 1e-2


def cap(across, layers):
    """A block whose lower face is a piece of a sphere, fine where it touches; its upper one is held."""
    box = sp.shapes.box((2, 1, 2), (across, layers, across))
    u, t, w = box.vertices[:, 0], box.vertices[:, 1] + 0.5, box.vertices[:, 2]
    x, z = (WIDTH * (0.15 * s + 0.85 * s**3) for s in (u, w))
    y = HEIGHT * (0.12 * t + 0.88 * t**2.5)
    y += (RADIUS - np.sqrt(RADIUS**2 - x * x - z * z)) * (1.0 - y / HEIGHT)
    return sp.TetMesh(np.column_stack([x, y, z]), box.tets)


def pressed(across, layers):
    """Force and radius of contact, as shares of Hertz's."""
    mesh = cap(across, layers)
    top = np.flatnonzero(mesh.vertices[:, 1] > HEIGHT - 1e-9)
    down = sp.Keyframes(times=[0, 1], displacements=[[0, 0, 0], [0, -(APPROACH + 0.1 * DHAT), 0]])
    material = sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON, density=1000.0)
    ball = sp.Body("ball", mesh, material, position=(0, 1.1 * DHAT, 0))
    pin = sp.Pin("ball", vertices=top, motion=down)
    scene = sp.Scene([ball], [sp.HalfSpace(name="floor")], pins=[pin], gravity=(0, 0, 0))
    solver = sp.Implicit(integrator="static", contact=sp.IPCContact(dhat=DHAT))
    (frame,) = sp.simulate(scene, solver, 1.0, 1)
    assert frame.report.status == "converged"
    found = frame.contacts
    d = APPROACH - DHAT + found.distances.min()
    force = found.force_between("ball", "floor")[1]
    # Hertz's pressure has a mean square radius of two fifths of the circle's.
    squared = found.points[:, 0] ** 2 + found.points[:, 2] ** 2
    radius = np.sqrt(2.5 * (found.forces[:, 1] @ squared) / found.forces[:, 1].sum())
    modulus = YOUNGS / (1.0 - POISSON**2)
    return force / (4.0 / 3.0 * modulus * np.sqrt(RADIUS) * d**1.5), radius / np.sqrt(RADIUS * d)


def test_a_ball_on_a_half_space_agrees_with_hertz():
    """A block held 8 radii of contact away is stiffer than half a space by some 5 %, and coarse tets are, too."""
    coarse, _ = pressed(8, 6)
    fine, radius = pressed(16, 10)
    assert 1.0 < fine < 1.16  # measured: 1.280, 1.144
    assert fine - 1.0 < 0.6 * (coarse - 1.0)
    assert radius == pytest.approx(1.0, abs=0.06)  # measured: 0.951
