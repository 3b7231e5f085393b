"""How the forces of friction depend on the state whose normal forces, directions and points of contact they have.

A contact has the force c_i f r(|u|) u on its point i, where f = mu lambda, the coefficients c and the normal n are
those of lagged positions, and u = (1 - n n^T) sum c_i (x_i - o_i). The derivative by the lagged positions makes the
equations of a step unsymmetric where normal forces are those of its end. It is found by complex steps, which have no
error of truncation or cancellation: f(a + i e) has the imaginary part e f'(a).

Source: Squire, Trapp, "Using complex variables to estimate derivatives of real functions" (1998).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array

from supple.contact.features.pair_geometry import EDGE_EDGE, VERTEX_EDGE, VERTEX_VERTEX
from supple.solvers.implicit.contact.areas import Sparse, by_areas, embedding
from supple.solvers.implicit.contact.friction import Friction, Press

_STEP = 1e-30


@dataclass(frozen=True, eq=False)
class LaggedFriction:
    """The friction of one step.

    Attributes
    ----------
    lagged, start : (s, 3) points where normal forces are taken, and where the step begins [m]
    """

    friction: Friction
    lagged: NDArray[np.float64]
    start: NDArray[np.float64]

    @classmethod
    def of(cls, friction: Friction, lagged: NDArray[np.float64], start: NDArray[np.float64]) -> LaggedFriction:
        """Of positions (n, 3) of the vertices."""
        positions = friction.points.positions
        return cls(friction, positions(lagged), positions(start))

    def derivative(self, x: NDArray[np.float64], weights: NDArray[np.float64], areas: Sparse) -> Sparse:
        """(3 n, 3 n) of the gradient at x (n, 3) by the lagged positions [N/m].

        weights, areas : (c,) [m^2] of all contacts there, and (c, 3 s) their derivatives by the points [m]
        """
        friction, slips = self.friction, self.friction.slips
        assert friction.press is not None
        points = np.maximum(slips.points, 0)
        way = (friction.points.positions(x) - self.start)[points]
        there = self.lagged[points] - self.lagged[points[:, :1]]  # as differences, which have more digits
        blocks = np.empty((len(points), 4, 3, 4, 3))
        for i in range(4):
            for j in range(3):
                moved = there.astype(np.complex128)
                moved[:, i, j] += 1j * _STEP
                blocks[:, :, :, i, j] = _forces(slips.kinds, moved, way, friction.press, friction.reach).imag / _STEP
        rows = 3 * points[:, :, None, None, None] + np.arange(3)[:, None, None]
        columns = 3 * points[:, None, None, :, None] + np.arange(3)
        rows, columns = np.broadcast_to(rows, blocks.shape), np.broadcast_to(columns, blocks.shape)
        s = 3 * len(self.lagged)
        between = coo_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(s, s))
        W = embedding(friction.points, len(x))
        own = csr_array(W.T @ between @ W)
        if not areas.nnz:
            return own
        numbers = friction.press.numbers
        forces = _forces(slips.kinds, there, way, friction.press, friction.reach)
        relative = diags_array(1.0 / weights[numbers]) @ areas[numbers]
        return own + by_areas(slips.points, forces, relative, friction.points, len(x))


def _forces(kinds: NDArray[np.int8], there: Any, way: NDArray[np.float64], press: Press, reach: float) -> Any:
    """(k, 4, 3) the gradient by the points, of lagged points (k, 4, 3) and displacements (k, 4, 3) in the step."""
    c = _coefficients(kinds, there)
    r = np.einsum("ki,kij->kj", c, there)
    d = np.sqrt((r * r).sum(axis=1))
    n = r / d[:, None]
    q = d / press.dhat
    below, log = (q - 1.0) * (q + 1.0), 2.0 * np.log(q)
    forces = press.weights * 2.0 * q * below * (2.0 * log + below / (q * q))
    u = np.einsum("ki,kij->kj", c, way)
    u = u - n * (u * n).sum(axis=1)[:, None]
    y = np.sqrt((u * u).sum(axis=1))
    sticks = y.real < reach
    ratio = np.where(sticks, (2.0 - y / reach) / reach, 1.0 / np.where(sticks, 1.0, y))
    return c[:, :, None] * (forces * ratio)[:, None, None] * u[:, None, :]


def _coefficients(kinds: NDArray[np.int8], x: Any) -> Any:
    """(k, 4) of the closest points; see `supple.contact.features.pair_geometry`."""
    out = np.zeros(x.shape[:2], dtype=x.dtype)
    out[:, 0] = 1.0
    is_point, is_edge, is_pair = kinds == VERTEX_VERTEX, kinds == VERTEX_EDGE, kinds == EDGE_EDGE
    out[is_point, 1] = -1.0
    p, a, b, _ = _points(x[is_edge])
    w = _dot(p - a, b - a) / _dot(b - a, b - a)
    out[is_edge, 1], out[is_edge, 2] = w - 1.0, -w
    a, b, c, d = _points(x[is_pair])
    s, t = _solved(b - a, c - d, c - a)
    out[is_pair, 0], out[is_pair, 1], out[is_pair, 2], out[is_pair, 3] = 1.0 - s, s, t - 1.0, -t
    on_face = ~(is_point | is_edge | is_pair)
    p, a, b, c = _points(x[on_face])
    u, v = _solved(b - a, c - a, p - a)
    out[on_face, 1], out[on_face, 2], out[on_face, 3] = u + v - 1.0, -u, -v
    return out


def _points(x: Any) -> Any:
    return x[:, 0], x[:, 1], x[:, 2], x[:, 3]


def _solved(g: Any, h: Any, r: Any) -> tuple[Any, Any]:
    """s and t (k,) for which |s g + t h - r| is smallest."""
    a, b, c, p, q = _dot(g, g), _dot(g, h), _dot(h, h), _dot(g, r), _dot(h, r)
    whole = a * c - b * b
    return (c * p - b * q) / whole, (a * q - b * p) / whole


def _dot(a: Any, b: Any) -> Any:
    return (a * b).sum(axis=1)
