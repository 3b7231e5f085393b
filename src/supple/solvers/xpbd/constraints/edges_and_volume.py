"""The classic constraint set: C = |x1 - x2| - l on edges, C = V - V0 on tetrahedra, each with a compliance.

One projection with the multiplier starting at 0:

    dlam = -C / (sum w |grad C|^2 + alpha / h^2),    dx_i = w_i grad_i C dlam

Source: Macklin, Müller, Chentanez, "XPBD" (2016), equation 18.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.model.system import BodyRange, System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, make_groups, put_six, put_twelve, six, twelve
from supple.solvers.xpbd.sweeps.ordering import Layout
from supple.solvers.xpbd.sweeps.sweep import Sweep


@njit(fastmath=FLAGS, forceinline=True)
def project_length(x, w, rest, alpha):
    """The ends (6 coordinates) of an edge after its projection; alpha : compliance / h^2 [1/kg]."""
    x0, y0, z0, x1, y1, z1 = x
    dx, dy, dz = x0 - x1, y0 - y1, z0 - z1
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    # Coinciding ends define no direction; other constraints move them.
    factor = (rest - length) / ((w[0] + w[1] + alpha) * length) if length > 0.0 else 0.0
    a, b = w[0] * factor, w[1] * factor
    return x0 + a * dx, y0 + a * dy, z0 + a * dz, x1 - b * dx, y1 - b * dy, z1 - b * dz


@njit(fastmath=FLAGS, forceinline=True)
def project_determinant(x, w, rest, alpha):
    """The corners (12 coordinates) of a tet after the projection of its determinant; alpha : 36 compliance / h^2."""
    ax, ay, az, bx, by, bz, dx, dy, dz, ex, ey, ez = x
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = dx - ax, dy - ay, dz - az
    qx, qy, qz = ex - ax, ey - ay, ez - az
    gbx, gby, gbz = vy * qz - vz * qy, vz * qx - vx * qz, vx * qy - vy * qx
    gdx, gdy, gdz = qy * uz - qz * uy, qz * ux - qx * uz, qx * uy - qy * ux
    gex, gey, gez = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    gax, gay, gaz = -gbx - gdx - gex, -gby - gdy - gey, -gbz - gdz - gez
    det = gbx * ux + gby * uy + gbz * uz
    slope = (
        w[0] * (gax * gax + gay * gay + gaz * gaz)
        + w[1] * (gbx * gbx + gby * gby + gbz * gbz)
        + w[2] * (gdx * gdx + gdy * gdy + gdz * gdz)
        + w[3] * (gex * gex + gey * gey + gez * gez)
    )
    # Where all four are in a line, no direction changes the volume.
    dlam = (rest - det) / (slope + alpha) if slope > 0.0 else 0.0
    sa, sb, sd, se = w[0] * dlam, w[1] * dlam, w[2] * dlam, w[3] * dlam
    return (
        ax + sa * gax,
        ay + sa * gay,
        az + sa * gaz,
        bx + sb * gbx,
        by + sb * gby,
        bz + sb * gbz,
        dx + sd * gdx,
        dy + sd * gdy,
        dz + sd * gdz,
        ex + se * gex,
        ey + se * gey,
        ez + se * gez,
    )


@njit(fastmath=FLAGS, forceinline=True)
def _project_edges(X, data, g, h):
    """The rows of `data`: rest length, compliance, 2 inverse masses."""
    for i in range(WIDTH):
        w = (data[g, 2, i], data[g, 3, i])
        alpha = data[g, 1, i] * (1.0 / (h * h))
        put_six(X, i, project_length(six(X, i), w, data[g, 0, i], alpha))


@njit(fastmath=FLAGS, forceinline=True)
def _project_volumes(X, data, g, h):
    """The rows of `data`: determinant at rest, its compliance, 4 inverse masses."""
    for i in range(WIDTH):
        w = (data[g, 2, i], data[g, 3, i], data[g, 4, i], data[g, 5, i])
        alpha = data[g, 1, i] * (1.0 / (h * h))
        put_twelve(X, i, project_determinant(twelve(X, i), w, data[g, 0, i], alpha))


class _Constraints:
    """One constraint on each edge or on each tet (`which`) of some bodies.

    Parameters
    ----------
    rest : values of all of the System's edges or tets; compliance : of a body; project : for the sweep
    """

    def __init__(
        self,
        system: System,
        parts: list[BodyRange],
        layout: Layout,
        which: str,
        rest: NDArray[np.float64],
        compliance: Callable[[Any], float],
        project: Callable[..., Any],
    ) -> None:
        ranges = [getattr(part, which) for part in parts]
        rows = np.concatenate([np.arange(r.start, r.stop) for r in ranges])
        alpha = np.repeat([compliance(part.body.material) for part in parts], [r.stop - r.start for r in ranges])
        vertices: NDArray[np.int32] = getattr(system, which)
        movable = (system.inverse_masses[vertices[rows]] > 0.0).any(axis=1)
        rows, alpha = rows[movable], alpha[movable]
        constants = np.column_stack([rest[rows], alpha, system.inverse_masses[vertices[rows]]])
        self.sweep = Sweep(project, vertices[rows], constants, make_groups(layout, vertices[rows]))
        self.count = self.work = len(rows)

    def project(self, points: NDArray[np.float64], h: float) -> None:
        """See `ConstraintSet.project`."""
        self.sweep.run(points, h)


class EdgeConstraints(_Constraints):
    """The edges of all bodies made of `EdgesAndVolume`."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        rest = system.rest_lengths
        super().__init__(system, parts, layout, "edges", rest, lambda m: m.edge_compliance, _project_edges)


class VolumeConstraints(_Constraints):
    """The tetrahedra of all bodies made of `EdgesAndVolume`. Volumes are stored as determinants, 6 V."""

    def __init__(self, system: System, parts: list[BodyRange], layout: Layout) -> None:
        rest = 6.0 * system.rest_volumes
        # The energy C^2 / (2 alpha) of C = V - V0 is that of 6 C with 36 alpha.
        super().__init__(system, parts, layout, "tets", rest, lambda m: 36.0 * m.volume_compliance, _project_volumes)
