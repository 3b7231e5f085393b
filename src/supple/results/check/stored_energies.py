"""Energies that bodies and stitches store, from the recorded laws: the check's own sums.

A stitch tet stores V (mu/2 (tr F^T F - 3) - mu (J - 1) + lam/2 (J - 1)^2), a spring k/2 (length - rest length)^2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import GROWTH, ActiveTets
from supple.materials.isotropic import densities, rest_lame_parameters
from supple.materials.kinds import has_volume_term, needs_positive_volume
from supple.materials.per_tet import BY_LAW, LawTets, TetMaterial
from supple.materials.tet_energies import element_energies
from supple.results.check.geometry.quadratic_tets import at_quadrature_points
from supple.results.check.trajectory import Trajectory

_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def elastic_energy(
    recording: Trajectory,
    x: NDArray[np.float64],
    J: NDArray[np.float64],
    rest_inverse: NDArray[np.float64],
    internal: NDArray[np.float64],
    active: Sequence[ActiveTets] = (),
) -> float | None:
    """[J], zero at rest; None where the recording does not contain the law of a body.

    Parameters
    ----------
    x : (n, 3) positions [m]; J : (m,) determinants of F; rest_inverse : (m, 3, 3) Dm^-1 [1/m]
    internal : (k, 11) internal variables of the frame, see `State`; active : growths of the frame
    """
    material = recording.material
    grown, ratios = growth_of(active, len(J))
    rest_inverse, J, all_volumes = rest_inverse @ grown, J / ratios, recording.rest_volumes * ratios
    total = _flowing(recording, x, rest_inverse, internal, (grown, ratios))
    for k, body in enumerate(recording.bodies):
        if not recording.knows_law(k):
            return None
        tets = np.ascontiguousarray(recording.tets[body.tets])
        volumes = all_volumes[body.tets]
        pair = recording.compliances[k]
        nodes = recording.nodes_of(body)
        if nodes.shape[1] == 10:
            F, parts = at_quadrature_points(x[nodes], recording.rest_positions[nodes])
            F, parts = F @ grown[body.tets, None], parts * ratios[body.tets, None]
            laws = material.kind[body.tets], material.mu[body.tets], material.lam[body.tets]
            own = [_of_body(part, body.tets) for part in material.elastic_laws]
            share = _mean_share(laws, own)
            of_points = np.empty(parts.size)
            lowered = laws[0], laws[1], laws[2] - share
            densities(F.reshape(-1, 3, 3), *(np.repeat(law, parts.shape[1]) for law in lowered), of_points)
            of_points = np.where(laws[0][:, None] == BY_LAW, 0.0, of_points.reshape(parts.shape))
            for part in own:
                parameters = part.parameters.copy()
                if part.law.bulk is not None:
                    parameters[:, part.law.bulk] -= share[part.rows]
                for point in range(parts.shape[1]):
                    of_points[part.rows, point] += part.law.densities(F[part.rows, point], parameters)
            whole = parts.sum(axis=1)
            J_mean = (np.linalg.det(F) * parts).sum(axis=1) / whole
            with np.errstate(invalid="ignore", divide="ignore"):
                change = np.where(needs_positive_volume(laws[0]), np.log(J_mean), J_mean - 1.0)
            total += float((of_points * parts).sum()) + 0.5 * float((whole * share) @ change**2)
            continue
        if pair is None:
            out = np.empty(len(tets))
            laws = material.kind[body.tets], material.mu[body.tets], material.lam[body.tets]
            element_energies(x, tets, rest_inverse[body.tets], volumes, *laws, out)
            own = [_of_body(part, body.tets) for part in material.elastic_laws]
            out[laws[0] == BY_LAW] = 0.0
            F = _gradients(x, tets, rest_inverse[body.tets])
            for part in own:
                out[part.rows] += volumes[part.rows] * part.law.densities(F[part.rows], part.parameters)
            total += float(out.sum())
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


def growth_of(active: Sequence[ActiveTets], m: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(m, 3, 3) the inverses of all growths together, and (m,) their determinants."""
    F_g = np.tile(np.eye(3), (m, 1, 1))
    for each in active:
        if each.kind == GROWTH:
            d = each.directions
            stretched = np.einsum("ki,kj->kij", d, d) if len(d) else np.eye(3)
            F_g[each.rows] = F_g[each.rows] @ (np.eye(3) + (each.value - 1.0) * stretched)
    return np.asarray(np.linalg.inv(F_g), dtype=np.float64), np.asarray(np.linalg.det(F_g), dtype=np.float64)


def _gradients(x, tets, rest_inverse):
    """(m, 3, 3) F of tets."""
    x_of = x[tets]
    return np.einsum("eki,ekj->eij", x_of[:, 1:] - x_of[:, :1], rest_inverse)


def _flowing(recording: Trajectory, x, rest_inverse, internal, growth) -> float:
    """The energy of what is left of F after growth and flow, F F_g^-1 F_i^-1; rest_inverse is that after growth."""
    total, begin = 0.0, 0
    grown, ratios = growth
    F = _gradients(x, recording.tets, rest_inverse)[:, None]
    parts = (recording.rest_volumes * ratios)[:, None]
    for part, _ in recording.material.flowing_laws:
        of, volumes = F[part.rows], parts[part.rows]
        if part.points > 1 and recording.quadratic is not None:
            rows, all_nodes = recording.quadratic
            nodes = all_nodes[np.searchsorted(rows, part.rows)]
            of, volumes = at_quadrature_points(x[nodes], recording.rest_positions[nodes])
            of, volumes = of @ grown[part.rows, None], volumes * ratios[part.rows, None]
        inverse = internal[begin : begin + volumes.size, :9].reshape(*volumes.shape, 3, 3)
        for point in range(part.points):
            psi = part.law.densities(of[:, point] @ inverse[:, point], part.parameters)
            total += float(volumes[:, point] @ psi)
        begin += volumes.size
    return total


def _of_body(part: LawTets, tets: slice) -> LawTets:
    """The tets of a law that are a body's, with numbers in the body."""
    inside = (part.rows >= tets.start) & (part.rows < tets.stop)
    return part.of(part.rows[inside] - tets.start, part.parameters[inside])


def _mean_share(laws, own: list[LawTets]) -> NDArray[np.float64]:
    """(m,) the part of the first Lamé parameter of which a quadratic tet takes its mean J (docs/theory/locking.md)."""
    kind, mu, lam = laws
    mu_L, lam_L = rest_lame_parameters(TetMaterial(mu, mu, kind, mu, lam))
    share = np.where(lam_L > 2.0 * mu_L, lam_L - mu_L - 2.0 * mu_L**2 / np.where(lam_L > 0.0, lam_L, 1.0), 0.0)
    at_most = np.where(has_volume_term(kind), np.inf, 0.0)
    for part in own:
        if part.law.bulk is not None:
            at_most[part.rows] = np.maximum(part.parameters[:, part.law.bulk], 0.0)
    return np.minimum(share, at_most)


def stiffness_scale(recording: Trajectory) -> float:
    """An energy [J] that round-off of the elastic energy is measured by: of strains of a few percent everywhere."""
    material = recording.material
    return 1e-3 * float((np.abs(material.mu) + np.abs(material.lam)) @ recording.rest_volumes)


def stitch_energies(recording: Trajectory, x: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k,) of each pair, as if it held [J], zero at rest.

    Parameters
    ----------
    x : (n, 3) positions [m]; poses : (obstacles, 3, 4) of the obstacles that bodies are stitched to
    """
    laws = recording.stitches
    if laws is None:
        return np.zeros(0)
    corners = laws.ends.corners(x, poses)
    count = len(laws.moduli)
    edges = (corners[:count, 1:] - corners[:count, :1]).transpose(0, 2, 1)
    F = edges @ laws.rest_shape_inverse
    a, b, c = F[:, :, 0], F[:, :, 1], F[:, :, 2]
    growth = np.einsum("ij,ij->i", a, np.cross(b, c)) - 1.0
    mu, lam = laws.moduli.T
    density = 0.5 * mu * (np.einsum("tij,tij->t", F, F) - 3.0) - mu * growth + 0.5 * lam * growth * growth
    places = np.einsum("kc,kci->ki", laws.ends.weights[count:], corners[count:, 1:])
    stiffness, rest = laws.springs.T
    extension = np.linalg.norm(corners[count:, 0] - places, axis=1) - rest
    of_tets = density * _volumes(laws.rest_shape_inverse)
    return np.concatenate([of_tets, 0.5 * stiffness * extension * extension])


def stitch_scale(recording: Trajectory) -> float:
    """An energy [J] that round-off of the stitch energy is measured by: of strains of a few percent everywhere."""
    laws = recording.stitches
    if laws is None:
        return 0.0
    stiffness, rest = laws.springs.T
    return 1e-3 * float(np.abs(laws.moduli).sum(axis=1) @ _volumes(laws.rest_shape_inverse) + stiffness @ (rest * rest))


def _volumes(rest_shape_inverse: NDArray[np.float64]) -> NDArray[np.float64]:
    """(t,) [m^3]: a sixth of det Dm."""
    return 1.0 / (6.0 * np.abs(np.linalg.det(rest_shape_inverse)))
