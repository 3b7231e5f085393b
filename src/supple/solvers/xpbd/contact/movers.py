"""What an impulse at a point of a surface moves: the vertex that the point is, or a whole rigid body.

A rigid body answers to an impulse d at the arm r about its center, both of the beginning of the substep, with the
displacement d / M of its center and the small rotation I^-1 (r x d): its control points then have the momentum d and
the angular momentum r x d. During the sweeps over contacts these motions are collected for each body, and a point of it
is at

    x + s + u + th x r,

with u and th the sums of these displacements and rotations. s is how far the body was shifted at both ends of the
substep alike, which changes no velocity. At the end the control points are moved likewise.

Source: Müller, Macklin, Chentanez, Jeschke, Kim, "Detailed Rigid Body Simulation with Extended Position Based Dynamics"
(2020), section 3.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.geometry.embedded_points import EmbeddedPoints
from supple.numerics.mat3 import cross, dot, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.rigid.bodies import RigidBodies
from supple.solvers.xpbd.rigid.motion import center_of, inertia_of, solve_symmetric


@njit(cache=True)
def take_points(x, start, vertices, weights, out):
    """Write the places of points (b,) on the vertices x (n, 3), see `EmbeddedPoints`, to the first rows of `out`."""
    for i in range(len(start) - 1):
        first = start[i]
        if start[i + 1] == first + 1:
            for j in range(3):
                out[i, j] = x[vertices[first], j]
        else:
            a = b = c = 0.0
            for k in range(first, start[i + 1]):
                w, v = weights[k], vertices[k]
                a, b, c = a + w * x[v, 0], b + w * x[v, 1], c + w * x[v, 2]
            out[i, 0], out[i, 1], out[i, 2] = a, b, c


@njit
def give_rows(points, start, vertices, x):
    """Copy those of the points back that are vertices of x (n, 3)."""
    for i in range(len(start) - 1):
        if start[i + 1] == start[i] + 1:
            for j in range(3):
                x[vertices[start[i]], j] = points[i, j]


class Movers(NamedTuple):
    """What moves n points, as kernels receive it.

    Attributes
    ----------
    inverse_masses : (n,) of the vertex that a point is [1/kg]; zero where something holds it, and on rigid bodies
    body : (n,) the rigid body of each point, or -1
    arms : (n, 3) from the center of its body, at the beginning of the substep [m]
    w : (b,) inverse masses of the bodies [1/kg]; J : (b, 3, 3) their inverse inertia [1/(kg m^2)]; zero where held
    loose : (b,) inverse masses for shifts [1/kg], zero where joints hold the body: they would take a shift back, with
        the velocity of that
    twists : (b, 9) u [m], th, and s [m]; see the module
    steps : (b, 3) how far each center has moved in the substep, without the twists [m]
    """

    inverse_masses: NDArray[np.float64]
    body: NDArray[np.int32]
    arms: NDArray[np.float64]
    w: NDArray[np.float64]
    J: NDArray[np.float64]
    loose: NDArray[np.float64]
    twists: NDArray[np.float64]
    steps: NDArray[np.float64]


class MovedPoints:
    """Points of surfaces, and the vertices and rigid bodies that move them.

    Parameters
    ----------
    points : (s,) on the vertices of a system, vertices themselves or on rigid bodies
    fixed : number of points after these, which nothing moves
    rigid : bodies of the system; inverse_masses : (s + fixed,) see `Movers`
    """

    def __init__(
        self, points: EmbeddedPoints, fixed: int, rigid: RigidBodies, inverse_masses: NDArray[np.float64]
    ) -> None:
        self._points, self._rigid = points, rigid
        count, bodies = len(points) + fixed, len(rigid)
        body = np.full(count, -1, dtype=np.int32)
        first = points.vertices[points.start[:-1]]
        body[: len(points)] = np.where(points.single < 0, rigid.of_vertex[first], rigid.welded_to[first])
        inverse_masses[body >= 0] = 0.0
        self.movers = Movers(
            inverse_masses,
            body,
            np.zeros((count, 3)),
            np.zeros(bodies),
            np.zeros((bodies, 3, 3)),
            np.zeros(bodies),
            np.zeros((bodies, 9)),
            np.zeros((bodies, 3)),
        )
        self._total = np.zeros((bodies, 9))
        self._free = np.zeros(bodies, dtype=np.bool_)
        self._described = points.start, points.vertices, points.weights
        self._bodies = rigid.control, rigid.masses, self._free, rigid.joined
        self._known = False

    def begin_step(self, held: NDArray[np.bool_]) -> None:
        """Begin a frame in which some rigid bodies (b,) are held."""
        self._free[:] = ~held

    def begin_substep(self) -> None:
        """Begin a substep. Contact only shifts the bodies at its beginning, so that arms and inertia are found once."""
        self._known = False

    def take(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        """Write the places of the points, of those of the vertices x (n, 3), into the first rows of `out`."""
        take_points(x, *self._described, out)

    def begin(
        self,
        x: NDArray[np.float64],
        x_prev: NDArray[np.float64],
        places: NDArray[np.float64],
        before: NDArray[np.float64],
    ) -> None:
        """Begin to move the points: take their places at the end and at the beginning of the substep [m].

        Parameters
        ----------
        x, x_prev : (n, 3) vertices then; places, before : of the points, out
        """
        self.take(x, places)
        self.take(x_prev, before)
        if len(self._total):
            _begin(x, x_prev, before, self._bodies, self._known, self.movers, self._total)
        self._known = True

    def settle(self, places: NDArray[np.float64], before: NDArray[np.float64], predicted: NDArray[np.float64]) -> None:
        """Apply the twists to places of the points, in place: at the end of the substep, and two at its beginning."""
        if len(self._total):
            settle(places, before, predicted, self.movers, self._total)

    def give(
        self,
        places: NDArray[np.float64],
        before: NDArray[np.float64],
        x: NDArray[np.float64],
        x_prev: NDArray[np.float64],
    ) -> None:
        """Move the vertices (n, 3) as their points moved, at the end and at the beginning of the substep."""
        start, vertices, _ = self._described
        _give(places, before, start, vertices, x, x_prev, self._rigid.control, self._total)


@njit
def place(x, movers, i):
    """Where point i is, with the motion of its body; x (n, 3) without it [m]."""
    b = movers.body[i]
    p = row(x, i)
    if b < 0:
        return p
    t, r = movers.twists, row(movers.arms, i)
    return (
        p[0] + t[b, 6] + t[b, 0] + (t[b, 4] * r[2] - t[b, 5] * r[1]),
        p[1] + t[b, 7] + t[b, 1] + (t[b, 5] * r[0] - t[b, 3] * r[2]),
        p[2] + t[b, 8] + t[b, 2] + (t[b, 3] * r[1] - t[b, 4] * r[0]),
    )


@njit
def place_before(x, movers, i):
    """Where point i was at the beginning of the substep, with the shift of its body; x (n, 3) without it [m]."""
    b = movers.body[i]
    p = row(x, i)
    if b < 0:
        return p
    t = movers.twists
    return (p[0] + t[b, 6], p[1] + t[b, 7], p[2] + t[b, 8])


@njit
def turn_body(movers, b, moment):
    """Rotate body b by an angular impulse [kg m^2]."""
    J = movers.J
    for j in range(3):
        movers.twists[b, 3 + j] += J[b, j, 0] * moment[0] + J[b, j, 1] * moment[1] + J[b, j, 2] * moment[2]


@njit
def push_body(movers, i, d):
    """Move the body of point i by the impulse d there [kg m]."""
    b = movers.body[i]
    for j in range(3):
        movers.twists[b, j] += movers.w[b] * d[j]
    turn_body(movers, b, cross(row(movers.arms, i), d))


@njit
def softness(movers, b, share, moment):
    """How far an impulse moves body b along itself: of length `share`, with this moment about the center [1/kg]."""
    J = movers.J
    turned = (
        J[b, 0, 0] * moment[0] + J[b, 0, 1] * moment[1] + J[b, 0, 2] * moment[2],
        J[b, 1, 0] * moment[0] + J[b, 1, 1] * moment[1] + J[b, 1, 2] * moment[2],
        J[b, 2, 0] * moment[0] + J[b, 2, 1] * moment[1] + J[b, 2, 2] * moment[2],
    )
    return movers.w[b] * share * share + dot(moment, turned)


@njit(cache=True)
def settle(places, before, predicted, movers, total):
    """Apply the twists to the points (n, 3), add them to their sum in the substep (b, 9), and begin new ones."""
    for i in range(len(places)):
        if movers.body[i] >= 0:
            p, q, r = place(places, movers, i), place_before(before, movers, i), place_before(predicted, movers, i)
            for j in range(3):
                places[i, j], before[i, j], predicted[i, j] = p[j], q[j], r[j]
    for b in range(len(total)):
        for j in range(9):
            total[b, j] += movers.twists[b, j]
        for j in range(3):
            movers.steps[b, j] += movers.twists[b, j]
    movers.twists[:] = 0.0


@njit(cache=True)
def _begin(x, x_prev, before, bodies, known, movers, total):
    control = bodies[0]
    total[:] = 0.0
    movers.twists[:] = 0.0
    if not known:
        _describe(x_prev, before, bodies, movers)
    for b in range(len(control)):
        now, then = center_of(x, control, b), center_of(x_prev, control, b)
        for j in range(3):
            movers.steps[b, j] = now[j] - then[j]


@njit
def _describe(x_prev, before, bodies, movers):
    """Set what movers have of bodies and points where the substep begins."""
    control, masses, free, joined = bodies
    for b in range(len(control)):
        S = inertia_of(x_prev, control, b)[1]
        movers.w[b] = 1.0 / masses[b] if free[b] else 0.0
        movers.loose[b] = 0.0 if joined[b] else movers.w[b]
        f = 4.0 / masses[b] if free[b] else 0.0
        for j in range(3):
            column = solve_symmetric(S, (1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2)))
            for k in range(3):
                movers.J[b, k, j] = f * column[k]
    for i in range(len(movers.body)):
        b = movers.body[i]
        if b >= 0:
            r = subtract(row(before, i), center_of(x_prev, control, b))
            for j in range(3):
                movers.arms[i, j] = r[j]


@njit(cache=True)
def _give(places, before, start, vertices, x, x_prev, control, total):
    give_rows(places, start, vertices, x)
    give_rows(before, start, vertices, x_prev)
    for b in range(len(control)):
        center = center_of(x_prev, control, b)
        th = (total[b, 3], total[b, 4], total[b, 5])
        for i in control[b]:
            turned = cross(th, subtract(row(x_prev, i), center))
            for j in range(3):
                x[i, j] += total[b, 6 + j] + total[b, j] + turned[j]
                x_prev[i, j] += total[b, 6 + j]
