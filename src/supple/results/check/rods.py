"""The energy that a rod stores, from its recorded material: the check's own sum.

Every edge has a frame of its direction and of that to its first material point. Two edges at a point turn against each
other by a rotation about an axis, from which the one at rest is taken away in halves before and after; with its angle a
along that axis the energy is half of the stiffness over the length times (2 tan(a/2))^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from supple.scene.rod import Rod

Floats = NDArray[np.float64]
_OVER = Rotation.from_rotvec([np.pi, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class StoredByRod:
    """A rod; held : (e,) which of its edges one thing holds at both ends."""

    rod: Rod
    held: NDArray[np.bool_]

    def energy(self, x: Floats) -> float:
        """[J] at positions (n, 3) of its vertices."""
        m = self.rod.material
        ends, out, middle = self._parts(x)
        length = np.linalg.norm(ends, axis=1)
        rest = np.linalg.norm(self._parts(self.rod.points)[0], axis=1)
        along = np.einsum("ei,ei->e", out, ends) / length
        wider = (np.einsum("ei,ei->e", out, out) - m.radius**2) / (2.0 * m.radius)
        squares = (length - rest) ** 2 + np.einsum("ei,ei->e", middle, middle) + along**2 + wider**2
        stored = 0.5 * m.youngs * m.area * float((squares / rest).sum())
        first, second, reversed_, shares = self._joints
        if not len(first):
            return stored
        between = 0.5 * (np.where(self.held, 0.0, rest)[first] + np.where(self.held, 0.0, rest)[second])
        at_rest = self._turns(self.rod.points, first, second, reversed_)
        if self.rod.rest == "straight":
            at_rest = Rotation.identity(len(first))
        twisted = Rotation.from_rotvec(np.outer(between * self.rod.twist, [0.0, 0.0, 1.0]))
        half = Rotation.from_rotvec(0.5 * (at_rest * twisted).as_rotvec()).inv()
        angles = (half * self._turns(x, first, second, reversed_) * half).as_rotvec()
        sizes = np.linalg.norm(angles, axis=1)
        strains = angles * (2.0 * np.tan(0.5 * sizes) / np.where(sizes > 0.0, sizes, 1.0))[:, None]
        stiffness = np.array([m.bending_stiffness, m.bending_stiffness, m.twisting_stiffness])
        free = between > 0.0
        return stored + 0.5 * float(((strains[free] ** 2 @ stiffness) * shares[free] / between[free]).sum())

    def least_ratio(self, x: Floats) -> float:
        """The smallest length of an edge over that at rest [-]."""
        now, rest = (np.linalg.norm(self._parts(points)[0], axis=1) for points in (x, self.rod.points))
        return float((now / rest).min())

    @property
    def scale(self) -> float:
        """Its modulus times its volume [J]."""
        return self.rod.material.youngs * self.rod.material.area * float(self.rod.lengths.sum())

    def _parts(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """(e, 3) the edges, half of the way between their material points, and from their middle to that of these."""
        a, b = x[self.rod.mesh.line[:, 0]], x[self.rod.mesh.line[:, 1]]
        c, d = x[self.rod.mesh.material_points[:, 0]], x[self.rod.mesh.material_points[:, 1]]
        return b - a, 0.5 * (c - d), 0.5 * (c + d) - 0.5 * (a + b)

    @cached_property
    def _joints(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_], Floats]:
        """(j,) the two edges of each, (j, 2) which of them run against it, and the share of each."""
        line, rows = self.rod.mesh.line, []
        for point in range(int(line.max()) + 1):
            around = np.flatnonzero((line == point).any(axis=1)).tolist()
            rows += [
                (p, q, line[p, 0] == point, line[q, 1] == point, 2.0 / len(around)) for p, q in combinations(around, 2)
            ]
        found = np.array(rows, dtype=np.float64).reshape(-1, 5)
        return found[:, 0].astype(int), found[:, 1].astype(int), found[:, 2:4].astype(bool), found[:, 4]

    def _turns(
        self, x: Floats, first: NDArray[np.int64], second: NDArray[np.int64], reversed_: NDArray[np.bool_]
    ) -> Rotation:
        """The rotation from the frame of each first edge to that of the second, both along the joint."""
        ends, out, _ = self._parts(x)
        frames = [
            Rotation.align_vectors(np.eye(3)[[2, 0]], both, weights=[np.inf, 1.0])[0].inv()
            for both in np.stack([ends, out], axis=1)
        ]
        none = Rotation.identity()
        one, other = (
            Rotation.concatenate([frames[k] * (_OVER if over else none) for k, over in zip(rows, side, strict=True)])
            for rows, side in ((first, reversed_[:, 0]), (second, reversed_[:, 1]))
        )
        return one.inv() * other
