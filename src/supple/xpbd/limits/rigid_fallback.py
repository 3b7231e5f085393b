"""The last resort of the volume guard: a component keeps only so much of its deformation as leaves every tet positive.

Where the projections of a substep did not succeed, the motion of a component is shortened towards a rigid one:
x(a) = y + a (x - y), with y the places x_n of the beginning, moved as a rigid body with the momentum of the substep. At
a = 0 all tets have their volumes of the beginning, so that an a above 0 exists; the largest one is the root of a cubic
for each tet. The kinetic energy falls: in the metric of the masses, the rigid motion is the projection of the motion.

A component with pinned vertices moves with its pins: y has the pins at their new places, and the other vertices where
they were. Where pins alone turn a tet over, nothing helps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.numerics.noninverting_step import noninverting_step, volume_signs
from supple.system import System
from supple.xpbd.limits.volume_guard import FLATTEST

# The share of its volume that a tet keeps at least, and one that is nearly flat.
KEEP, KEEP_FLAT = 0.1, 1.0 - 1e-6


class RigidFallback:
    """The components of a system and their tets."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.labels = system.joined_components
        self.tet_labels = self.labels[system.tets[:, 0]]
        self.pinned = system.inverse_masses == 0.0

    def apply(
        self,
        points: NDArray[np.float64],
        previous: NDArray[np.float64],
        begun: NDArray[np.float64],
        bounds: NDArray[np.float64],
        bad: NDArray[np.bool_],
    ) -> None:
        """Shorten the motion of every component with a bad tet, in place.

        Parameters
        ----------
        points : (n, 4) positions at the end of the substep [m], in the first three columns
        previous : (n, 3) the positions that velocities are counted from, changed by contacts [m]
        begun : (n, 3) those at the beginning of the substep, where all guarded tets are positive [m]
        bounds : (m,) of the guard, minus infinity for tets that are not guarded; bad : (m,) tets below them
        """
        guarded, flat = bounds > 0.0, bounds < FLATTEST
        for label in np.unique(self.tet_labels[bad]):
            rows = np.flatnonzero(self.labels == label)
            base = begun.copy()
            base[rows] = self._rigid(points[rows, :3], begun[rows], rows)
            motion = np.zeros_like(base)
            motion[rows] = points[rows, :3] - base[rows]
            mine = guarded & (self.tet_labels == label)
            step = min(
                float(noninverting_step(base, motion, self.system.tets, mine & (flat == is_flat), keep)[0])
                for is_flat, keep in ((False, KEEP), (True, KEEP_FLAT))
            )
            # Positions are rounded, so that the volumes of slivers may differ from what the cubics promise.
            tets = self.system.tets[mine]
            while step > 0.0 and not (volume_signs(base + step * motion, tets) > 0.0).all():
                step *= 0.5
            points[rows, :3] = base[rows] + step * motion[rows]
            previous[rows] = begun[rows]

    def _rigid(self, x: NDArray, before: NDArray, rows: NDArray[np.intp]) -> NDArray[np.float64]:
        held = self.pinned[rows]
        if held.any():
            return np.where(held[:, None], x, before)
        m = self.system.masses[rows]
        center, center_before = m @ x / m.sum(), m @ before / m.sum()
        U, _, Vt = np.linalg.svd(((before - center_before) * m[:, None]).T @ (x - center))
        U[:, -1] *= np.sign(np.linalg.det(U @ Vt))
        return (before - center_before) @ (U @ Vt) + center
