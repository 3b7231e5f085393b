"""Patches: the tets around each edge, and a partition into stars, over which strains and volumes are averaged.

A linear tet has one F. With one volume condition for each tet, and about five tets for each vertex, a mesh of a nearly
incompressible material cannot bend: it locks. Its energy is therefore split into two sums,

    sum_k V_k psi'(F_k)  +  sum_a V_a l_a U(J_a),

k over edges and a over stars. Each tet belongs with a sixth of its volume to its edges, and as a whole to one star;
F_k and J_a are the means over these shares, and V_k and V_a their sums. psi' is the energy density with the
first Lamé parameter lam_L lowered to 2 mu, as of Poisson's ratio 1/3, and l_a U the rest of its volume term. Materials
with lam_L <= 2 mu are averaged over edges alone. For an affine motion both sums together are the energy of the tets.

A patch contains tets of one body and one region.

Sources: Nguyen-Xuan, Liu, Nguyen-Thoi, "An edge-based smoothed finite element method for analysis of two-dimensional
piezoelectric structures" (2009) for edges; de Souza Neto, Andrade Pires, Owen, "F-bar-based linear triangles and
tetrahedra for finite strain analysis of nearly incompressible solids" (2005) for a partition, here as an energy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.materials.isotropic import rest_lame_parameters
from supple.materials.kinds import STRETCH_ENERGIES
from supple.materials.patches.pairs import Pairs, pairs_of
from supple.materials.patches.stars import star_patches
from supple.materials.per_tet import BY_LAW, LawTets, TetMaterial
from supple.materials.stretch_energies import stable_neo_hookean

_SQUARED = STRETCH_ENERGIES.index(stable_neo_hookean.FUNCTIONS)
_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


@dataclass(frozen=True, eq=False)
class EdgePatches:
    """The patches of k edges. Slots s are the vertices of a patch; those of patch i are start[i] to start[i + 1].

    Attributes
    ----------
    start : (k + 1,); vertices : (s,); owner : (s,) the patch of each slot
    gradients : (s, 3) g with F = sum x g^T [1/m]; volumes : (k,) [m^3]; kind, mu, lam : (k,) of psi'
    of_tet : (m, 6) the patches that each tet belongs to
    laws : whose energies are added to those of `kind`; their rows are patches
    """

    start: NDArray[np.int32]
    vertices: NDArray[np.int32]
    owner: NDArray[np.int32]
    gradients: NDArray[np.float64]
    volumes: NDArray[np.float64]
    kind: NDArray[np.int32]
    mu: NDArray[np.float64]
    lam: NDArray[np.float64]
    of_tet: NDArray[np.int32]
    laws: tuple[LawTets, ...] = ()


@dataclass(frozen=True, eq=False)
class StarPatches:
    """The patches of v stars, with slots as of `EdgePatches`.

    Attributes
    ----------
    start : (v + 1,); vertices : (s,); owner : (s,) the patch of each slot
    tet_start : (v + 1,) and tets : (m,) the tets of each patch
    slots : (m, 4) of the nodes of each tet in its patch
    volumes : (v,) [m^3]; kind : (v,); lam : (v,) factor l_a of the volume term [Pa]
    of_tet : (m,) the patch of each tet
    """

    start: NDArray[np.int32]
    vertices: NDArray[np.int32]
    owner: NDArray[np.int32]
    tet_start: NDArray[np.int32]
    tets: NDArray[np.int32]
    slots: NDArray[np.int32]
    volumes: NDArray[np.float64]
    kind: NDArray[np.int32]
    lam: NDArray[np.float64]
    of_tet: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Patches:
    """The patches of m tets.

    Attributes
    ----------
    rows : (m,) which of the system's tets these are
    tets : (m, 4); Dm_inv : (m, 3, 3) [1/m]; tet_volumes : (m,) [m^3]
    """

    rows: NDArray[np.int64]
    tets: NDArray[np.int32]
    Dm_inv: NDArray[np.float64]
    tet_volumes: NDArray[np.float64]
    edges: EdgePatches
    stars: StarPatches

    def pairs(self) -> Pairs:
        """The pairs of vertices that patches couple."""
        edges, stars = self.edges, self.stars
        return pairs_of((edges.start, edges.vertices), (stars.start, stars.vertices))


def patches_of(
    tets: NDArray[np.int32], Dm_inv: NDArray[np.float64], volumes: NDArray[np.float64], material: TetMaterial
) -> Patches | None:
    """The patches of the tets that have a region; None where there is none.

    Parameters
    ----------
    tets : (m, 4); Dm_inv : (m, 3, 3) [1/m]; volumes : (m,) [m^3]; material : of the m tets
    """
    rows = np.flatnonzero(material.region >= 0)
    if len(rows) == 0:
        return None
    tets, Dm_inv, volumes = np.ascontiguousarray(tets[rows]), np.ascontiguousarray(Dm_inv[rows]), volumes[rows]
    rest_mu, rest_lam = (values[rows] for values in rest_lame_parameters(material))
    kind, mu, lam, region = (getattr(material, key)[rows] for key in ("kind", "mu", "lam", "region"))
    rest = volume_share(rest_mu, rest_lam)
    by_law = kind == BY_LAW
    if by_law.any():
        # Their volume term is (J - 1)^2 / 2, too; with mu = lam = 0 that energy is zero for every F.
        kind = np.where(by_law, np.int32(_SQUARED), kind)
        mu, lam = np.where(by_law, 0.0, mu), np.where(by_law, rest, lam)
    edges = _edge_patches(tets, Dm_inv, volumes, region, (kind, mu, lam - rest))
    # Other bodies may have a law without patches, and without a bulk modulus that could be lowered.
    parts = [part for part in material.elastic_laws if np.isin(part.rows, rows).any()]
    edges = replace(edges, laws=tuple(_edge_law(part, rows, volumes, rest, edges.of_tet) for part in parts))
    stars = partition(tets, region, edges.of_tet)
    return Patches(rows, tets, Dm_inv, volumes, edges, _star_patches(tets, volumes, stars, kind, rest))


def _edge_law(part: LawTets, rows, volumes, rest, of_tet) -> LawTets:
    """The law of the edges around which the tets of `part` are: its parameters are their means, with a lowered K."""
    inside = np.isin(part.rows, rows)
    tets = np.searchsorted(rows, part.rows[inside])
    p = part.parameters[inside].copy()
    p[:, part.law.bulk] -= rest[tets]
    shares, patch = np.repeat(volumes[tets] / 6.0, 6), of_tet[tets].ravel()
    numbers, inverse = np.unique(patch, return_inverse=True)
    patch = inverse.astype(np.int32)
    return part.of(numbers, np.column_stack([_means(patch, shares, np.repeat(column, 6)) for column in p.T]))


def _numbered(keys: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """The first row with each key, and the number of each row's key among the sorted ones."""
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return first, number.reshape(-1).astype(np.int32)


def _slots(
    patch: NDArray[np.int32], nodes: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Start, vertices and owners of all slots, and the slot of each entry of `nodes` (r, 4) in its row's patch (r,)."""
    n = int(nodes.max()) + 1
    keys, slot = np.unique((patch[:, None].astype(np.int64) * n + nodes).ravel(), return_inverse=True)
    owner, vertices = np.divmod(keys, n)
    start = np.searchsorted(owner, np.arange(int(patch.max()) + 2))
    return start.astype(np.int32), vertices.astype(np.int32), owner.astype(np.int32), slot.astype(np.int32)


def _means(patch: NDArray[np.int32], weights: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.bincount(patch, weights=weights * values) / np.bincount(patch, weights=weights)


def _edge_patches(tets, Dm_inv, volumes, region, law) -> EdgePatches:
    m = len(tets)
    ends = np.sort(tets[:, _EDGES], axis=2).reshape(-1, 2)
    first, patch = _numbered(np.column_stack([ends, np.repeat(region, 6)]).astype(np.int64))
    shares = np.repeat(volumes / 6.0, 6)
    total = np.bincount(patch, weights=shares).astype(np.float64)
    start, vertices, owner, slot = _slots(patch, np.repeat(tets, 6, axis=0))
    of_nodes = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
    weighted = (shares[:, None, None] * np.repeat(of_nodes, 6, axis=0)).reshape(-1, 3)
    sums = np.stack([np.bincount(slot, weights=weighted[:, k]) for k in range(3)], axis=1)
    kind, mu, lam = law
    return EdgePatches(
        start,
        vertices,
        owner,
        sums / total[owner, None],
        total,
        np.repeat(kind, 6)[first],
        _means(patch, shares, np.repeat(mu, 6)),
        _means(patch, shares, np.repeat(lam, 6)),
        patch.reshape(m, 6),
    )


def volume_share(mu: NDArray[np.float64], lam: NDArray[np.float64]) -> NDArray[np.float64]:
    """l, the part of the first Lamé parameter that is averaged over stars [Pa], from both parameters at rest."""
    return np.maximum(lam - 2.0 * mu, 0.0)


def partition(tets: NDArray[np.int32], region: NDArray[np.int32], of_edge: NDArray[np.int32]) -> NDArray[np.int32]:
    """(m,) the star that each of the tets (m, 4) is in; none reaches into another region. `of_edge` : (m, 6)."""
    _, of_vertex = _numbered(np.column_stack([tets.ravel(), np.repeat(region, 4)]).astype(np.int64))
    return star_patches(of_vertex.reshape(-1, 4), of_edge)


def _star_patches(tets, volumes, of_tet, kind, rest) -> StarPatches:
    start, vertices, owner, slot = _slots(of_tet, tets)
    order = np.argsort(of_tet, kind="stable")
    tet_start = np.searchsorted(of_tet[order], np.arange(len(start)))
    return StarPatches(
        start,
        vertices,
        owner,
        tet_start.astype(np.int32),
        order.astype(np.int32),
        slot.reshape(-1, 4),
        np.bincount(of_tet, weights=volumes).astype(np.float64),
        kind[order[tet_start[:-1]]],
        _means(of_tet, volumes, rest),
        of_tet,
    )
