"""Drag on triangles of surfaces, as forces that are linear in the velocities of their vertices.

A triangle with the outward area vector A and the mean velocity v of its corners feels, in a flow of the velocity w,

    F = density/2 drag max(-A . u, 0) u,    u = w - v:

-A . u / |u| is its projected area where it faces the flow. Each corner i takes the share

    f_i = c (w - v_i),    c = density/6 drag max(-A . u, 0),

whose sum is F. c is taken where a step begins, so that the forces oppose motion, and have in a step in which velocities
are affine in the positions the convex potential sum c_i |v_i - w|^2 / (2 dv/dx).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.applied import AppliedLoad, DragLoad, LoadPattern, Setting
from supple.model.loads.pressure import area_vectors
from supple.scene.loads.over_time import script_of
from supple.scene.loads.surface_loads import Wind


@dataclass(frozen=True, eq=False)
class WindDrag(DragLoad):
    """Drag on `triangles` (t, 3), counter-clockwise from outside; factor : density times drag [kg/m^3]."""

    triangles: NDArray[np.int32]
    velocity: Callable[[float], NDArray[np.float64]]
    factor: float

    work = "wind"

    @property
    def pattern(self) -> LoadPattern:
        return LoadPattern("drag", self.work, self.triangles, np.ones(len(self.triangles)), stiffness=self.factor)

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
    return [WindDrag(triangles.astype(np.int32), script_of(load, "velocity"), load.density * load.drag)]
