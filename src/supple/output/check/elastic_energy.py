"""The elastic energy of a frame, from the recorded laws: the check's own sum over tets, edges and volumes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from supple.materials.isotropic import densities, rest_lame_parameters
from supple.materials.kinds import needs_positive_volume
from supple.materials.per_tet import NO_REGION, TetMaterial
from supple.materials.tet_energies import element_energies
from supple.numerics.threads import threads_for
from supple.output.check.geometry.quadratic_tets import at_quadrature_points
from supple.output.recording.reader import Recording

_TETS_PER_THREAD = 5_000
_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def elastic_energy(
    recording: Recording,
    x: NDArray[np.float64],
    J: NDArray[np.float64],
    rest_inverse: NDArray[np.float64],
) -> float | None:
    """[J], zero at rest; None where the recording does not contain the law of a body.

    Parameters
    ----------
    x : (n, 3) positions [m]; J : (m,) determinants of F; rest_inverse : (m, 3, 3) Dm^-1 [1/m]
    """
    physics = recording.physics
    if physics is None:
        return None
    total = 0.0
    for k, body in enumerate(recording.bodies):
        if not physics.knows_law(k, body.tets):
            return None
        tets = np.ascontiguousarray(recording.tets[body.tets])
        volumes = recording.rest_volumes[body.tets]
        pair = physics.compliances[k]
        nodes = recording.nodes_of(body)
        if nodes.shape[1] == 10:
            F, parts = at_quadrature_points(x[nodes], recording.rest_positions[nodes])
            laws = physics.kind[body.tets].astype(np.int32), physics.mu[body.tets], physics.lam[body.tets]
            of_points = np.empty(parts.size)
            densities(F.reshape(-1, 3, 3), *(np.repeat(law, parts.shape[1]) for law in laws), of_points)
            total += float(of_points @ parts.ravel())
            continue
        if pair is None:
            out = np.empty(len(tets))
            laws = physics.kind[body.tets].astype(np.int32), physics.mu[body.tets], physics.lam[body.tets]
            with threads_for(len(tets), _TETS_PER_THREAD):
                element_energies(x, tets, rest_inverse[body.tets], volumes, *laws, out)
            region = physics.region[body.tets]
            total += float(out[region == NO_REGION].sum())
            for number in np.unique(region[region != NO_REGION]):
                of = region == number
                total += _averaged(
                    x, tets[of], rest_inverse[body.tets][of], volumes[of], J[body.tets][of], [law[of] for law in laws]
                )
            continue
        if pair[0] > 0.0:
            edges = np.unique(np.sort(tets[:, _EDGES].reshape(-1, 2), axis=1), axis=0)
            ends, rest = x[edges], recording.rest_positions[edges]
            stretch = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) - np.linalg.norm(rest[:, 0] - rest[:, 1], axis=1)
            total += 0.5 * float(stretch @ stretch) / pair[0]
        if pair[1] > 0.0:
            change = (J[body.tets] - 1.0) * volumes
            total += 0.5 * float(change @ change) / pair[1]
    return total


def _averaged(x, tets, rest_inverse, volumes, J, laws) -> float:
    """The energy of one region's tets, averaged over edges and vertices (see `materials.patches`)."""
    kind, mu, lam = laws
    mu_L, lam_L = rest_lame_parameters(TetMaterial(mu, mu, kind, mu, lam, kind))
    rest = np.maximum(lam_L - mu_L, 0.0)
    x_of = x[tets]
    F = np.einsum("eki,ekj->eij", x_of[:, 1:] - x_of[:, :1], rest_inverse)
    ends = np.sort(tets[:, _EDGES], axis=2).reshape(-1, 2)
    _, first, edge = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    shares = sparse.coo_array((np.repeat(volumes / 6.0, 6), (edge.ravel(), np.repeat(np.arange(len(tets)), 6)))).tocsr()
    around = shares.sum(axis=1)
    means = (shares @ np.column_stack([F.reshape(-1, 9), mu, lam - rest])) / around[:, None]
    out = np.empty(len(means))
    densities(means[:, :9].reshape(-1, 3, 3).copy(), kind[first // 6], means[:, 9].copy(), means[:, 10].copy(), out)
    total = float(out @ around)
    quarters = np.repeat(volumes / 4.0, 4)
    _, first, vertex = np.unique(tets.ravel(), return_index=True, return_inverse=True)
    around = np.bincount(vertex, weights=quarters)
    J_mean = np.bincount(vertex, weights=quarters * np.repeat(J, 4)) / around
    factor = np.bincount(vertex, weights=quarters * np.repeat(rest, 4)) / around
    logarithmic = needs_positive_volume(kind)[first // 4]
    with np.errstate(invalid="ignore", divide="ignore"):
        change = np.where(logarithmic, np.log(J_mean), J_mean - 1.0)
    return total + 0.5 * float((around * factor) @ change**2)


def stiffness_scale(recording: Recording) -> float:
    """An energy [J] that round-off of the elastic energy is measured by: of strains of a few percent everywhere."""
    physics = recording.physics
    if physics is None:
        return 0.0
    return 1e-3 * float((np.abs(physics.mu) + np.abs(physics.lam)) @ recording.rest_volumes)
