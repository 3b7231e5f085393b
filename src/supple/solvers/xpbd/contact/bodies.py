"""Nodes on rigid bodies: what an impulse at a node moves, and where nodes are.

A rigid body responds to an impulse f at the arm r about its center, both of the beginning of the substep, with the
displacement f / M of its center and the small rotation I^-1 (r x f). During the sweeps over rows these are collected in
its twist (u, th), and a node of it is at x + u + th x r; see `levers`. At the end the twist is added to the momenta of
its control points, and they determine its place (`RigidBodies.advance`). Joints act on the same twists.

Source: Müller, Macklin, Chentanez, Jeschke, Kim, "Detailed Rigid Body Simulation with Extended Position Based Dynamics"
(2020), section 3.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.adjacency import Adjacency
from supple.numerics.mat3 import cross, row, subtract
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.rigid.motion import center_of, inertia_of, solve_symmetric


class Bodies(NamedTuple):
    """The rigid bodies that nodes are on, as kernels take them.

    Attributes
    ----------
    body : (N,) the rigid body of each node, or -1
    arms : (N, 3) from its center at x_n [m]; bends : (N,) how far the way of a node is from a straight one [m]
    w : (b,) inverse masses [1/kg]; J : (b, 3, 3) inverse inertia at x_n [1/(kg m^2)]; zero where a body is held
    twists : (b, 6) u [m], th
    """

    body: NDArray[np.int32]
    arms: NDArray[np.float64]
    bends: NDArray[np.float64]
    w: NDArray[np.float64]
    J: NDArray[np.float64]
    twists: NDArray[np.float64]

    @classmethod
    def of(cls, body: NDArray[np.int32], count: int) -> Bodies:
        """Of nodes (N,) on `count` bodies."""
        n, zeros = len(body), np.zeros
        return cls(body, zeros((n, 3)), zeros(n), zeros(count), zeros((count, 3, 3)), zeros((count, 6)))


class Movers(NamedTuple):
    """What nodes on rigid bodies need: the bodies, and the nodes of each of them."""

    bodies: Bodies
    nodes: Adjacency


@njit
def has_body(bodies, nodes, e):
    """Whether one of the four nodes of row e is on a rigid body."""
    return (
        max(
            max(bodies.body[nodes[e, 0]], bodies.body[nodes[e, 1]]),
            max(bodies.body[nodes[e, 2]], bodies.body[nodes[e, 3]]),
        )
        >= 0
    )


@njit
def turn_body(bodies, b, moment):
    """Rotate body b by an angular impulse [kg m^2]."""
    J = bodies.J
    for j in range(3):
        bodies.twists[b, 3 + j] += J[b, j, 0] * moment[0] + J[b, j, 1] * moment[1] + J[b, j, 2] * moment[2]


@njit
def push_node(points, bodies, i, f):
    """Move node i (N, 4), or its body, by an impulse [kg m]."""
    b = bodies.body[i]
    if b < 0:
        for j in range(3):
            points[i, j] += points[i, 3] * f[j]
    elif bodies.w[b] > 0.0:
        for j in range(3):
            bodies.twists[b, j] += bodies.w[b] * f[j]
        turn_body(bodies, b, cross(row(bodies.arms, i), f))


@njit
def describe(points, x, control, masses, bodies):
    """Set what bodies have where the substep begins.

    points : (N, 4), with inverse masses; x : (N, 3) x_n; control : (b, 4) nodes
    """
    for b in range(len(control)):
        S = inertia_of(x, control, b)[1]
        free = points[control[b, 0], 3] > 0.0
        bodies.w[b] = 1.0 / masses[b] if free else 0.0
        f = 4.0 / masses[b] if free else 0.0
        for j in range(3):
            column = solve_symmetric(S, (1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2)))
            for k in range(3):
                bodies.J[b, k, j] = f * column[k]
    bodies.twists[:] = 0.0
    for i in range(len(bodies.body)):
        b = bodies.body[i]
        if b >= 0:
            r = subtract(row(x, i), center_of(x, control, b))
            for j in range(3):
                bodies.arms[i, j] = r[j]


@njit(cache=True)
def take_twists(velocities, control, bodies, h):
    """Change the velocities (N, 3) of control points by the twists of a substep of h [s]; twists are zero then."""
    for b in range(len(control)):
        u, th = row(bodies.twists, b), (bodies.twists[b, 3], bodies.twists[b, 4], bodies.twists[b, 5])
        for i in control[b]:
            turned = cross(th, row(bodies.arms, i))
            for j in range(3):
                velocities[i, j] += (u[j] + turned[j]) / h
    bodies.twists[:] = 0.0


@njit(cache=True)
def place_nodes(x, first, control, weights):
    """Put the nodes from `first` on where their control points (k, 4) of x (N, >= 3) and weights (k, 4) say."""
    for k in range(len(control)):
        for j in range(3):
            value = 0.0
            for i in range(4):
                value += weights[k, i] * x[control[k, i], j]
            x[first + k, j] = value
