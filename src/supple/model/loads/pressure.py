"""Pressure on triangles of surfaces, and the volume that they sweep, of which it is the derivative.

The force on each corner of a triangle is a third of -p A, with A its area vector along the outward normal. While the
corners a, b, c move straight by da, db, dc, the triangle sweeps the volume

    W = D . N / 6,    D = da + db + dc,    N = u x v + (u x dv + du x v) / 2 + du x dv / 3,

u = b - a, v = c - a where the motion begins. W is counted along the outward normal. Of a closed surface the sum is
exactly the change of the volume inside, whatever the path. Of a part of a surface the work of a pressure depends on the
path, and p W is that of the straight one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.applied import AppliedLoad, DragLoad, Setting
from supple.scene.loads.over_time import script_of
from supple.scene.loads.surface_loads import Wind
from supple.scene.shell import Shell


@dataclass(frozen=True, eq=False)
class FollowerPressure(AppliedLoad):
    """A pressure on `triangles` (t, 3), counter-clockwise from outside of the body; `pressure` : time -> [Pa].

    is_internal : of a closed shell. Forces at predicted places have a moment about those before: it would turn a light
        balloon faster and faster.
    """

    triangles: NDArray[np.int32]
    pressure: Callable[[float], float]
    is_internal: bool = False

    work = "pressures"

    def renumbered(self, new: NDArray[np.int32]) -> FollowerPressure:
        return replace(self, triangles=new[self.triangles])

    def acts_on(self) -> NDArray[np.int32]:
        return np.unique(self.triangles)

    def add_forces(self, x: NDArray[np.float64], time: float, out: NDArray[np.float64]) -> None:
        thirds = -self.pressure(time) / 3.0 * area_vectors(x, self.triangles)
        for corner in self.triangles.T:
            np.add.at(out, corner, thirds)


def area_vectors(x: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """(t, 3) areas along the normals [m^2] of triangles (t, 3) of points x (n, 3)."""
    a, b, c = x[triangles].transpose(1, 0, 2)
    return 0.5 * np.cross(b - a, c - a)


class SweptTriangles:
    """Triangles (t, 3) on their path from x_n to x (n, 3); see the formulas of this file.

    Attributes
    ----------
    triangles : (t, 3); mean : N; sum : D; first, second : G = v / 2 + dv / 3 and u / 2 + du / 3, each (t, 3)
    """

    def __init__(self, start: NDArray[np.float64], x: NDArray[np.float64], triangles: NDArray[np.int32]) -> None:
        self.triangles = triangles
        a, b, c = start[triangles].transpose(1, 0, 2)
        da, db, dc = (x - start)[triangles].transpose(1, 0, 2)
        u, v, du, dv = b - a, c - a, db - da, dc - da
        self.sum = da + db + dc
        self.mean = np.cross(u, v) + 0.5 * (np.cross(u, dv) + np.cross(du, v)) + np.cross(du, dv) / 3.0
        self.first, self.second = 0.5 * v + dv / 3.0, 0.5 * u + du / 3.0

    def volume(self) -> float:
        """W [m^3]"""
        return float(np.einsum("ti,ti->", self.sum, self.mean)) / 6.0

    def add_gradient(self, factor: float, out: NDArray[np.float64]) -> None:
        """Add `factor` times the gradient of W by x to `out` (n, 3)."""
        b, c = np.cross(self.first, self.sum), np.cross(self.sum, self.second)
        for corner, turn in zip(self.triangles.T, (-b - c, b, c), strict=True):
            np.add.at(out, corner, factor / 6.0 * (self.mean + turn))

    def hessian(self) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.float64]]:
        """Rows, columns (3 t,) and blocks (3 t, 3, 3) of the second derivative of W, each pair of corners once.

        A corner has none with itself: W is linear in it.
        """
        i, j, k = self.triangles.T
        B, C, turn = -cross_matrices(self.first), cross_matrices(self.second), -cross_matrices(self.sum) / 3.0
        blocks = np.concatenate([2.0 * B + C + turn, C - B + turn, -B - 2.0 * C + turn]) / 6.0
        return np.concatenate([i, j, k]), np.concatenate([j, k, i]), blocks


def cross_matrices(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3, 3) the matrices of w -> v x w for v (k, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return out


# Drag on triangles of surfaces, as forces that are linear in the velocities of their vertices.
#
# A triangle with the outward area vector A and the mean velocity v of its corners feels, in a flow of the velocity w,
#
# F = density/2 drag max(-A . u, 0) u,    u = w - v:
#
# -A . u / |u| is its projected area where it faces the flow. Each corner i takes the share
#
# f_i = c (w - v_i),    c = density/6 drag max(-A . u, 0),
#
# whose sum is F. c is taken where a step begins, so that the forces oppose motion, and have in a step in which
# velocities are affine in the positions the convex potential sum c_i |v_i - w|^2 / (2 dv/dx).


@dataclass(frozen=True, eq=False)
class WindDrag(DragLoad):
    """Drag on `triangles` (t, 3), counter-clockwise from outside; factor : density times drag [kg/m^3]."""

    triangles: NDArray[np.int32]
    velocity: Callable[[float], NDArray[np.float64]]
    factor: float

    work = "wind"

    def value(self, time: float) -> NDArray[np.float64]:
        return self.velocity(time)

    def renumbered(self, new: NDArray[np.int32]) -> WindDrag:
        return replace(self, triangles=new[self.triangles])

    def acts_on(self) -> NDArray[np.int32]:
        return np.unique(self.triangles)

    def coefficients(self, x: NDArray[np.float64], v: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        towards = self.velocity(time) - v[self.triangles].mean(axis=1)
        facing = np.maximum(-np.einsum("ti,ti->t", area_vectors(x, self.triangles), towards), 0.0)
        shares = np.repeat(self.factor / 6.0 * facing, 3)
        return np.bincount(self.triangles.ravel(), shares, len(x)).astype(np.float64, copy=False)


def wind_drag(load: Wind, setting: Setting) -> list[AppliedLoad]:
    """The wind on a body of a scene."""
    body = setting.body(load.body)
    triangles = body.triangles[load.triangles(body)] + setting.begins[load.body]
    if isinstance(body, Shell):  # which has two sides
        triangles = np.concatenate([triangles, triangles[:, ::-1]])
    return [WindDrag(triangles.astype(np.int32), script_of(load, "velocity"), load.density * load.drag)]
