"""The edges and joints of rods with their rest shapes, and the energy that they store.

An edge of length l at rest stores E A l/2 (|e|/l - 1)^2. Two edges that meet bend and twist against each other as
their frames turn: with F_1 and F_2, each turned to the middle of both at rest, R = F_1^T F_2 has the axis n and the
angle a, and the strain is k = 2 tan(a/2) n, which is

    k = 2 s/q,    s = (R_32 - R_23, R_13 - R_31, R_21 - R_12),    q = 1 + tr R.

Its components are two of bending and one of twist. The energy is 1/(2 l) (B k_1^2 + B k_2^2 + C k_3^2), l half of the
length of those edges that are not clamped. It goes to infinity where two edges fold back, and does not depend on the
way that led there.

The frame of an edge follows from its ends and from two material points beside its middle, on the rod's surface at rest
(see `RodMesh`), which an energy of the cross section keeps there:

    E A/(2 l) (|m|^2 + (u . t)^2 + ((u . u - r^2)/(2 r))^2),

m from the edge's middle to theirs, u half of the way between them, t along the edge.

Sources: Bergou et al., "Discrete Elastic Rods" (2008), section 4.2, for the strain of bending; the twist of two edges
is taken alike. Umetani, Schmidt, Stam, "Position-based elastic rods" (2014), for points that carry frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from supple.materials.rods.frames import frames

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

# s and q - 1 as sums of R_ij = a_i . b_j, of the vectors a_i and b_j of two frames.
FORMS = np.zeros((4, 3, 3))
for _k, (_i, _j) in enumerate([(2, 1), (0, 2), (1, 0)]):
    FORMS[_k, _i, _j], FORMS[_k, _j, _i] = 1.0, -1.0
FORMS[3] = np.eye(3)

# e, u and m of an edge as sums of its four nodes, see `RodElements.ways`; e and u of two edges, of their eight nodes.
SHARES = np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.5, -0.5], [-0.5, -0.5, 0.5, 0.5]])
PAIRED = np.kron(np.eye(2), SHARES[:2])


@dataclass(frozen=True, eq=False)
class RodElements:
    """All rods of a scene: e edges and j joints of two edges, vertices numbered as in the scene.

    Attributes
    ----------
    nodes : (e, 4) the two ends of each edge and its two material points
    lengths : (e,) at rest [m]; stretching : (e,) E A [N]; radius : (e,) [m]
    joints : (j, 2) edges; turns : (j, 2, 3, 3) what turns the frame of each to the middle of both at rest
    stiffness : (j, 3) of both bendings and of twist, over the length of the joint [N m]
    damping : (e,), joint_damping : (j,) Kelvin-Voigt times [s]
    """

    nodes: Ints
    lengths: Floats
    stretching: Floats
    radius: Floats
    joints: Ints
    turns: Floats
    stiffness: Floats
    damping: Floats
    joint_damping: Floats

    def renumbered(self, new: Ints) -> RodElements:
        """The same elements with the vertices' numbers new (n,)."""
        return replace(self, nodes=new[self.nodes])

    @cached_property
    def joint_nodes(self) -> tuple[Ints, Floats]:
        """(j, 7) the far end of the first edge, the common point, the far end of the second one, and the material
        points of both; and (j, 2) 1 where the first edge ends there, and the second one begins there, otherwise -1."""
        first, second = self.nodes[self.joints[:, 0]], self.nodes[self.joints[:, 1]]
        ends, begins = (
            (first[:, 1, None] == second[:, :2]).any(axis=1),
            (second[:, 0, None] == first[:, :2]).any(axis=1),
        )
        common, far = np.where(ends, first[:, 1], first[:, 0]), np.where(ends, first[:, 0], first[:, 1])
        other = np.where(begins, second[:, 1], second[:, 0])
        nodes = np.column_stack([far, common, other, first[:, 2:], second[:, 2:]]).astype(np.int32)
        return nodes, np.where(np.column_stack([ends, begins]), 1.0, -1.0)

    def ways(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """(e, 3) e, u and m of every edge at positions x (n, 3); see the module."""
        a, b, c, d = x[self.nodes].transpose(1, 0, 2)
        return b - a, 0.5 * (c - d), 0.5 * (c + d - a - b)

    def stretches(self, x: Floats) -> Floats:
        """(e,) |e|/l - 1."""
        return np.linalg.norm(self.ways(x)[0], axis=1) / self.lengths - 1.0

    def bends(self, x: Floats) -> Floats:
        """(j, 3) the strains k of the joints."""
        e, u, _ = self.ways(x)
        a, b = self.turned(frames(e, u))
        return bends_of(forms_of(a, b))

    def bend_slopes(self, x: Floats) -> tuple[Floats, Floats]:
        """(j, 3) the strains of the joints, and (j, 3, 4, 3) their derivatives by e and u of the first edge, then of
        the second one."""
        e, u, _ = self.ways(x)
        F, length = frames(e, u), np.linalg.norm(e, axis=1)
        t, across = F[:, :, 2], F[:, :, 1]
        along = np.einsum("ei,ei->e", u, t)
        width = np.linalg.norm(u - along[:, None] * t, axis=1)
        a, b = self.turned(F)
        bends = bends_of(forms_of(a, b))
        # A turn f of the second frame against the first one changes the strains by z . f.
        half = 0.5 * bends
        rows = np.eye(3) + half[:, :, None] * half[:, None, :]
        for k, (i, j) in enumerate([(1, 2), (2, 0), (0, 1)]):
            rows[:, k, i] += half[:, j]
            rows[:, k, j] -= half[:, i]
        z = rows @ a
        out = np.empty((len(z), 3, 4, 3))
        for side, sign in ((0, -1.0), (1, 1.0)):
            edge = self.joints[:, side]
            turn = np.einsum("cki,ci->ck", z, t[edge]) / width[edge, None]
            of_e = np.cross(z, t[edge][:, None]) - (turn * along[edge, None])[:, :, None] * across[edge][:, None]
            out[:, :, 2 * side] = sign * of_e / length[edge, None, None]
            out[:, :, 2 * side + 1] = sign * turn[:, :, None] * across[edge][:, None]
        return bends, out

    def add_gradient(self, x: Floats, tensions: Floats, section: Floats, moments: Floats, out: Floats) -> None:
        """Add to `out` (n, 3) the gradient of the energies whose derivatives by the length of edges are tensions (e,)
        [N] and by the strains of joints moments (j, 3) [N m], and of cross sections with a stiffness (e,) [N/m]."""
        e, _, m = self.ways(x)
        t = e / np.linalg.norm(e, axis=1)[:, None]
        slopes = section[:, None, None] * np.einsum("ek,ekvi->evi", *self.section_slopes(x))
        slopes[:, 0] += tensions[:, None] * t
        slopes = np.concatenate([slopes, (section[:, None] * m)[:, None]], axis=1)
        scatter(out, self.nodes, np.einsum("vp,evi->epi", SHARES, slopes))
        if len(self.joints):
            of_ways = np.einsum("ck,ckvi->cvi", moments, self.bend_slopes(x)[1])
            scatter(out, self.nodes[self.joints].reshape(-1, 8), on_nodes(of_ways))

    def add_elastic_gradient(self, x: Floats, out: Floats) -> None:
        """Add the gradient (n, 3) of the energy to `out` [N]."""
        self.add_gradient(x, self.stretching * self.stretches(x), self.section, self.stiffness * self.bends(x), out)

    def section_slopes(self, x: Floats) -> tuple[Floats, Floats]:
        """(e, 2) u . t and (u . u - r^2)/(2 r), and (e, 2, 2, 3) their derivatives by e and u."""
        e, u, _ = self.ways(x)
        length = np.linalg.norm(e, axis=1)
        t = e / length[:, None]
        along, grown = np.einsum("ei,ei->e", u, t), (np.einsum("ei,ei->e", u, u) - self.radius**2) / (2.0 * self.radius)
        slopes = np.zeros((len(e), 2, 2, 3))
        slopes[:, 0, 0], slopes[:, 0, 1] = (u - along[:, None] * t) / length[:, None], t
        slopes[:, 1, 1] = u / self.radius[:, None]
        return np.stack([along, grown], axis=1), slopes

    def ratios(self, w: Floats, x: Floats) -> Floats:
        """(j, 3) K sum w |grad k|^2 of the strains at places x (n, 3), with inverse masses w (n,) [1/s^2]."""
        slopes = np.einsum("ckvi,vp->ckpi", self.bend_slopes(x)[1], PAIRED)
        nodes, at = self.joint_nodes[0][:, 1], self.nodes[self.joints].reshape(-1, 8)
        # What both edges do to their common point adds up.
        common = at == nodes[:, None]
        both = np.einsum("cp,ckpi->cki", common, slopes)
        squares = np.einsum("cp,ckpi,ckpi->ck", np.where(common, 0.0, w[at]), slopes, slopes)
        squares += w[nodes, None] * np.einsum("cki,cki->ck", both, both)
        return self.stiffness * squares

    def turned(self, of_edges: Floats) -> list[Floats]:
        """(j, 3, 3, ...) the vectors, by rows, of both frames at every joint turned to their middle, or their
        derivatives."""
        rows = np.swapaxes(of_edges, 1, 2)
        return [np.einsum("ck...,cki->ci...", rows[self.joints[:, k]], self.turns[:, k]) for k in (0, 1)]

    def rows_of(self, vertices: slice) -> NDArray[np.bool_]:
        """(e,) the edges of one rod, whose vertices these are."""
        return (self.nodes[:, 0] >= vertices.start) & (self.nodes[:, 0] < vertices.stop)

    def energy(self, x: Floats) -> float:
        """[J], zero at rest."""
        return float(self.edge_energies(x, self.stretches(x)).sum() + self.joint_energies(self.bends(x)).sum())

    def edge_energies(self, x: Floats, stretches: Floats) -> Floats:
        """(e,) of stretches, and of the cross sections [J]."""
        return 0.5 * self.stretching * self.lengths * stretches**2 + 0.5 * self.section * self.shears(x)

    def joint_energies(self, bends: Floats) -> Floats:
        """(j,) [J]"""
        return 0.5 * np.einsum("ck,ck->c", self.stiffness, bends**2)

    @property
    def section(self) -> Floats:
        """(e,) the stiffness of cross sections [N/m]."""
        return self.stretching / self.lengths

    def shears(self, x: Floats) -> Floats:
        """(e,) the squares of what the cross sections are deformed by [m^2]."""
        e, u, m = self.ways(x)
        along = np.einsum("ei,ei->e", u, e) / np.linalg.norm(e, axis=1)
        grown = (np.einsum("ei,ei->e", u, u) - self.radius**2) / (2.0 * self.radius)
        return np.einsum("ei,ei->e", m, m) + along**2 + grown**2


def forms_of(a: Floats, b: Floats) -> Floats:
    """(j, 4) s and q of two frames, their vectors by rows (j, 3, 3)."""
    forms = np.einsum("fij,cik,cjk->cf", FORMS, a, b, optimize=True)
    forms[:, 3] += 1.0
    return forms


def on_nodes(of_ways: Floats) -> Floats:
    """(j, 8, k) for the nodes of two edges, of values (j, 4, k) for e and u of both."""
    return np.einsum("vp,cvk->cpk", PAIRED, of_ways)


def scatter(out: Floats, nodes: Ints, values: Floats) -> None:
    """Add values (k, p, 3) of nodes (k, p) to `out` (n, 3)."""
    for i in range(3):
        out[:, i] += np.bincount(nodes.ravel(), values[:, :, i].ravel(), len(out))


def bends_of(forms: Floats) -> Floats:
    """(j, 3) 2 s/q of (j, 4) s and q; infinite where the edges fold back."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(forms[:, 3:] > 0.0, 2.0 * forms[:, :3] / forms[:, 3:], np.inf)


def joined_rods(parts: Sequence[tuple[RodElements, int]]) -> RodElements:
    """Of rods, each with the number of its first vertex."""
    edges, made = 0, []
    for elements, first in parts:
        made.append({one.name: getattr(elements, one.name) for one in fields(elements)})
        made[-1] |= {"nodes": elements.nodes + np.int32(first), "joints": elements.joints + np.int32(edges)}
        edges += len(elements.nodes)
    return RodElements(**{key: np.ascontiguousarray(np.concatenate([one[key] for one in made])) for key in made[0]})


def elements_of_rod(
    x: Floats,
    nodes: Ints,
    stiffness: tuple[float, float, float],
    radius: float,
    damping: float,
    straight: bool,
    twist: float,
    held: NDArray[np.bool_],
) -> RodElements:
    """Of one rod.

    Parameters
    ----------
    x : (n, 3) its vertices at rest [m]; nodes : (e, 4), see `RodElements`
    stiffness : E A [N], B and C [N m^2]; straight : whether it is straight without stress; twist : then [rad/m]
    held : (e,) which edges one thing holds at both ends: these are clamped, and do not bend

    Raises
    ------
    ValueError : naming two edges that lie on each other.
    """
    stretching, B, C = stiffness
    e, count = x[nodes[:, 1]] - x[nodes[:, 0]], len(nodes)
    lengths = np.linalg.norm(e, axis=1)
    F = frames(e, 0.5 * (x[nodes[:, 2]] - x[nodes[:, 3]]))
    joints, at, shares = _joints(nodes[:, :2])
    # Along a joint, the first edge comes and the second one goes; one that runs the other way is turned about d_1.
    reverse = np.diag([1.0, -1.0, -1.0])
    against = np.column_stack([nodes[joints[:, 0], 0] == at, nodes[joints[:, 1], 1] == at])
    turns = np.where(against[:, :, None, None], reverse, np.eye(3))
    first, second = (F[joints[:, side]] @ turns[:, side] for side in (0, 1))
    between = 0.5 * np.where(held, 0.0, lengths)[joints].sum(axis=1)
    R = np.swapaxes(first, 1, 2) @ second
    folded = 1.0 + np.trace(R, axis1=1, axis2=2) < 1e-6
    if folded.any():
        one, other = joints[np.flatnonzero(folded)[0]]
        raise ValueError(f"edges {one} and {other} lie on each other")
    of_rest = Rotation.identity(len(joints)) if straight else Rotation.from_matrix(R)
    of_rest = of_rest * Rotation.from_rotvec(twist * between[:, None] * np.array([0.0, 0.0, 1.0]))
    half = Rotation.from_rotvec(0.5 * of_rest.as_rotvec()).as_matrix()
    turns = np.stack([turns[:, 0] @ half, turns[:, 1] @ np.swapaxes(half, 1, 2)], axis=1)
    return RodElements(
        nodes=nodes,
        lengths=lengths,
        stretching=np.full(count, stretching),
        radius=np.full(count, radius),
        joints=joints,
        turns=turns,
        stiffness=np.where(between > 0.0, shares / np.maximum(between, 1e-300), 0.0)[:, None] * np.array([B, B, C]),
        damping=np.full(count, damping),
        joint_damping=np.full(len(joints), damping),
    )


def _joints(line: Ints) -> tuple[Ints, Ints, Floats]:
    """All pairs (j, 2) of edges (e, 2) with a common point, that point (j,), and the share (j,) of each: 2/k where k
    edges meet, so that they turn as if their ends were welded."""
    order = np.argsort(line.ravel(), kind="stable")
    points, starts = np.unique(line.ravel()[order], return_index=True)
    around = np.split(order // 2, starts[1:])
    found = [
        (one, other, point, 2.0 / len(edges))
        for point, edges in zip(points.tolist(), around, strict=True)
        for k, one in enumerate(edges.tolist())
        for other in edges[k + 1 :].tolist()
    ]
    pairs = np.array([row[:3] for row in found], dtype=np.int32).reshape(-1, 3)
    return np.ascontiguousarray(pairs[:, :2]), pairs[:, 2], np.array([row[3] for row in found], dtype=np.float64)
