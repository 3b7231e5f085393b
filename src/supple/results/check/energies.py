"""Energies that bodies and stitches store, from the recorded laws: the check's own sums.

A stitch tet stores V (mu/2 (tr F^T F - 3) - mu (J - 1) + lam/2 (J - 1)^2), a spring k/2 (length - rest length)^2.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from supple.materials.isotropic import densities, rest_lame_parameters
from supple.materials.kinds import has_volume_term, needs_positive_volume
from supple.materials.per_tet import NOT_ELASTIC, TetMaterial
from supple.results.check.geometry.quadratic_tets import at_quadrature_points
from supple.results.check.geometry.vectors import determinants, edge_vectors
from supple.results.check.known import Floats, Frame, Known

_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


def knows_all_laws(of: Known) -> bool:
    """Whether the elastic energy of each body can be computed."""
    kinds = [of.material.kind[body.tets] for body, law in zip(of.bodies, of.springs, strict=True) if law is None]
    return len(of.springs) > 0 and all(bool((kind != NOT_ELASTIC).all()) for kind in kinds)


def elastic_energy(at: Frame) -> float | None:
    """[J], zero at rest; None where the law of a body is not known."""
    of = at.of
    if not knows_all_laws(of):
        return None
    total = _energy_of_edges_and_volumes(at)
    total += sum(stored.energy(at.positions[body.vertices]) for body, stored in of.thin)
    for rows, F, volumes in _at_points(at):
        kind, mu, lam = of.material.kind[rows], of.material.mu[rows], of.material.lam[rows]
        # (k,) the part of the first Lamé parameter of which a quadratic tet takes its mean J (docs/theory/locking.md)
        share, psi = _mean_share(of.material)[rows] * (F.shape[1] > 1), np.zeros(volumes.shape)
        column = (np.repeat(law, F.shape[1]) for law in (kind, mu, lam - share))
        flat = psi.ravel()
        densities(np.ascontiguousarray(F.reshape(-1, 3, 3)), *column, flat)
        psi = np.where(kind[:, None] < 0, 0.0, flat.reshape(volumes.shape))
        begin = 0
        for part in of.material.laws:
            flowing = slice(begin, begin + len(part.rows) * part.points * (part.flow is not None))
            begin = flowing.stop
            inside = np.isin(part.rows, rows)
            if not inside.any():  # a law is that of one body, whose tets are of one order
                continue
            own, parameters = np.searchsorted(rows, part.rows), part.parameters.copy()
            elastic = F[own]
            if part.flow is not None:  # what is left of F after flow
                elastic = elastic @ at.internal[flowing, :9].reshape(elastic.shape)
            elif part.law.bulk is not None:
                parameters[:, part.law.bulk] -= share[own]
            for point in range(F.shape[1]):
                psi[own, point] += part.law.densities(elastic[:, point], parameters)
        total += float((psi * volumes).sum())
        if share.any():
            whole = volumes.sum(axis=1)
            J = (determinants(F) * volumes).sum(axis=1) / whole
            with np.errstate(invalid="ignore", divide="ignore"):
                change = np.where(needs_positive_volume(kind), np.log(J), J - 1.0)
            total += 0.5 * float((whole * share) @ change**2)
    return total


def _at_points(at: Frame) -> Iterator[tuple[NDArray[np.int64], Floats, Floats]]:
    """The rows (k,) of linear tets, then of quadratic ones, F after growth at their q quadrature points (k, q, 3, 3),
    and the stress-free volumes of these (k, q) [m^3]."""
    (grown, ratios), (curved, nodes) = at.growth, at.quadratic
    rows = np.setdiff1d(np.arange(len(ratios)), curved)
    yield rows, (at.F[rows] @ grown[rows])[:, None], (at.of.rest_volumes * ratios)[rows, None]
    if len(curved):
        F, volumes = at_quadrature_points(nodes, at.of.quadratic_at_rest)
        yield curved, F @ grown[curved, None], volumes * ratios[curved, None]


def _mean_share(material: TetMaterial) -> Floats:
    mu, lam = rest_lame_parameters(material)
    share = np.where(lam > 2.0 * mu, lam - mu - 2.0 * mu**2 / np.where(lam > 0.0, lam, 1.0), 0.0)
    at_most = np.where(has_volume_term(material.kind), np.inf, 0.0)
    for part in material.elastic_laws:
        if part.law.bulk is not None:
            at_most[part.rows] = np.maximum(part.parameters[:, part.law.bulk], 0.0)
    return np.minimum(share, at_most)


def _energy_of_edges_and_volumes(at: Frame) -> float:
    """The energy [J] of the bodies that are made of them: 1/2 C^2 / compliance for each edge and each tet."""
    total, of = 0.0, at.of
    for body, law in zip(of.bodies, of.springs, strict=True):
        if law is not None and law.edge_compliance > 0.0:
            edges = np.unique(np.sort(of.tets[body.tets][:, _EDGES].reshape(-1, 2), axis=1), axis=0)
            lengths, rest = (
                np.linalg.norm(np.diff(x[edges], axis=1), axis=2) for x in (at.positions, of.rest_positions)
            )
            total += 0.5 * float(((lengths - rest) ** 2).sum()) / law.edge_compliance
        if law is not None and law.volume_compliance > 0.0:
            change = (at.J[body.tets] - 1.0) * of.rest_volumes[body.tets]
            total += 0.5 * float(change @ change) / law.volume_compliance
    return total


def stiffness_scale(of: Known) -> float:
    """An energy [J] that round-off of elastic and stitch energies is measured by: of strains of a few percent
    everywhere."""
    total = (np.abs(of.material.mu) + np.abs(of.material.lam)) @ of.rest_volumes
    total += sum(stored.scale for _, stored in of.thin)
    if of.stitching is not None:
        tets, springs = of.stitching.tets, of.stitching.springs
        total += (np.abs(tets.mu) + np.abs(tets.lam)) @ _volumes(tets.rest_shape_inverse)
        total += springs.stiffness @ springs.rest_lengths**2
    return 1e-3 * float(total)


def stitch_energies(at: Frame) -> Floats:
    """(k,) of each pair, as if it held [J], zero at rest."""
    if at.of.stitching is None or at.of.stitch_ends is None:
        return np.zeros(0)
    tets, springs, count = at.of.stitching.tets, at.of.stitching.springs, len(at.of.stitching.tets)
    corners = at.of.stitch_ends.corners(at.positions, at.poses)
    F = edge_vectors(corners[:count].reshape(-1, 3), np.arange(4 * count).reshape(-1, 4)) @ tets.rest_shape_inverse
    growth = determinants(F) - 1.0
    density = 0.5 * tets.mu * (np.einsum("tij,tij->t", F, F) - 3.0) - tets.mu * growth + 0.5 * tets.lam * growth**2
    places = np.einsum("kc,kci->ki", at.of.stitch_ends.weights[count:], corners[count:, 1:])
    extension = np.linalg.norm(corners[count:, 0] - places, axis=1) - springs.rest_lengths
    return np.concatenate([density * _volumes(tets.rest_shape_inverse), 0.5 * springs.stiffness * extension**2])


def _volumes(rest_shape_inverse: Floats) -> Floats:
    """(t,) [m^3]: a sixth of det Dm."""
    return 1.0 / (6.0 * np.abs(np.linalg.det(rest_shape_inverse)))
