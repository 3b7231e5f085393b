"""Stitches of single vertices to a triangle that stands still: where they come to rest, in both solvers."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.model.state import Status
from supple.model.system import PinRange, System
from supple.scene.stitches.side import Side
from supple.scene.stitches.stitching import no_stitching
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.energies.stitches import StitchEnergy
from supple.solvers.implicit.energies.vertex_potential import inertia as inertia_of
from supple.solvers.implicit.inversion_guard import InversionGuard
from supple.solvers.implicit.newton.direction import Tools
from supple.solvers.implicit.newton.free_motion import FreeMotion
from supple.solvers.implicit.newton.linear_solver import LinearSolver
from supple.solvers.implicit.newton.minimize import Convergence, Problem, minimize
from supple.solvers.implicit.newton.objective import Objective
from supple.solvers.implicit.step_limits import StepLimits
from supple.solvers.xpbd.constraints.stitches import stitch_constraints
from supple.solvers.xpbd.damping.elements import matrices_of_tets, viscous_tets


def side(points, triangles=()):
    points, triangles = np.asarray(points, dtype=float), np.array(triangles, dtype=np.int32).reshape(-1, 3)
    edges = np.zeros((0, 2), dtype=np.int32)
    return Side("side", points, triangles, edges, np.arange(len(points), dtype=np.int32))


def stitched_system(vertices, triangle, **stitch):
    """A System of the vertices [1 kg], then the triangle's, which are pinned; and where everything is."""
    described = sp.SoftVertexTriangleStitch("vertices", "triangle", youngs=1.2e5, poisson=0.49, **stitch)
    first, second = side(vertices), side(triangle, [[0, 1, 2]])
    pairs = described.find(first, second)
    count = len(vertices)
    numbers = np.arange(count, dtype=np.int32), np.arange(count, count + 3, dtype=np.int32)
    tets = described.join(first, second, pairs).numbered(*numbers)
    x = np.concatenate([first.points, second.points])
    n = len(x)
    held = np.arange(count, n, dtype=np.int32)
    system = System(
        scene=sp.Scene([sp.Body("unused", sp.shapes.box(), sp.NeoHookean(youngs=1.0, poisson=0.3))]),
        bodies=(),
        pins=(PinRange(sp.Pin("triangle", held - count), held, second.points),),
        rest_positions=x,
        masses=np.ones(n),
        tets=np.zeros((0, 4), np.int32),
        rest_shape_inverse=np.zeros((0, 3, 3)),
        rest_volumes=np.zeros(0),
        edges=np.zeros((0, 2), np.int32),
        rest_lengths=np.zeros(0),
        triangles=np.zeros((0, 3), np.int32),
        components=np.arange(n, dtype=np.int32),
        gravity=np.zeros(3),
        stitching=replace(no_stitching(n), tets=tets),
    )
    return system, x, pairs


def by_newton(system, x, h=0.05, steps=200):
    """Backward Euler, which loses energy; all positions."""
    linear = LinearSolver.of(system, "direct")
    hessian = HessianBlocks.zeros(0, len(x), len(system.stitching))
    tools = Tools(linear, hessian, system.pinned_vertices, FreeMotion.of(system))
    # Nothing is guarded: stitch tets are not.
    limits = StepLimits(InversionGuard(system, np.zeros(0, dtype=np.bool_), complete=True), None, tools.clock)
    stitches = StitchEnergy.of(system.stitching, 0.0)
    v = np.zeros_like(x)
    path = [x]
    for _ in range(steps):
        objective = Objective([stitches, inertia_of(system.masses, x + h * v, h * h)])
        outcome = minimize(Problem(objective, h * h, Convergence(1e-10, 1e-4), 60, 1.0), x, limits, tools)
        assert outcome.status is Status.CONVERGED, outcome.message
        v = (outcome.end.positions - x) / h
        x = outcome.end.positions
        path.append(x)
    return np.array(path)


def by_xpbd(system, x, h=1 / 1200, steps=2_000):
    """Substeps without bodies; the viscous forces of the stitches are solved for exactly."""
    w = system.inverse_masses
    (constraints,) = stitch_constraints(system, w)
    tets = viscous_tets(system, w)
    assert len(tets.tau)
    free = np.flatnonzero(w > 0.0)
    inertia = np.diag(np.repeat(1.0 / w[free], 3))
    points, v = np.column_stack([x, w]), np.zeros_like(x)
    path = [x]
    for _ in range(steps):
        before = points[:, :3].copy()
        K = np.zeros((len(x), 3, len(x), 3))
        matrices = matrices_of_tets(before - 0.5 * h * v, tets.vertices, tets.constants(), h)
        for nodes, matrix in zip(tets.vertices, matrices.reshape(-1, 4, 3, 4, 3), strict=True):
            K[nodes[:, None], :, nodes] += matrix.transpose(0, 2, 1, 3)
        A = inertia + h * K[free][:, :, free].reshape(inertia.shape)
        v[free] = np.linalg.solve(A, inertia @ v[free].ravel()).reshape(-1, 3)
        points[:, :3] += h * v
        constraints.project(points, h)
        v = (points[:, :3] - before) / h
        path.append(points[:, :3].copy())
    return np.array(path)


SOLVERS = pytest.mark.parametrize(("solve", "damping"), [(by_newton, 0.0), (by_xpbd, 0.1)], ids=["implicit", "xpbd"])


@SOLVERS
def test_a_vertex_in_the_plane_settles_at_the_separate_distance_along_the_normal(solve, damping):
    triangle = [(-0.5, 1, -0.5), (0.5, 1, -0.5), (-0.5, 1, 0.5)]  # its normal is -y
    system, x, _ = stitched_system(
        [(0, 1, 0)], triangle, pairs=[[0, 0]], min_separate_distance=0.05, damping=damping, name="in plane"
    )
    assert system.stitching.tets.offset.all()
    path = solve(system, x)
    assert np.array_equal(path[:, 1:], np.broadcast_to(x[1:], path[:, 1:].shape))
    assert np.abs(path[:, 0, [0, 2]]).max() < 1e-3
    assert path[-1, 0, 1] == pytest.approx(0.95, abs=1e-3)
    assert np.abs(path[-1] - path[-2]).max() < 1e-6, "it has settled"
