"""The solution of the rows of a substep, and what velocities take over from it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.numerics.cross_rows import cross_rows
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.islands import Islands, find_islands
from supple.solvers.xpbd.contact.levers import hold_bodies
from supple.solvers.xpbd.contact.nodes import Nodes
from supple.solvers.xpbd.contact.rows import Rows
from supple.solvers.xpbd.contact.solve import solve
from supple.solvers.xpbd.rigid.bodies import RigidBodies
from supple.solvers.xpbd.rigid.joint_rows import JointRows, solve_joints, sweep_joints

# Of the gap: what the last sweep over the rows may change; the most sweeps.
RESIDUAL, MOST_SWEEPS = 0.02, 4
# The same of rigid bodies, which nothing else corrects: of the fall in a substep, and the most sweeps. In a heap of 200
# boxes neither 10 nor 60 sweeps are enough; impulses that are kept go on with them.
RIGID_RESIDUAL, MOST_RIGID_SWEEPS = 0.0001, 10
# Rows are solved again with bodies where they are while these turn by more than this [rad], at most so often.
MOST_TURNS, SMALL_TURN = 4, 2e-3
# With joints, and for each joint where that is more: what pulls at a chain has to go along it.
MOST_JOINT_SWEEPS, SWEEPS_PER_JOINT = 60, 10
# The largest correction of joints, as a share of their size, after which sweeps end: a tenth of what is looked for.
_SMALL = 1e-6
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

    def solve(self, rows: Rows, count: int, h: float) -> float:
        """Solve the first `count` rows in a substep of h [s]; returns `left`."""
        find_islands(self._nodes.x, rows, count, self.islands)
        return self._swept(rows, count, h, (MOST_SWEEPS, MOST_RIGID_SWEEPS))

    def sweep(self, rows: Rows, count: int, h: float) -> None:
        """Sweep once over the rows of active islands, as they were in the solution."""
        self._swept(rows, count, h, (1, 1))

    def _swept(self, rows: Rows, count: int, h: float, most: tuple[int, int]) -> float:
        if not count:
            self.islands.residual[:] = 0.0
            return 0.0
        nodes = self._nodes
        for _ in range(MOST_TURNS):
            x = self._prepared(rows, count)
            contacts = nodes.x, nodes.bodies, nodes.begin, rows, count, self.islands
            _, self.left = solve(*contacts, self._tolerances(h), most)
            turns = (nodes.bodies.twists[:, 3:] ** 2).sum(axis=1).max(initial=0.0)
            self._take_over(x, h)
            if not turns > SMALL_TURN**2:
                break
        return self.left

    def solve_joined(
        self, rows: Rows, count: int, joints: JointRows, h: float, enough: float
    ) -> tuple[NDArray[np.float64], float]:
        """Solve the rows of contacts and of joints; the joints' impulses (r,) [kg m], and by how much joints were off.

        The latter as a share of their size; contacts are left alone if that is `enough`. Without contacts it is half
        the square of the largest turn: what the linear rows leave out.
        """
        nodes, impulses = self._nodes, np.zeros(len(joints.total))
        x = self._prepared(rows, count)
        most, off = max(MOST_JOINT_SWEEPS, SWEEPS_PER_JOINT * len(np.unique(joints.bodies))), 0.0
        find_islands(nodes.x, rows, count, self.islands)
        if count:
            contacts = nodes.x, nodes.bodies, nodes.begin, rows, count, self.islands
            off, self.left = solve_joined(*contacts, joints, impulses, enough, self._tolerances(h), most)
        else:
            solve_joints(joints, impulses, nodes.bodies.twists, most)
            off = 0.5 * float((nodes.bodies.twists[:, 3:] ** 2).sum(axis=1).max(initial=0.0))
        twists = np.zeros((len(self._rigid) + 1, 6))
        np.add.at(twists, joints.bodies, impulses[:, None, None] * joints.answers)
        of_joints = twists[:-1, None]
        arms = nodes.bodies.arms[self._rigid.control]
        self._take_over(x, h, (of_joints[..., :3] + cross_rows(of_joints[..., 3:], arms)) / h)
        return impulses, off

    def _prepared(self, rows: Rows, count: int) -> NDArray[np.float64]:
        """Prepare the rows for a solution from the places as they are; a copy (n, 3) of these."""
        nodes = self._nodes
        if len(self._rigid):
            hold_bodies(nodes.x, nodes.bodies, rows, count)
        return nodes.x[: len(nodes.impulses), :3].copy()

    def _tolerances(self, h: float) -> tuple[float, float]:
        """What the last sweep over the rows may change, in gaps, and in islands with rigid bodies [m]."""
        fall = self._gravity * h**2
        return RESIDUAL, RIGID_RESIDUAL * fall if fall > 0.0 else math.inf

    def _take_over(self, x: NDArray[np.float64], h: float, of_joints: NDArray[np.float64] | None = None) -> None:
        """Give velocities the changes of places since x (n, 3), and of bodies.

        of_joints : (b, 4, 3) the part of the control points' changes that is not one of contacts [m/s]
        """
        nodes, n = self._nodes, len(x)
        changes = (nodes.x[:n, :3] - x) / h
        nodes.v[:n] += changes
        nodes.impulses += changes
        if len(self._rigid):
            control = self._rigid.control
            v = nodes.v[control]
            nodes.move_bodies(h)
            nodes.impulses[control] += nodes.v[control] - v - (0.0 if of_joints is None else of_joints)


@njit(cache=True)
def solve_joined(points, bodies, begin, rows, count, islands, joints, impulses, enough, tolerances, most):
    """Sweep over joints and contacts in turn until both change little, at most this many times; see `solve`.

    joints : their rows, with impulses (r,) [kg m], in place
    enough : contacts are left alone if joints need smaller corrections, as shares of their size

    Returns the largest correction of joints in the first turn, and what the last sweep over contacts changed, in gaps.
    """
    first, residual = np.inf, 0.0
    for turn in range(most):
        largest = 0.0
        for k in range(_INNER):
            off = sweep_joints(joints, impulses, bodies.twists, k)
            largest = max(largest, off)
            if off <= _SMALL:
                break
        if turn == 0:
            first = largest
            if first <= enough:
                break
        _, residual = solve(points, bodies, begin, rows, count, islands, tolerances, (1, 1))
        if largest <= _SMALL and residual <= tolerances[0] and islands.changes.max() <= tolerances[1]:
            break
    return first, residual
