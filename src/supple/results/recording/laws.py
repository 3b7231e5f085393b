"""The quadratic tets of a recording, and the elastic laws of all, from which stresses and energies follow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.edge_springs import EdgeSprings
from supple.materials.elastic_tets.laws import TetLaws
from supple.materials.elastic_tets.quadratic import QuadraticTets
from supple.materials.per_tet import TetMaterial
from supple.results.recording.physics import RecordedPhysics
from supple.results.recording.scene import RecordedBody


def recorded_laws(
    physics: RecordedPhysics,
    bodies: Sequence[RecordedBody],
    rest_positions: NDArray[np.float64],
    tets: NDArray[np.int32],
    volumes: NDArray[np.float64],
    quadratic: tuple[NDArray[np.int32], NDArray[np.int32]] | None = None,
) -> TetLaws:
    """The laws of `tets` (m, 4).

    Density and damping are not recorded: they are NaN.

    Parameters
    ----------
    rest_positions : (n, 3) [m]; volumes : (m,) at rest [m^3]
    quadratic : rows (k,) and nodes (k, 10) of the quadratic tets, or None
    """
    curved = None
    if quadratic is not None:
        curved = QuadraticTets.of(quadratic[0].astype(np.int64), quadratic[1], rest_positions)
    m = len(tets)
    corners = rest_positions[tets]
    a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
    with np.errstate(all="ignore"):
        Dm_inv = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1) / (6.0 * volumes)[:, None, None]
    tets, unknown = np.ascontiguousarray(tets, dtype=np.int32), np.full(m, np.nan)
    kind = physics.tet_kinds
    material = TetMaterial(unknown, unknown, kind, physics.mu, physics.lam, physics.region, physics.laws)
    springs = [
        EdgeSprings.of(pair, body.tets, rest_positions, tets[body.tets], volumes[body.tets])
        for body, pair in zip(bodies, physics.compliances, strict=True)
        if pair is not None
    ]
    return TetLaws(tets, Dm_inv, volumes, material, tuple(springs), curved)
