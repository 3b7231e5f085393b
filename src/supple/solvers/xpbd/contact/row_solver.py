"""The solution of the rows of a substep, and what velocities take over from it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.numerics.mat3 import cross, row
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.bodies import Bodies, place_nodes, take_twists
from supple.solvers.xpbd.contact.islands import Islands, find_islands
from supple.solvers.xpbd.contact.levers import hold_bodies
from supple.solvers.xpbd.contact.nodes import Nodes
from supple.solvers.xpbd.contact.solve import solve
from supple.solvers.xpbd.rigid.bodies import RigidBodies, Welds, follow_welds
from supple.solvers.xpbd.rigid.joint_rows import begin_rows, linearize, note_rows, sweep_joints
from supple.solvers.xpbd.rigid.joints import JointProjection
from supple.solvers.xpbd.rigid.motion import advance

# Of the gap: what the last sweep over the rows may change.
ROW_RESIDUAL = 0.02
# The same of rigid bodies, which nothing else corrects: of the fall in a substep.
RIGID_RESIDUAL = 0.0001
# The rows of joints are linearized at most so often, until none is off by more than this share of its joint's size.
MOST_LINEARIZATIONS, JOINT_EXACT = 20, 1e-5
# With joints, and for each rigid body where that is more: what pulls at a chain has to go along it.
MOST_JOINT_SWEEPS, SWEEPS_PER_JOINT = 60, 10
# The largest correction of joints, as a share of their size, after which sweeps end: a tenth of what is looked for.
_SMALL = 1e-6
# The same where there are no contacts.
_EXACT = 1e-9
# Sweeps over joints for one over contacts, at most: these take twenty times as long.
_INNER = 20


class RowSolver:
    """Solves the rows of contacts, and those of joints with them.

    Attributes
    ----------
    left : what the last sweep over contacts changed, in gaps
    """

    def __init__(
        self, nodes: Nodes, rigid: RigidBodies, gravity: NDArray[np.float64], pieces: NDArray[np.int32]
    ) -> None:
        self._nodes, self._rigid = nodes, rigid
        self._gravity = math.hypot(*gravity)
        self.left = 0.0
        self.islands = Islands.of(nodes.of_pieces(pieces), pieces[rigid.control[:, 0]])

    def solve_joined(self, rows: NDArray[np.void], count: int, joints: JointProjection, h: float) -> None:
        """Solve the rows of contacts and of joints."""
        nodes, rigid = self._nodes, self._rigid
        moving = Moving(nodes.x, nodes.begin, nodes.v, nodes.impulses, nodes.bodies, rigid.control, rigid.welds)
        find_islands(nodes.x, rows, count, self.islands)
        contacts = (rows, count, self.islands, self.tolerances(h)) if count else None
        at_once = MOST_LINEARIZATIONS if joints.at_once else 1
        for first in range(0, MOST_LINEARIZATIONS, at_once):
            joints.evaluate_others(nodes.x)
            turns = first, first + at_once
            done, self.left = solve_joined(moving, nodes.embedded, contacts, joints.record, joints.substep, h, turns)
            if done:
                break

    def tolerances(self, h: float) -> tuple[float, float]:
        """What the last sweep over the rows may change, in gaps, and in islands with rigid bodies [m]."""
        fall = self._gravity * h**2
        return ROW_RESIDUAL, RIGID_RESIDUAL * fall if fall > 0.0 else math.inf


class Moving(NamedTuple):
    """What moves, as of `Nodes` and `RigidBodies`."""

    x: NDArray[np.float64]
    begin: NDArray[np.float64]
    v: NDArray[np.float64]
    impulses: NDArray[np.float64]
    bodies: Bodies
    control: NDArray[np.int32]
    welds: Welds


@njit(cache=True)
def solve_joined(moving, embedded, contacts, joints, substep, h, turns):
    """Solve the rows of contacts and of joints in a substep of h [s].

    Rows of joints are linear in small turns of bodies. They are linearized again at the same places, from the first of
    two `turns` to the last, until none is off by more than a share of its joint's size. Without contacts this is half
    the square of the largest turn: what the linear rows leave out.

    Returns whether none is off, and what the last sweep over contacts changed, in gaps.
    """
    x, bodies, n, left, off = moving.x, moving.bodies, len(moving.impulses), 0.0, 0.0
    constants, functions, joint_rows = joints.joints, joints.functions, joints.rows
    if turns[0] == 0:
        begin_rows(constants, functions, joint_rows, joints.step[substep], joints.given[substep])
    offsets = joints.offsets[substep + 1]
    most = max(MOST_JOINT_SWEEPS, SWEEPS_PER_JOINT * len(moving.control))
    for turn in range(turns[0], turns[1]):
        linearize(constants, functions, joint_rows, offsets, x, moving.begin, bodies.arms, bodies.w, bodies.J, h)
        before = x[:n, :3].copy()
        if contacts is None:
            off = _sweep_alone(joint_rows, bodies.twists, most)
        else:
            enough = JOINT_EXACT if turn else 0.0
            off, left = _sweep_both(x, bodies, moving.begin, contacts, joint_rows, enough, most)
        _take_over(moving, embedded, joint_rows, before, h)
        note_rows(constants, functions, joint_rows, x, h)
        if off <= JOINT_EXACT:
            return True, left
    return False, left


@njit(forceinline=False)
def _sweep_both(x, bodies, begin, contacts, joints, enough, most):
    """Sweep over joints and contacts in turn until both change little, at most this many times; see `solve`.

    enough : contacts are left alone if joints need smaller corrections, as shares of their size

    Returns the largest correction of joints in the first turn, and what the last sweep over contacts changed, in gaps.
    """
    rows, count, islands, tolerances = contacts
    first, residual = np.inf, 0.0
    hold_bodies(x, bodies, rows, count)
    for turn in range(most):
        largest = 0.0
        for k in range(_INNER):
            off = sweep_joints(joints, bodies.twists, k)
            largest = max(largest, off)
            if off <= _SMALL:
                break
        if turn == 0:
            first = largest
            if first <= enough:
                break
        _, residual = solve(x, bodies, begin, rows, count, islands, tolerances, (1, 1))
        if largest <= _SMALL and residual <= tolerances[0] and islands.changes.max() <= tolerances[1]:
            break
    return first, residual


@njit(forceinline=False)
def _sweep_alone(joints, twists, most):
    """Sweep over joints, at most this many times; returns half of the square of the largest turn."""
    for turn in range(most):
        if sweep_joints(joints, twists, turn) <= _EXACT:
            break
    largest = 0.0
    for b in range(len(twists)):
        largest = max(largest, twists[b, 3] ** 2 + twists[b, 4] ** 2 + twists[b, 5] ** 2)
    return 0.5 * largest


@njit(forceinline=False)
def _take_over(moving, embedded, joints, before, h):
    """Give velocities the changes of places since `before` (n, 3), and of bodies.

    Impulses of contacts get what joints did not do.
    """
    x, v, bodies = moving.x, moving.v, moving.bodies
    for i in range(len(before)):
        for j in range(3):
            change = (x[i, j] - before[i, j]) / h
            v[i, j] += change
            moving.impulses[i, j] += change
    of_joints = np.zeros_like(bodies.twists)
    for k in range(len(joints)):
        r = joints[k]
        for side in range(2):
            b = r.bodies[side]
            for i in range(6 if b >= 0 else 0):
                of_joints[b, i] += r.impulse * r.answers[side, i]
    for sign in (-1.0, 1.0):
        for b in range(len(moving.control)):
            turn = (of_joints[b, 3], of_joints[b, 4], of_joints[b, 5])
            for i in moving.control[b]:
                turned = cross(turn, row(bodies.arms, i))
                for j in range(3):
                    moving.impulses[i, j] += sign * v[i, j]
                    if sign < 0.0:
                        moving.impulses[i, j] -= (of_joints[b, j] + turned[j]) / h
        if sign < 0.0:
            take_twists(v, moving.control, bodies, h)
            advance(x, moving.begin, v, moving.control, h)
            follow_welds(moving.welds, x, v)
            place_nodes(x, embedded[0], embedded[1], embedded[2])
