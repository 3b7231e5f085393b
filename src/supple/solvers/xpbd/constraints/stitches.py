"""Constraints of stitches: two for each stitch tet, as for a tet of a body; one for each spring.

Stitches are few. They are projected after the bodies' own constraints, on one thread.

A spring is C = |d| - l with d = x_0 - (1 - t) x_1 - t x_2 and the compliance 1 / k (see `edges_and_volume`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.scene.stitches.elements import Springs, StitchTets
from supple.solvers.xpbd.constraints.registry import ConstraintSet
from supple.solvers.xpbd.constraints.stable_neo_hookean import BlocksOfTwo
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, make_groups_of_one_chunk, nine, put_nine
from supple.solvers.xpbd.sweeps.sweep import Sweep


class StitchAnchors:
    """The positions of a system's anchors in each substep, relative to the origin of the bodies stitched to them.

    Attributes
    ----------
    partners : (a,) a body's vertex that is stitched to each anchor; all such vertices have the same origin
    """

    def __init__(self, system: System) -> None:
        self.anchors = system.stitching.anchors
        self.first = system.stitching.body_vertices
        joins = system.stitching.joins()
        to_anchor = joins[joins[:, 1] >= self.first]
        self.partners = np.zeros(len(self.anchors), dtype=np.int32)
        self.partners[to_anchor[:, 1] - self.first] = to_anchor[:, 0]

    def place(self, rows: NDArray[np.float64], origins: NDArray[np.float64], time: float) -> None:
        """Write the positions at `time` [s] into the last of the rows (n + a, 3 or 4)."""
        if len(self.anchors):
            rows[self.first :, :3] = self.anchors.at(time) - origins[self.partners]

    def velocities(self, time: float, h: float) -> NDArray[np.float64]:
        """(a, 3) mean velocities over the h [s] before `time` [m/s]."""
        if not len(self.anchors):
            return np.zeros((0, 3))
        return (self.anchors.at(time) - self.anchors.at(time - h)) / h


class StitchTetConstraints(BlocksOfTwo):
    """The tetrahedra of all soft vertex-triangle stitches; rows : which of the pairs they are."""

    called = "stitch tets"
    rows: NDArray[np.int64]

    def __init__(self, system: System, inverse_masses: NDArray[np.float64]) -> None:
        tets: StitchTets = system.stitching.tets
        movable = (inverse_masses[tets.vertices] > 0.0).any(axis=1)
        corners, self.rows = tets.vertices[movable], np.flatnonzero(movable)
        super().__init__(
            (corners, tets.rest_shape_inverse[movable], tets.rest_volumes[movable]),
            (tets.mu[movable], tets.lam[movable]),
            inverse_masses,
            make_groups_of_one_chunk(corners, system.joined_components, len(inverse_masses)),
        )
        self.warns = len(system.stitching.broken) == 0


class StitchSpringConstraints:
    """The springs of all vertex-vertex and vertex-edge stitches; rows : which of the pairs they are."""

    def __init__(self, system: System, inverse_masses: NDArray[np.float64]) -> None:
        springs: Springs = system.stitching.springs
        movable = (inverse_masses[springs.vertices] > 0.0).any(axis=1)
        ends, t = springs.vertices[movable], springs.place[movable]
        self.rows = len(system.stitching.tets) + np.flatnonzero(movable)
        w = inverse_masses[ends]
        shares = np.column_stack([1.0 - t, t])
        # Where both ends of the edge are one vertex, it has both shares.
        shares[ends[:, 1] == ends[:, 2]] = 1.0
        moved = shares * w[:, 1:]
        slope = w[:, 0] + np.where(ends[:, 1] == ends[:, 2], w[:, 1], (shares * moved).sum(axis=1))
        constants = np.column_stack(
            [springs.rest_lengths[movable], 1.0 / springs.stiffness[movable], t, slope, w[:, 0], moved]
        )
        groups = make_groups_of_one_chunk(ends, system.joined_components, len(inverse_masses))
        self.sweep = Sweep(_project_springs, ends, constants, groups)
        self.count = self.work = len(ends)

    def project(self, points: NDArray[np.float64], h: float) -> None:
        """See `ConstraintSet.project`."""
        self.sweep.run(points, h)


class StitchForces:
    """What stitches that may break deliver in the last sweep of a frame: that is exact where they are stiff, too.

    After it, other stitches and their bodies move the same vertices, so that the elastic law of the positions at the
    end of a frame gives other forces, where a stitch is stiff for its substeps.

    Attributes
    ----------
    latest : (k, 3) forces on the vertices of all pairs, NaN where they are not known, 0 where bodies sleep: what has
        held them does not break [N]; None where nothing breaks
    """

    def __init__(self, system: System, sets: list[ConstraintSet]) -> None:
        self.needed = system.scene.stitching.names.breakable
        self._others = system.stitching.nodes()[:, 1:] >= 0
        rows = (each.rows for each in sets if isinstance(each, StitchTetConstraints | StitchSpringConstraints))
        self._rows = np.concatenate([np.zeros(0, dtype=np.int64), *rows])
        self.begin_frame()

    def begin_frame(self) -> None:
        """Forget the forces of the frame before."""
        self.latest = None
        if self.needed:
            self.latest = np.full((len(self._others), 3), np.nan)
            self.latest[self._rows] = 0.0

    def project(self, constraints: ConstraintSet, points: NDArray[np.float64], h: float) -> None:
        """Project constraints as their `project` does, and keep the forces where they are stitches that may break."""
        if self.latest is None or not isinstance(constraints, StitchTetConstraints | StitchSpringConstraints):
            constraints.project(points, h)
            return
        rows, forces = constraints.rows, constraints.sweep.run_measured(points, h)
        # On a vertex that is held, what acts is opposite to what acts on the others.
        others = forces[:, 1:] * self._others[rows, : forces.shape[1] - 1, None]
        self.latest[rows] = np.where(np.isnan(forces[:, 0]), -others.sum(axis=1), forces[:, 0])


def stitch_constraints(
    system: System, inverse_masses: NDArray[np.float64]
) -> list[StitchTetConstraints | StitchSpringConstraints]:
    """The constraints that a system needs.

    Parameters
    ----------
    system : in the solver's numbering; inverse_masses : (n + a,) of its vertices and of its stitches' anchors [1/kg]
    """
    made = [StitchTetConstraints(system, inverse_masses), StitchSpringConstraints(system, inverse_masses)]
    return [constraints for constraints in made if constraints.count]


@njit(fastmath=FLAGS, forceinline=True)
def project_spring(x, w, rest, alpha, t, slope):
    """The 9 coordinates of a vertex and of the ends of an edge, after the projection of the spring between them.

    Parameters
    ----------
    w : inverse mass of the vertex, and those of the ends times their shares of the place on the edge [1/kg]
    alpha : compliance / h^2 [1/kg]; t : place on the edge; slope : sum w |grad C|^2 [1/kg]
    """
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = x
    s = 1.0 - t
    dx, dy, dz = x0 - s * x1 - t * x2, y0 - s * y1 - t * y2, z0 - s * z1 - t * z2
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    # Coinciding ends have no direction.
    factor = (rest - length) / ((slope + alpha) * length) if length > 0.0 else 0.0
    a, b, c = w[0] * factor, w[1] * factor, w[2] * factor
    return (
        x0 + a * dx,
        y0 + a * dy,
        z0 + a * dz,
        x1 - b * dx,
        y1 - b * dy,
        z1 - b * dz,
        x2 - c * dx,
        y2 - c * dy,
        z2 - c * dz,
    )


@njit(fastmath=FLAGS, forceinline=True)
def _project_springs(X, data, g, h):
    """The rows of `data`: rest length, compliance, and t, slope and w of `project_spring`."""
    for i in range(WIDTH):
        w = (data[g, 4, i], data[g, 5, i], data[g, 6, i])
        alpha = data[g, 1, i] * (1.0 / (h * h))
        put_nine(X, i, project_spring(nine(X, i), w, data[g, 0, i], alpha, data[g, 2, i], data[g, 3, i]))
