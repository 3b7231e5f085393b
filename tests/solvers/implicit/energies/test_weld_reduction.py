"""Elimination of welded vertices."""

import numpy as np

import supple as sp
from supple.model.system import build_system
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.newton.reduction import Reduction

BEAM = sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1))
LEFT = np.flatnonzero(BEAM.vertices[:, 0] < -0.199)


def test_the_reduced_hessian_is_that_of_the_free_vertices():
    """Elements, vertices and couplings, against T^T H T with dense matrices."""
    cube = sp.RigidBody("cube", sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1)), density=1000, position=(-0.25, 0, 0))
    beam = sp.Body("beam", BEAM, sp.StableNeoHookean(youngs=2e5, poisson=0.3, density=1000))
    scene = sp.Scene([beam, cube], welds=[sp.Weld("beam", "cube", LEFT)])
    system = build_system(scene)
    reduction, n = Reduction.of(system), len(system.masses)
    rng = np.random.default_rng(0)
    blocks = HessianBlocks.zeros(len(system.tets), n)
    elements = rng.normal(size=blocks.elements.shape)
    blocks.elements[:] = elements + elements.transpose(0, 2, 1)
    at_vertices = rng.normal(size=(n, 3, 3))
    blocks.vertices[:] = at_vertices + at_vertices.transpose(0, 2, 1)
    rows, columns = rng.integers(0, n, (2, 40)).astype(np.int32)
    given = rng.normal(size=(40, 3, 3))
    given[rows == columns] += given[rows == columns].transpose(0, 2, 1)
    # Both ends welded, and a welded vertex with a control point of its own.
    rows[:3], columns[:3] = [LEFT[0], LEFT[1], LEFT[2]], [LEFT[1], n - 1, LEFT[2]]
    given[2] += given[2].T
    blocks.couplings.append(Couplings(rows, columns, given))

    def dense(couplings, with_elements):
        H = np.zeros((3 * n, 3 * n))
        for p in range(n):
            if with_elements or not reduction.welded[p]:
                H[3 * p : 3 * p + 3, 3 * p : 3 * p + 3] += blocks.vertices[p]
        for nodes, element in zip(system.tets, blocks.elements, strict=True):
            kept = np.ones(4, bool) if with_elements else ~reduction.welded[nodes]
            where = (3 * nodes[:, None] + np.arange(3)).ravel()
            mask = np.repeat(kept, 3)
            H[np.ix_(where[mask], where[mask])] += element[np.ix_(mask, mask)]
        for one in couplings:
            unit = np.eye(3 * n).reshape(-1, n, 3)
            H += np.array([_product(one, column) for column in unit])
        return H

    def _product(one, x):
        out = np.zeros((n, 3))
        one.add_product(x, out)
        return out.ravel()

    T = np.eye(3 * n)
    for vertex, control, weights in zip(
        system.welding.vertices, system.welding.control, system.welding.weights, strict=True
    ):
        T[3 * vertex : 3 * vertex + 3] = 0.0
        for k, w in zip(control, weights, strict=True):
            T[3 * vertex : 3 * vertex + 3, 3 * k : 3 * k + 3] = w * np.eye(3)
    free = np.repeat(~reduction.welded, 3)
    expected = (T.T @ dense(blocks.couplings, True) @ T)[np.ix_(free, free)]
    found = dense(reduction.couplings(blocks), False)[np.ix_(free, free)]
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())
    gradient = rng.normal(size=(n, 3))
    reduced = system.welding.reduced(gradient)
    np.testing.assert_allclose(reduced.ravel()[free], (T.T @ gradient.ravel())[free], atol=1e-13)
