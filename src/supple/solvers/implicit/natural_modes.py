"""Natural modes: small undamped vibrations about a state, K phi = omega^2 M phi.

K is the true Hessian of all energies but contact, M the lumped masses, and x = x_0 + phi cos(omega t).
Pinned vertices do not move, welded ones follow their rigid bodies: with x = T y, both matrices are T^T A T. Joints and
the rigidity of rigid bodies are linear conditions C phi = 0. The spectrum is transformed about a shift s,

    [ K - s M   C^T   G ] [ phi    ]   [ M phi ]
    [ C          0    0 ] [ lambda ] = [   0   ] nu,    omega^2 = s + 1 / nu,
    [ G^T        0   -1 ] [ q      ]   [   0   ]

with the columns G of what actuators add, G G^T, so that the matrix is sparse. Where nothing holds a body K is singular:
s is below zero, and modes of rigid motions have a frequency of zero up to round-off.

Source: Ericsson, Ruhe, "The spectral transformation Lanczos method" (1980); Bathe, "Finite Element Procedures" (2014),
chapters 10 and 11.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, null_space, qr
from scipy.sparse import block_array, coo_array, csr_array, diags_array, eye_array, kron
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

from supple.errors import SolverError
from supple.model.joints.functions import derivatives
from supple.model.state import State
from supple.model.system import System
from supple.numerics.sparse.couplings import Couplings
from supple.solvers.implicit.contact.settings import IPCContact
from supple.solvers.implicit.energies.joints import JointPotential
from supple.solvers.implicit.energies.loads.actuators import actuators_at
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms
from supple.solvers.implicit.solver import Implicit
from supple.solvers.implicit.stepping.integrators import Static
from supple.solvers.implicit.stepping.joint_step import JointStep
from supple.solvers.implicit.stepping.substep import stored_and_loaded

Sparse = Any  # SciPy's sparse arrays, whose types are not complete

# -s as a share of the largest frequency's square. A body of L / h elements has its first bending mode near (h / L)^4,
# 1e-8 for a hundred of them, and round-off moves zero by 1e-16 of the largest.
_SHIFT = 1e-10
# Up to so many unknowns all eigenvalues are found at once; the method of Lanczos needs more than it finds.
_DENSE = 400

_HELD = "modes: everything is held, by pins, welds or joints, so that nothing can vibrate; release something"


@dataclass(frozen=True, eq=False)
class _Problem:
    """K and M (u, u) of the unknowns, C (c, u), G (u, g), and T (3 n, u)."""

    K: Sparse
    M: Sparse
    C: Sparse
    G: Sparse
    T: Sparse


def natural_modes(system: System, state: State, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lowest modes about a state, in the order of omega^2.

    Returns
    -------
    frequencies : (count,) [Hz]; -f where omega^2 = -(2 pi f)^2, and the state is unstable
    shapes : (count, n, 3) displacements of the system's vertices, with phi^T M phi = 1 [kg^-1/2]

    Raises
    ------
    SolverError : where there are fewer modes, or they were not found; and as `Implicit.prepare` for what it refuses.
    """
    if system.shells is not None:
        raise SolverError("modes: those of shells are not computed; take them out of the scene")
    pinned = np.zeros(len(system.rest_positions), dtype=bool)
    pinned[system.pinned_vertices] = True
    if pinned.all():
        raise SolverError(_HELD)
    given = _problem(system, state)
    free = given.K.shape[0] - given.C.shape[0]
    if free <= 0:
        raise SolverError(_HELD)
    if given.K.shape[0] <= _DENSE:
        squares, vectors = _all_modes(given)
    elif count > free // 2:
        raise SolverError(f"modes: {count} modes of a scene that has {free}; ask for at most {free // 2}")
    else:
        squares, vectors = _lowest_modes(given, count)
    if len(squares) < count:
        raise SolverError(f"modes: {count} modes of a scene that has {len(squares)}; ask for at most that many")
    order = np.argsort(squares)[:count]
    squares, vectors = squares[order], vectors[:, order]
    shapes = (given.T @ vectors).T.reshape(count, -1, 3)[:, : len(state.positions)]
    return np.sign(squares) * np.sqrt(np.abs(squares)) / (2.0 * np.pi), np.ascontiguousarray(shapes)


def _problem(system: System, state: State) -> _Problem:
    solver = Implicit(contact=IPCContact() if system.obstacles else None)
    space = solver.prepare(system)
    solver.refuse(system)
    whole, extended = space.system, space.extended(state)
    x, time = extended.positions, state.time
    plan = Static().plan(whole, extended, 1.0)
    elasticity = space.elasticity_at(time).in_step(state.internal, 0.0)
    actuators = actuators_at(whole, x, (time, time), None, elasticity.material.mu)
    objective = stored_and_loaded(elasticity, x, time, plan, np.zeros_like(x), space, actuators)
    conditions = [_rigidity(whole, x)]
    if space.joints is not None:
        joints = JointStep.of(space.joints, extended, (time, time), None).potential
        objective = replace(objective, terms=[*objective.terms, joints])
        conditions.append(joint_conditions(joints, x))
    hessian = space.tools.hessian
    objective.model(x, hessian, ProjectedTerms.NONE)
    T = unknowns(whole)
    K = T.T @ hessian_matrix(hessian, whole.elements, len(x)) @ T
    M = T.T @ diags_array(np.repeat(whole.masses, 3)) @ T
    C = (stacked(conditions, x.size) @ T).tocsr()
    C = C[independent(C)]
    scale = float(K.diagonal().max()) / np.maximum(np.sqrt(C.multiply(C).sum(axis=1)), np.finfo(float).tiny)
    columns = [csr_array((x.size, 0)), *(column(part.vertices, part.vector, x.size) for part in hessian.low_rank)]
    G = T.T @ block_array([columns])
    return _Problem(csr_array(K), csr_array(M), csr_array(diags_array(scale) @ C), csr_array(G), T)


def unknowns(system: System) -> Sparse:
    """T (3 n, 3 u): displacements of all vertices by those of the ones that are neither pinned nor welded."""
    welding, n = system.welding, len(system.rest_positions)
    free = np.ones(n, dtype=bool)
    free[system.pinned_vertices] = False
    free[welding.vertices] = False
    kept = np.flatnonzero(free)
    number = np.full(n, -1)
    number[kept] = np.arange(len(kept))
    rows = np.concatenate([kept, np.repeat(welding.vertices, 4)])
    columns = np.concatenate([number[kept], number[welding.control.ravel()]])
    weights = np.concatenate([np.ones(len(kept)), welding.weights.ravel()])
    moves = columns >= 0
    by_vertex = coo_array((weights[moves], (rows[moves], columns[moves])), shape=(n, len(kept)))
    return csr_array(kron(by_vertex, np.eye(3)))


def hessian_matrix(hessian: HessianBlocks, elements: NDArray[np.int32], n: int) -> Sparse:
    """(3 n, 3 n) the sparse part of a Hessian."""
    blocks = hessian.elements.reshape(-1, 4, 3, 4, 3).transpose(0, 1, 3, 2, 4).reshape(-1, 3, 3)
    i, j = np.repeat(elements, 4, axis=1).ravel(), np.tile(elements, (1, 4)).ravel()
    used = (i >= 0) & (j >= 0)
    own = np.arange(n)
    rows, columns, parts = [i[used], own], [j[used], own], [blocks[used], hessian.vertices]
    beyond = Couplings.joined(hessian.beyond_elements)
    two = beyond.rows != beyond.columns
    rows += [beyond.rows, beyond.columns[two]]
    columns += [beyond.columns, beyond.rows[two]]
    parts += [beyond.blocks, beyond.blocks[two].transpose(0, 2, 1)]
    p, q = np.concatenate(rows)[:, None, None], np.concatenate(columns)[:, None, None]
    k = np.arange(3)
    p, q = np.broadcast_arrays(3 * p + k[:, None], 3 * q + k)
    return csr_array(coo_array((np.concatenate(parts).ravel(), (p.ravel(), q.ravel())), shape=(3 * n, 3 * n)))


def _rigidity(system: System, x: NDArray[np.float64]) -> Sparse:
    """The changes of the six distances between the control points of each rigid body."""
    pairs = np.array(list(combinations(range(4), 2)))
    ends = [pairs + part.vertices.start for part in system.rigid_bodies]
    i, j = np.concatenate([np.zeros((0, 2), dtype=np.int64), *ends]).T
    way = x[i] - x[j]
    k = np.arange(len(i))
    rows, signs = np.concatenate([k, k]), np.concatenate([way, -way])
    return conditions_of(rows, np.concatenate([i, j]), signs, len(k), x.size)


def joint_conditions(joints: JointPotential, x: NDArray[np.float64]) -> Sparse:
    """What joints, and motors without a stiffness, hold."""
    geometry, differences = joints.geometry, joints.geometry.differences
    along = np.eye(3)[None, :, None, :] * differences.coefficients[:, None, :, None]  # [row, axis, corner, coordinate]
    parts = [(differences.joint, along)]
    if len(joints.laws.table):
        g = joints.coordinates(x)[joints.laws.table["function"]]
        held = joints.laws.table["adapts"] & (joints.laws.stiffness(g, joints.law_multipliers) > 0.0)
        rows = np.unique(joints.laws.table["function"][held])
        gradient = derivatives(geometry.functions, joints.arguments(x)).gradient[rows]
        by_corner = np.einsum("sai,sak->ski", gradient, geometry.arguments.coefficients[rows])
        parts.append((geometry.arguments.joint[rows], by_corner[:, None]))
    found = []
    for joint, values in parts:
        count = values.shape[0] * values.shape[1]
        corners = np.repeat(geometry.corners[joint], values.shape[1], axis=0)
        rows = np.repeat(np.arange(count), 8)
        found.append(conditions_of(rows, corners.ravel(), values.reshape(-1, 3), count, x.size))
    return stacked(found, x.size)


def conditions_of(
    rows: NDArray[np.int64], vertices: NDArray[np.integer], vectors: NDArray[np.float64], count: int, size: int
) -> Sparse:
    """(count, size) with vectors (k, 3) in the columns of vertices (k,)."""
    columns = 3 * np.asarray(vertices)[:, None] + np.arange(3)
    places = np.repeat(rows, 3), columns.ravel()
    return csr_array(coo_array((vectors.ravel(), places), shape=(count, size)))


def stacked(parts: Sequence[Sparse], size: int) -> Sparse:
    return csr_array(block_array([[part] for part in (csr_array((0, size)), *parts)]))


def column(vertices: NDArray[np.integer], vector: NDArray[np.float64], size: int) -> Sparse:
    return conditions_of(np.zeros(len(vertices), dtype=np.int64), vertices, vector, 1, size).T.tocsr()


def independent(C: Sparse) -> NDArray[np.int64]:
    """Rows of C that are independent: closed chains of joints, and joints with what is pinned, repeat conditions."""
    used = np.flatnonzero(np.abs(C).sum(axis=0))
    dense = C[:, used].toarray()
    sizes = np.linalg.norm(dense, axis=1)
    dense = dense[sizes > 0.0] / sizes[sizes > 0.0, None]
    if not len(dense):
        return np.zeros(0, dtype=np.int64)
    factors: Any = qr(dense.T, mode="r", pivoting=True)
    R, order = factors
    rank = int((np.abs(np.diag(R)) > 1e-9 * abs(R[0, 0])).sum())
    return np.sort(np.flatnonzero(sizes > 0.0)[order[:rank]])


def _all_modes(given: _Problem) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """All squares of omega, and vectors (u, count), by dense matrices."""
    Z = null_space(given.C.toarray()) if given.C.shape[0] else np.eye(given.K.shape[0])
    K = given.K.toarray() + (given.G @ given.G.T).toarray()
    squares, y = eigh(Z.T @ K @ Z, Z.T @ given.M.toarray() @ Z)
    return squares, Z @ y


def _lowest_modes(given: _Problem, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lowest ones by the method of Lanczos."""
    K, M, C, G = given.K, given.M, given.C, given.G
    shift = -_SHIFT * float((K.diagonal() / M.diagonal()).max())
    c, g, size = C.shape[0], G.shape[1], K.shape[0]
    plain = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    if c + g:
        A = block_array([[K - shift * M, C.T, G], [C, None, csr_array((c, g))], [G.T, None, -eye_array(g)]])
    else:
        A = K - shift * M
    try:
        factors = splu(A.tocsc(), **({} if c + g else plain))
    except RuntimeError as error:
        raise SolverError(f"modes: the stiffness matrix could not be factorized ({error})") from None
    zeros = np.zeros(c + g)

    def inverse(b: NDArray[np.float64]) -> NDArray[np.float64]:
        return factors.solve(np.concatenate([b.ravel(), zeros]))[:size]

    start = np.random.default_rng(0).standard_normal(size)
    operator = LinearOperator((size, size), matvec=inverse, dtype=np.float64)  # pyright: ignore[reportCallIssue]
    try:
        squares, vectors = eigsh(K, count, M=M, sigma=shift, OPinv=operator, v0=inverse(M @ start))
    except ArpackError as error:
        raise SolverError(f"modes: the method of Lanczos did not converge ({error}); ask for other modes") from None
    return squares, vectors
