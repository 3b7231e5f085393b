"""The elastic laws of all tets of a scene, or of a recording, in one place: what stresses and energies follow from."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from supple.materials.elastic_tets.active import ActiveTets, Growth
from supple.materials.elastic_tets.edge_springs import EdgeSprings
from supple.materials.elastic_tets.mean_volume import MeanVolumes, mean_volumes
from supple.materials.elastic_tets.quadratic import QUADRATURE_POINTS, QuadraticTets
from supple.materials.laws.internal import checked, rows_of_points
from supple.materials.material import Material
from supple.materials.per_tet import NOT_ELASTIC, LawTets, TetMaterial


@dataclass(frozen=True, eq=False)
class TetLaws:
    """The elastic laws of m tets.

    Attributes
    ----------
    tets : (m, 4); Dm_inv : (m, 3, 3) Dm^-1 [1/m]; volumes : (m,) at rest [m^3]
    material : of the tets; its kind is `NOT_ELASTIC` where a tet is of none of the elastic materials
    springs : of the tets of bodies that are made of edges and volumes
    quadratic : those of the tets that are quadratic; `tets` and `Dm_inv` are then those of the corners
    active : growths and muscles, as they are at one time
    """

    tets: NDArray[np.int32]
    Dm_inv: NDArray[np.float64]
    volumes: NDArray[np.float64]
    material: TetMaterial
    springs: tuple[EdgeSprings, ...] = ()
    quadratic: QuadraticTets | None = None
    active: tuple[ActiveTets, ...] = ()

    @cached_property
    def growth(self) -> Growth | None:
        """What the growths have made of the tets; None without growth."""
        return Growth.of(self.active, len(self.tets))

    @cached_property
    def stress_free(self) -> TetLaws:
        """The same laws of the stress-free shapes of what has grown, without muscles."""
        if self.growth is None:
            return replace(self, active=()) if self.active else self
        Dm_inv, volumes = self.growth.shapes(self.Dm_inv, self.volumes)
        curved = self.growth.quadratic(self.quadratic)
        return replace(self, Dm_inv=Dm_inv, volumes=volumes, quadratic=curved, active=())

    @cached_property
    def at_points(self) -> tuple[MeanVolumes | None, TetMaterial]:
        """Of the quadratic tets: the terms of their mean volumes, and the material of each quadrature point."""
        tets = self.quadratic
        assert tets is not None
        means, material = mean_volumes(self.material, tets.rows, tets.quadrature.volumes)
        return means, of_points(material, tets.rows, QUADRATURE_POINTS)

    def internal_at_points(self, internal: NDArray[np.float64]) -> NDArray[np.float64]:
        """The internal variables at the quadrature points, from those of the scene."""
        return checked(self.material, internal)[rows_of_points(self.material)]

    def means(self, part: LawTets, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k,) means over each of the k tets of a law, from values (k s,) at its s points in each."""
        if self.quadratic is None or part.points == 1:
            return values
        volumes = self.quadratic.quadrature.volumes[np.searchsorted(self.quadratic.rows, part.rows)]
        return (volumes * values.reshape(volumes.shape)).sum(axis=1) / volumes.sum(axis=1)

    def vertex_means(self, values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
        """(count, ...) means of values (m, ...) over the tets around each vertex, weighted with their rest volumes.

        NaN for a vertex without a tet.
        """
        vertices, weights = self._around
        means = np.full((count, values[0].size if len(values) else 0), np.nan)
        means[vertices] = weights @ values.reshape(len(values), -1)
        return means.reshape(count, *values.shape[1:])

    @cached_property
    def _around(self) -> tuple[NDArray[np.int32], csr_array]:
        """The vertices (k,) that have tets, and the share of each tet in the mean at each of them (k, m)."""
        vertices, tets = self.tets.ravel(), np.repeat(np.arange(len(self.tets)), 4)
        if self.quadratic is not None:
            linear = np.ones(len(self.tets), dtype=bool)
            linear[self.quadratic.rows] = False
            vertices = np.concatenate([self.tets[linear].ravel(), self.quadratic.nodes.ravel()])
            tets = np.concatenate([np.repeat(np.flatnonzero(linear), 4), np.repeat(self.quadratic.rows, 10)])
        used, row = np.unique(vertices, return_inverse=True)
        shares = self.volumes[tets] / np.bincount(row, self.volumes[tets])[row]
        return used, csr_array((shares, (row, tets)), shape=(len(used), len(self.tets)))

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """(m,) whether a tet has a law."""
        known = self.material.kind != NOT_ELASTIC
        for springs in self.springs:
            known[springs.rows] = True
        return known

    @cached_property
    def stressed(self) -> NDArray[np.bool_]:
        """(m,) whether the stress of a tet follows from positions: not where something in it is rigid."""
        stressed = self.known.copy()
        for springs in self.springs:
            stressed[springs.rows] = not springs.is_rigid
        return stressed


def tet_material(material: Material, count: int, order: int) -> TetMaterial:
    """The material of a body's `count` tets of this order."""
    rows = material.per_tet(count)
    if order == 1:
        return rows
    return replace(rows, laws=tuple(replace(part, points=QUADRATURE_POINTS) for part in rows.laws))


def joined_materials(parts: list[TetMaterial]) -> TetMaterial:
    """The materials of several bodies as one, in their order."""
    names = ("density", "damping", "kind", "mu", "lam")
    joined = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    laws, begin = [], 0
    for part in parts:
        laws += [tets.shifted(begin) for tets in part.laws]
        begin += len(part.kind)
    return replace(parts[0], **joined, laws=tuple(laws))


def of_points(material: TetMaterial, rows: NDArray[np.int64], points: int) -> TetMaterial:
    """The material of each of `points` points in each of the tets `rows` (k,), tet after tet."""
    owners = np.repeat(rows, points)
    place = np.full(len(material.kind), -1, dtype=np.int64)
    place[rows] = np.arange(len(rows))
    values = {field.name: getattr(material, field.name) for field in fields(material)}
    taken = {name: np.ascontiguousarray(of[owners]) for name, of in values.items() if isinstance(of, np.ndarray)}
    laws = []
    for part in material.laws:
        own = place[part.rows] >= 0
        numbers = place[part.rows[own], None] * points + np.arange(points)
        parameters = np.repeat(part.parameters[own], points, axis=0)
        laws.append(replace(part.of(numbers.ravel(), parameters), points=1))
    return replace(material, **taken, laws=tuple(laws))
