"""The last resort of a substep: components keep only so much of their relative motion as is possible.

Where projections did not keep every tet positive, the motion of a component is shortened towards a rigid one:
x(a) = y + a (x - y), with y the places x_n of the beginning, moved as a rigid body with the momentum of the substep. At
a = 0 all tets have their volumes of the beginning, so that an a above 0 exists; the largest one is the root of a cubic
for each tet.

Where they did not keep surfaces apart, the components that passed through each other are shortened together, towards
one rigid motion of all of them: at a = 0 nothing moves with respect to anything else. This is a perfectly inelastic
collision.

What this moves into an obstacle that is a simple shape is moved out as a whole, which stops its approach.

The kinetic energy falls: in the metric of the masses, the rigid motion is the projection of the motion.

Components with pinned vertices, and those that passed through an obstacle, are held: y has the pins at their new
places, and the other vertices where they were. Where pins alone turn a tet over, nothing helps.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.model.system import System
from supple.numerics.noninverting_step import noninverting_step, volume_signs
from supple.scene.contact_pairs import pair_table
from supple.scene.rotation import rotation_matrix
from supple.solvers.xpbd.constraints.volume_guard import FLATTEST

# How often all shapes are gone through: a displacement out of one may lead into another.
MOST_ROUNDS = 4


class ObstacleLift:
    """The simple shapes of a system, and which vertices they collide with.

    Parameters
    ----------
    skin : gap that is kept where it was at the beginning of a substep [m]
    """

    def __init__(self, system: System, skin: float) -> None:
        self._skin = skin
        self._poses = ObstaclePoses(system.obstacles)
        self._shapes = [k for k, obstacle in enumerate(system.obstacles) if obstacle.contact_mesh is None]
        collide = pair_table(system.scene).collide
        bodies = len(system.bodies)
        self._points = system.points
        self._collide = np.zeros((len(system.obstacles), len(system.points)), dtype=np.bool_)
        for number, part in enumerate(system.bodies):
            self._collide[:, np.unique(system.triangles[part.triangles])] = collide[bodies:, number][:, None]

    def displacement(
        self,
        x: NDArray[np.float64],
        x_prev: NDArray[np.float64],
        rows: NDArray[np.intp],
        times: tuple[float, float],
    ) -> NDArray[np.float64]:
        """What is to be added to vertices so that no point is deeper in a shape than at the beginning: (3,) [m].

        Parameters
        ----------
        x, x_prev : (n, 3) world positions of all vertices at the end and at the beginning of the substep [m]
        rows : (k,) the vertices that are moved; times : of the beginning and of the end [s]
        """
        moved_points = np.isin(self._points.vertices[self._points.start[:-1]], rows)
        x, x_prev = self._points.positions(x), self._points.positions(x_prev)
        d = np.zeros(3)
        for _ in range(MOST_ROUNDS):
            moved = False
            for k in self._shapes:
                mine = self._collide[k] & moved_points
                if not mine.any():
                    continue
                before, _ = self._gaps(k, x_prev[mine], times[0])
                now, normals = self._gaps(k, x[mine] + d, times[1])
                lack = np.minimum(before, self._skin) - now
                worst = int(np.argmax(lack))
                if lack[worst] > 0.0:
                    d, moved = d + lack[worst] * normals[worst], True
            if not moved:
                break
        return d

    def _gaps(self, k: int, x: NDArray[np.float64], time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Signed distances (m,) from shape k at a time, and its normals there (m, 3)."""
        R, t = self._poses.at(time)
        gaps, normals = self._poses.obstacles[k].signed_distance((x - t[k]) @ R[k])
        return gaps, normals @ R[k].T


# The share of its volume that a tet keeps at least, and one that is nearly flat.
KEEP, KEEP_FLAT = 0.1, 1.0 - 1e-6


class RigidFallback:
    """The components of a system and their tets; for `skin` see `ObstacleLift`."""

    def __init__(self, system: System, skin: float) -> None:
        self.system = system
        self.labels = system.joined_components
        self.tet_labels = self.labels[system.tets[:, 0]]
        self.pinned = system.inverse_masses == 0.0
        self._lift = ObstacleLift(system, skin)

    def apply(
        self,
        points: NDArray[np.float64],
        velocities: NDArray[np.float64],
        previous: NDArray[np.float64],
        begun: NDArray[np.float64],
        origins: NDArray[np.float64],
        h: float,
        bounds: NDArray[np.float64],
        time: float,
        groups: Sequence[Sequence[int]],
        most: float = 1.0,
    ) -> None:
        """Shorten the motion of groups of components, in place.

        Parameters
        ----------
        points : (n, 4) positions at the end of the substep [m], in the first three columns
        velocities : (n, 3) at the end of the substep [m/s]
        previous : (n, 3) the positions that velocities are counted from, changed by contacts [m]
        begun : (n, 3) those at the beginning of the substep, where all guarded tets are positive [m]
        origins : (n, 3) of these positions in the world [m]; h : length of the substep [s]
        bounds : (m,) of the guard, minus infinity for tets that are not guarded
        time : end of the substep [s]
        groups : labels of components; -1 for an obstacle
        most : the largest share a of the motion; 0: places relative to each other are those of `begun`
        """
        guarded, flat = bounds > 0.0, bounds < FLATTEST
        for group in groups:
            rows = np.flatnonzero(np.isin(self.labels, group))
            shift = origins[rows] - origins[rows[0]]
            held = -1 in group or bool(self.pinned[rows].any())
            mine = guarded & np.isin(self.tet_labels, group)
            tets = self.system.tets[mine]
            start = begun.copy()
            # Contacts part what was too near at the beginning; without that, it would be held back for ever.
            if most > 0.0:
                start[rows] = previous[rows]
                if not (volume_signs(start, tets) > 0.0).all():
                    start[rows] = begun[rows]
            base = start.copy()
            base[rows] = self._rigid(points[rows, :3] + shift, start[rows] + shift, rows, held) - shift
            motion = np.zeros_like(base)
            motion[rows] = points[rows, :3] - base[rows]
            step = min(
                most,
                *(
                    float(noninverting_step(base, motion, self.system.tets, mine & (flat == is_flat), keep)[0])
                    for is_flat, keep in ((False, KEEP), (True, KEEP_FLAT))
                ),
            )
            # Positions are rounded, so that the volumes of slivers may differ from what the cubics promise.
            while step > 0.0 and not (volume_signs(base + step * motion, tets) > 0.0).all():
                step *= 0.5
            points[rows, :3] = base[rows] + step * motion[rows]
            v = (points[rows, :3] - start[rows]) / h
            if not held:
                x_old, at = previous[rows] + shift, start[rows] + shift
                wrong = self._excess(at, v, x_old, velocities[rows], rows)
                moved = base + step * motion
                # A rotation: displacements linear in the places would change distances, and surfaces may be in touch.
                moved[rows] = self._displaced(moved[rows] + shift, rows, -h * wrong) - shift
                if (volume_signs(moved, tets) > 0.0).all():
                    points[rows, :3] = moved[rows]
                    v = (moved[rows] - start[rows]) / h
                    wrong = self._excess(at, v, x_old, velocities[rows], rows)
                v -= wrong[0] + np.cross(wrong[1], at - self._center(at, rows))
                shown = (points[:, :3] + origins, start + origins)
                lift = self._lift.displacement(*shown, rows, (time - h, time))
                points[rows, :3] += lift
                v += lift / h
            velocities[rows], previous[rows] = v, start[rows]

    def _rigid(self, x: NDArray, before: NDArray, rows: NDArray[np.intp], held: bool) -> NDArray[np.float64]:
        if held:
            return np.where(self.pinned[rows][:, None], x, before)
        m = self.system.masses[rows]
        center, center_before = m @ x / m.sum(), m @ before / m.sum()
        U, _, Vt = np.linalg.svd(((before - center_before) * m[:, None]).T @ (x - center))
        U[:, -1] *= np.sign(np.linalg.det(U @ Vt))
        return (before - center_before) @ (U @ Vt) + center

    def _excess(self, x: NDArray, v: NDArray, x_old: NDArray, v_old: NDArray, rows: NDArray) -> NDArray[np.float64]:
        """A rigid field with the momenta of (x, v) without those of (x_old, v_old): (2, 3).

        The velocity of the center of x [m/s], and the angular velocity about it [rad/s].
        """
        m = self.system.masses[rows]
        center = self._center(x, rows)
        r = x - center
        moment = (m[:, None] * (np.cross(r, v) - np.cross(x_old - center, v_old))).sum(axis=0)
        inertia = np.einsum("i,ij,ij->", m, r, r) * np.eye(3) - np.einsum("i,ij,ik->jk", m, r, r)
        return np.array([m @ (v - v_old) / m.sum(), np.linalg.lstsq(inertia, moment, rcond=None)[0]])

    def _center(self, x: NDArray, rows: NDArray) -> NDArray[np.float64]:
        m = self.system.masses[rows]
        return m @ x / m.sum()

    def _displaced(self, x: NDArray, rows: NDArray, by: NDArray) -> NDArray[np.float64]:
        """Places x (k, 3) moved by a vector and turned about their center by a rotation vector: `by` (2, 3)."""
        center = self._center(x, rows)
        return (x - center) @ rotation_matrix(by[1]).T + center + by[0]


def united(groups: Sequence[set[int]], pairs: Sequence[Sequence[int]]) -> list[set[int]]:
    """Groups of labels, with those joined that a pair belongs to, in ascending order of their least labels."""
    found = [set(group) for group in groups]
    for pair in pairs:
        joined = set(pair).union(*(group for group in found if not group.isdisjoint(pair)))
        found = [group for group in found if group.isdisjoint(pair)] + [joined]
    return sorted(found, key=min)
