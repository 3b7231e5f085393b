"""The energy of patches at given positions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.materials.patches.domains import EdgePatches, Patches
from supple.materials.patches.kernels import edge_energies, mean_gradients, star_pressures
from supple.runtime.threads import threads_for

# Fewer tets than this are processed by one thread.
SERIAL_TETS = 1_000


def patch_energies(patches: Patches, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(k,) of the patches of edges and (v,) of stars [J], for positions x (n, 3) [m]."""
    p = patches.edges
    of_edges = np.empty(len(p.volumes))
    with threads_for(len(patches.tets), SERIAL_TETS):
        edge_energies(x, p.start, p.vertices, p.gradients, p.volumes, p.kind, p.mu, p.lam, of_edges)
        for part in p.laws:
            psi = part.law.densities(edge_gradients(p, x, part.rows), part.parameters)
            of_edges[part.rows] += p.volumes[part.rows] * psi
        return of_edges, star_states(patches, x)[0]


def edge_gradients(edges: EdgePatches, x: NDArray[np.float64], rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """(r, 3, 3) the mean F of the patches `rows` (r,)."""
    F = np.empty((len(rows), 3, 3))
    mean_gradients(x, edges.start, edges.vertices, edges.gradients, rows, F)
    return F


def tet_shares(patches: Patches, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(m,) the patches' energy [J], of each patch in proportion to the volumes of its tets."""
    of_edges, of_stars = patch_energies(patches, x)
    edges = (of_edges / patches.edges.volumes)[patches.edges.of_tet].mean(axis=1)
    return patches.tet_volumes * (edges + (of_stars / patches.stars.volumes)[patches.stars.of_tet])


def star_states(
    patches: Patches, x: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """(v,) energies [J], pressures [Pa] and stiffnesses [Pa/m^3] of stars (`star_pressures`)."""
    p = patches.stars
    energies, pressures, stiffness = (np.empty(len(p.volumes)) for _ in range(3))
    star_pressures(x, patches.tets, p.tet_start, p.tets, p.volumes, p.kind, p.lam, energies, pressures, stiffness)
    return energies, pressures, stiffness
