"""The stress in a thick-walled cylinder under internal pressure converges to Lamé's solution."""

import numpy as np
import pytest

import supple as sp

INNER, OUTER, HEIGHT, E, NU, P = 0.1, 0.2, 0.06, 1e6, 0.3, 500.0
_TETS = np.array([[0, 1, 3, 7], [0, 1, 7, 5], [0, 5, 7, 4], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7]])


def ring(radial, around, layers, mirrored=False):
    """A mesh of a ring, and the rows of the triangles of its inner surface.

    Mirrored: neighbouring cells are mirror images, with smaller ones at both surfaces.
    """
    r = np.linspace(-1.0, 1.0, radial + 1)
    r = INNER + 0.5 * (OUTER - INNER) * (1.0 + (np.tanh(r) / np.tanh(1.0) if mirrored else r))
    t = 2 * np.pi * np.arange(around) / around
    z = np.linspace(0, HEIGHT, layers + 1)
    R, T, Z = np.meshgrid(r, t, z, indexing="ij")
    vertices = np.column_stack([(R * np.cos(T)).ravel(), (R * np.sin(T)).ravel(), Z.ravel()])
    i, j, k = (index.ravel() for index in np.meshgrid(*map(np.arange, (radial, around, layers)), indexing="ij"))
    m, n, o = (index % 2 * mirrored for index in (i, j, k))
    corners = [
        ((i + (di ^ m)) * around + (j + (dj ^ n)) % around) * (layers + 1) + k + (dk ^ o)
        for dk in (0, 1)
        for dj in (0, 1)
        for di in (0, 1)
    ]
    cells = np.stack(corners, axis=1)
    mesh = sp.TetMesh(vertices, cells[:, _TETS].reshape(-1, 4))
    radii = np.linalg.norm(mesh.vertices[:, :2], axis=1)
    inner = np.flatnonzero((radii[mesh.surface.triangles] < INNER * 1.0001).all(axis=1))
    return mesh, inner


def errors(radial, around, layers, mirrored=False):
    """Of the radial and the hoop stress in the mean square over the volume, relative to the pressure: in tets, at
    vertices."""
    mesh, inner = ring(radial, around, layers, mirrored)
    rubber = sp.StableNeoHookean(youngs=E, poisson=NU)
    scene = sp.Scene(
        [sp.Body("ring", mesh, rubber)], loads=[sp.Pressure("ring", P, region=inner)], gravity=(0.0, 0.0, 0.0)
    )
    # Long steps of backward Euler end in the equilibrium.
    *_, frame = sp.simulate(scene, sp.Implicit(contact=None, tolerance=1e-9), dt=0.05, steps=6)
    found = []
    shares = np.bincount(mesh.tets.ravel(), np.repeat(mesh.volumes / 4, 4))
    centers = mesh.vertices[mesh.tets].mean(axis=1)
    for x, stress, weights in (
        (centers, frame.stress["ring"], mesh.volumes),
        (mesh.vertices, frame.stress.at_vertices["ring"], shares),
    ):
        found.append(difference(x, stress, weights))
    return found


def difference(x, stress, weights):
    """Of the radial and the hoop stress (k, 3, 3) at x (k, 3) from Lame's, in the mean square, over the pressure."""
    r = np.linalg.norm(x[:, :2], axis=1)
    out = np.column_stack([x[:, 0] / r, x[:, 1] / r, np.zeros(len(r))])
    along = np.column_stack([-out[:, 1], out[:, 0], out[:, 2]])
    base, change = P * INNER**2 / (OUTER**2 - INNER**2), OUTER**2 / r**2
    square = 0.0
    for direction, exact in ((out, base * (1 - change)), (along, base * (1 + change))):
        square += (np.einsum("ei,eij,ej->e", direction, stress, direction) - exact) ** 2
    return float(np.sqrt(weights @ square / weights.sum())) / P


def quadratic_error(radial, around):
    """Of quadratic tets with curved sides, in one layer."""
    quad = ring(radial, around, 1)[0].to_order(2)
    x, nodes, radii = quad.vertices.copy(), quad.nodes, np.linalg.norm(quad.vertices[:, :2], axis=1)
    for k, (a, b) in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]):
        middle = nodes[:, 4 + k]
        wanted = 0.5 * (radii[nodes[:, a]] + radii[nodes[:, b]]) / radii[middle]
        x[middle, :2] = quad.vertices[middle, :2] * wanted[:, None]
    mesh = sp.TetMesh(x, nodes)
    body = sp.Body("ring", mesh, sp.StableNeoHookean(youngs=E, poisson=NU))
    distances = np.linalg.norm(body.points[:, :2], axis=1)
    inner = np.flatnonzero((distances[body.triangles] < INNER * 1.0001).all(axis=1))
    scene = sp.Scene([body], loads=[sp.Pressure("ring", P, region=inner)], gravity=(0.0, 0.0, 0.0))
    *_, frame = sp.simulate(scene, sp.Implicit(contact=None, tolerance=1e-7), dt=0.05, steps=4)
    return difference(mesh.vertices[nodes].mean(axis=1), frame.stress["ring"], mesh.volumes)


def test_stresses_converge_to_lames():
    coarse, fine = errors(3, 20, 1), errors(6, 40, 2)
    assert fine[0] < 0.6 * coarse[0]
    assert fine[1] < 0.45 * coarse[1]


def test_means_at_vertices_of_mirrored_linear_tets_are_within_a_percent():
    coarse, fine = (errors(radial, 5 * radial, 1, mirrored=True)[1] for radial in (12, 24))
    assert fine < 0.008
    assert fine < 0.35 * coarse  # with second order 0.25


def test_stresses_of_quadratic_tets_converge_with_second_order():
    assert quadratic_error(3, 20) < 0.55 * quadratic_error(2, 14)  # with second order 0.44


@pytest.mark.slow
def test_stresses_of_quadratic_tets_are_within_half_a_percent():
    assert quadratic_error(6, 40) < 0.005
