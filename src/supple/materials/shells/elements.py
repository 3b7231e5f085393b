"""The triangles and hinges of shells with their rest shapes, and the energy that they store.

A shell stores t A psi(E) in each triangle, and in bending

    max over m of  m . (theta - theta_0) - 1/2 m . W m  =  1/2 (theta - theta_0) . W^-1 (theta - theta_0),

theta the angles of the hinges. m_e is the moment per length times the length of edge e: moments are constant in each
triangle, and their normal components are continuous. A boundary edge carries none. A triangle whose corners one thing
holds does not bend: the edges beside it are clamped. W sums for each other triangle Q^-1, with the energy
1/2 phi . Q phi of a triangle whose edges turn by phi against its plane: its curvature is

    S = sum over edges of phi_e l_e/A n_e n_e^T,    energy A D/2 ((tr S)^2 - 2 (1 - nu) det S),

n_e the normal of an edge in the plane. This is the lowest order of the method of Hellan, Herrmann and Johnson: it
converges on every mesh, also where the three hinges of a triangle alone (Grinspun et al., "Discrete Shells", 2003)
depend on its direction. W does not change, so its factorization is made once.

Sources: Comodi, "The Hellan-Herrmann-Johnson method: some new error estimates and postprocessing" (1989); Neunteufel,
Schoeberl, "The Hellan-Herrmann-Johnson method for nonlinear shells" (2019), section 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from supple.materials.shells.hinges import angles_of, turns_of
from supple.materials.shells.membrane import (
    neo_hookean_energies,
    neo_hookean_stresses,
    st_venant_kirchhoff_tangents,
    strains,
)
from supple.materials.shells.shell_material import ShellMaterial

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class ShellElements:
    """All shells of a scene: t triangles and e hinges, vertices numbered as in the scene.

    Attributes
    ----------
    triangles : (t, 3); gradients : (t, 3, 2) of the corners' shape functions, in the triangle's plane at rest [1/m]
    areas, thickness : (t,) at rest [m^2], [m]; mu : (t,) [Pa], a : (t,) and neo_hookean : (t,), see `membrane`
    damping : (t,) and hinge_damping (e,) Kelvin-Voigt times [s]
    hinges : (e, 4), see `hinges`; rest_angles : (e,) [rad]; none of shells without bending stiffness
    hinge_of : (t, 3) the hinge at the edge from corner k to k + 1, -1 where there is none, or the triangle is held
    compliances : (t, 3, 3) Q^-1 of these edges [1/(N m)]
    """

    triangles: Ints
    gradients: Floats
    areas: Floats
    thickness: Floats
    mu: Floats
    a: Floats
    neo_hookean: NDArray[np.bool_]
    damping: Floats
    hinges: Ints
    rest_angles: Floats
    hinge_damping: Floats
    hinge_of: Ints
    compliances: Floats

    def renumbered(self, new: Ints) -> ShellElements:
        """The same elements with the vertices' numbers new (n,)."""
        return replace(self, triangles=new[self.triangles], hinges=new[self.hinges])

    def rows_of(self, vertices: slice) -> NDArray[np.bool_]:
        """(t,) the triangles of one shell, whose vertices these are."""
        return (self.triangles[:, 0] >= vertices.start) & (self.triangles[:, 0] < vertices.stop)

    def deformation_gradients(self, x: Floats) -> Floats:
        """(t, 3, 2) at positions x (n, 3)."""
        return np.einsum("tpi,tpa->tia", x[self.triangles], self.gradients)

    def area_ratios(self, x: Floats) -> Floats:
        """(t,) areas over those at rest [-]."""
        F = self.deformation_gradients(x)
        return np.linalg.norm(np.cross(F[:, :, 0], F[:, :, 1]), axis=1)

    def energy(self, x: Floats) -> float:
        """[J], zero at rest."""
        turned = angles_of(x, self.hinges) - self.rest_angles
        stretched = self.densities(strains(self.deformation_gradients(x)))
        return float((self.areas * self.thickness) @ stretched) + 0.5 * float(turned @ self.moments(turned))

    def densities(self, E: Floats) -> Floats:
        """(t,) energies of the membrane per volume at rest [J/m^3]."""
        out = 0.5 * np.einsum("ta,tab,tb->t", E, self.tangents, E)
        own = self.neo_hookean
        if own.any():
            out[own] = neo_hookean_energies(E[own], self.mu[own], self.a[own])
        return out

    def stresses(self, E: Floats) -> tuple[Floats, Floats]:
        """The stresses (t, 3) of the membrane and their tangents (t, 3, 3) [Pa]."""
        own = self.neo_hookean
        if own.all():
            return neo_hookean_stresses(E, self.mu, self.a)
        tangents = self.tangents.copy()
        S = np.einsum("tab,tb->ta", tangents, E)
        if own.any():
            S[own], tangents[own] = neo_hookean_stresses(E[own], self.mu[own], self.a[own])
        return S, tangents

    def moments(self, turned: Floats) -> Floats:
        """(e,) W^-1 times angles (e,) [N m]."""
        return self._factors.solve(turned) if len(turned) else turned

    @cached_property
    def tangents(self) -> Floats:
        """(t, 3, 3) of small strains [Pa]."""
        return st_venant_kirchhoff_tangents(self.mu, self.a)

    @cached_property
    def stiffness(self) -> Floats:
        """(t, 3) of each triangle at rest against a displacement of each corner in its plane, at most [N/m]."""
        moduli = 2.0 * self.mu * (1.0 + self.a) * self.areas * self.thickness
        return moduli[:, None] * np.einsum("tpi,tpi->tp", self.gradients, self.gradients)

    @cached_property
    def hinge_stiffness(self) -> Floats:
        """(e,) a diagonal D >= W^-1 [N m].

        1/D_e = sum gamma_T (W_T)_ee over triangles, gamma_T the smallest eigenvalue of W_T scaled to a unit diagonal.
        """
        has, diagonal = self.hinge_of >= 0, np.einsum("tkk->tk", self.compliances)
        scale = np.where(has, 1.0 / np.sqrt(np.where(has, diagonal, 1.0)), 0.0)
        scaled = self.compliances * scale[:, :, None] * scale[:, None, :]
        scaled += np.where(has, 0.0, 1.0)[:, :, None] * np.eye(3)
        shares = np.linalg.eigvalsh(scaled)[:, :1] * diagonal
        return 1.0 / np.bincount(self.hinge_of[has], shares[has], len(self.hinges))

    def stretching_ratios(self, w: Floats) -> Floats:
        """(t,) 2 mu (1 + a) V k of triangles, k the largest eigenvalue of sum w b b^T with the inverse masses w (n,)
        [1/s^2]."""
        b = self.gradients
        curvatures = np.linalg.eigvalsh(np.einsum("tp,tpi,tpj->tij", w[self.triangles], b, b))[:, 1]
        return 2.0 * self.mu * (1.0 + self.a) * self.thickness * self.areas * curvatures

    def ratios(self, x: Floats, w: Floats) -> Floats:
        """(e,) D sum w |grad theta|^2 at places x (n, 3), with the inverse masses w (e, 4) of hinges [1/s^2]."""
        turns = turns_of(x, self.hinges)
        return self.hinge_stiffness * (w * np.einsum("ekj,ekj->ek", turns, turns)).sum(axis=1)

    @cached_property
    def laws(self) -> Floats:
        """(t, 4) volume [m^3], mu [Pa], a, and 1 where neo-Hookean."""
        return np.column_stack([self.areas * self.thickness, self.mu, self.a, self.neo_hookean.astype(np.float64)])

    @cached_property
    def bounds(self) -> Floats:
        """(t, 3, 3) P of the hinges of each triangle, zero for those that it lacks: sum P >= W^-1 [N m].

        With W the sum of W_T over triangles, and c_T shares of them at each hinge whose sum is one, W^-1 <= sum
        c_T W_T^-1 c_T.
        """
        missing = self.hinge_of < 0
        both = missing[:, :, None] | missing[:, None, :]
        kept = np.where(both, np.where(np.eye(3, dtype=bool), 1.0, 0.0), self.compliances)
        counts = np.bincount(self.hinge_of[~missing], minlength=1)
        shares = 1.0 / np.maximum(counts, 1)[np.maximum(self.hinge_of, 0)]
        return np.where(both, 0.0, shares[:, :, None] * np.linalg.inv(kept) * shares[:, None, :])

    @cached_property
    def stencils(self) -> tuple[Ints, Ints]:
        """Nodes (t, 6) of the hinges of each triangle, -1 for those that it lacks, and (t, 3, 4) the places of each
        hinge's nodes among them."""
        nodes = np.full((len(self.triangles), 6), -1, dtype=np.int32)
        nodes[:, :3] = self.triangles
        places = np.zeros((len(self.triangles), 3, 4), dtype=np.int32)
        for k in range(3):
            hinge, corners = self.hinge_of[:, k], (k, (k + 1) % 3, (k + 2) % 3)
            ends = self.hinges[np.maximum(hinge, 0)] if len(self.hinges) else np.zeros((len(hinge), 4), dtype=np.int32)
            first = ends[:, 2] == self.triangles[:, corners[2]]
            first &= ends[:, 0] == self.triangles[:, corners[0]]
            # In the other triangle the edge runs backwards.
            own, other = (corners[0], corners[1], corners[2], 3 + k), (corners[1], corners[0], 3 + k, corners[2])
            places[:, k] = np.where(first[:, None], own, other)
            nodes[:, 3 + k] = np.where(hinge < 0, -1, np.where(first, ends[:, 3], ends[:, 2]))
        return nodes, places

    @cached_property
    def pairs(self) -> tuple[Ints, Ints, NDArray[np.int64]]:
        """The two vertices (21 t,) of every pair of nodes of each triangle, twice a corner where one is missing, and
        the pairs of two nodes that are the same vertex."""
        nodes, (p, q) = self.stencils[0], np.triu_indices(6)
        rows, columns = nodes[:, p], nodes[:, q]
        missing = (rows < 0) | (columns < 0)
        twice = np.flatnonzero(((rows == columns) & ~missing & (p != q)).ravel())
        corner = np.broadcast_to(nodes[:, :1], rows.shape)
        return np.where(missing, corner, rows).ravel(), np.where(missing, corner, columns).ravel(), twice

    @cached_property
    def owned(self) -> NDArray[np.bool_]:
        """(t, 3) whether a triangle is the first one of its hinge."""
        hinges, first = np.unique(self.hinge_of, return_index=True)
        out = np.zeros(self.hinge_of.size, dtype=bool)
        out[first[hinges >= 0]] = True
        return out.reshape(self.hinge_of.shape)

    @cached_property
    def _factors(self) -> Any:
        from scipy.sparse.linalg import splu

        rows, columns = np.broadcast_arrays(self.hinge_of[:, :, None], self.hinge_of[:, None, :])
        kept = (rows >= 0) & (columns >= 0)
        shape = len(self.hinges), len(self.hinges)
        W = csc_array((self.compliances[kept], (rows[kept], columns[kept])), shape=shape)
        options = {"SymmetricMode": True}
        return splu(W, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def elements_of(parts: Sequence[tuple[Floats, Ints, int, ShellMaterial]], holders: NDArray[np.int64]) -> ShellElements:
    """Of shells, each with its vertices at rest (n, 3), triangles (t, 3), number of its first vertex, and material.

    holders : of every vertex of the scene, the number of what holds it, -1 for nothing
    """
    made, hinges = [], 0
    for vertices, triangles, first, material in parts:
        holder = holders[triangles + first]
        held = (holder[:, 0] >= 0) & (holder == holder[:, :1]).all(axis=1)
        made.append(_elements(vertices, triangles, first, hinges, material, held))
        hinges += len(made[-1]["hinges"])
    return ShellElements(**{key: np.ascontiguousarray(np.concatenate([one[key] for one in made])) for key in made[0]})


def _elements(
    x: Floats, triangles: Ints, first: int, begin: int, material: ShellMaterial, held: NDArray[np.bool_]
) -> dict[str, NDArray[Any]]:
    a, b, c = x[triangles].transpose(1, 0, 2)
    count, u, v = len(triangles), b - a, c - a
    length = np.linalg.norm(u, axis=1)
    doubled = np.linalg.norm(np.cross(u, v), axis=1)
    corners = np.zeros((count, 3, 2))  # in the triangle's plane, the first edge along its first axis
    corners[:, 1, 0] = length
    corners[:, 2, 0], corners[:, 2, 1] = np.einsum("ti,ti->t", u, v) / length, doubled / length
    sides = np.roll(corners, -1, axis=1) - corners
    turned = np.stack([sides[:, :, 1], -sides[:, :, 0]], axis=2)  # outward normals times the lengths of the edges
    gradients = -turned[:, [1, 2, 0]] / doubled[:, None, None]
    lengths = np.linalg.norm(turned, axis=2)
    n = turned / lengths[:, :, None]
    scaled = 2.0 * lengths / doubled[:, None]
    B = np.stack([n[:, :, 0] ** 2, n[:, :, 1] ** 2, n[:, :, 0] * n[:, :, 1]], axis=1) * scaled[:, None, :]
    hinges, hinge_of, compliances = np.zeros((0, 4), dtype=np.int32), np.full((count, 3), -1), np.zeros((count, 3, 3))
    D, nu = material.bending_stiffness, material.poisson
    if D > 0.0:
        hinges, hinge_of = _hinges(triangles, len(x))
        hinge_of[held] = -1
        used = np.zeros(len(hinges), dtype=bool)
        used[hinge_of[hinge_of >= 0]] = True
        hinge_of = np.append(np.cumsum(used) - 1, -1)[hinge_of]
        hinges = hinges[used]
        C = D * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 2.0 * (1.0 - nu)]])
        inverse = np.linalg.inv(B)
        compliances = inverse @ np.linalg.inv(C) @ np.swapaxes(inverse, 1, 2) * (2.0 / doubled)[:, None, None]
    return {
        "triangles": (triangles + first).astype(np.int32),
        "gradients": gradients,
        "areas": 0.5 * doubled,
        "thickness": np.full(count, material.thickness),
        "mu": np.full(count, material.mu),
        "a": np.full(count, nu / (1.0 - nu)),
        "neo_hookean": np.full(count, material.membrane == "neo_hookean"),
        "damping": np.full(count, material.damping),
        "hinges": (hinges + first).astype(np.int32),
        "rest_angles": angles_of(x, hinges),
        "hinge_damping": np.full(len(hinges), material.damping),
        "hinge_of": np.where(hinge_of < 0, -1, hinge_of + begin).astype(np.int32),
        "compliances": compliances,
    }


def _hinges(triangles: Ints, vertices: int) -> tuple[Ints, NDArray[np.int64]]:
    """The hinges (e, 4) of a surface that has at most two triangles at an edge, which run along it in opposite
    directions, and (t, 3) those of each triangle."""
    start, end, wing = triangles, np.roll(triangles, -1, axis=1), np.roll(triangles, -2, axis=1)
    keys = (np.minimum(start, end).astype(np.int64) * vertices + np.maximum(start, end)).ravel()
    order = np.argsort(keys, kind="stable")
    pairs = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    one, other = order[pairs], order[pairs + 1]
    hinge_of = np.full(triangles.size, -1)
    hinge_of[one] = hinge_of[other] = np.arange(len(pairs))
    corners = [values.ravel()[rows] for values, rows in ((start, one), (end, one), (wing, one), (wing, other))]
    return np.column_stack(corners).astype(np.int32), hinge_of.reshape(triangles.shape)
