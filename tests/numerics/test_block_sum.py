"""Element matrices and couplings that come and go, summed into one block matrix, against dense sums."""

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.derivatives import dense_couplings

import supple as sp
from supple.model.system import build_system
from supple.numerics.sparse.block_csr import build_pattern
from supple.numerics.sparse.block_sum import JointPattern
from supple.numerics.sparse.couplings import Couplings
from supple.runtime.threads import numba_threads
from supple.solvers.implicit.energies.potential import HessianBlocks
from supple.solvers.implicit.newton.free_motion import FreeMotion
from supple.solvers.implicit.newton.linear_solver import LinearSolver


def random_couplings(rng, n, count):
    """`count` random blocks; some of a vertex with itself, some pairs twice."""
    rows, columns = (rng.integers(0, n, count).astype(np.int32) for _ in range(2))
    blocks = rng.normal(size=(count, 3, 3))
    own = rows == columns
    blocks[own] += blocks[own].transpose(0, 2, 1)
    return Couplings(rows, columns, blocks)


def random_elements(rng, n, count):
    """Random tets of n vertices with symmetric matrices, per-vertex matrices, and the sum of all as a dense matrix."""
    elements = np.array([rng.choice(n, 4, replace=False) for _ in range(count)], dtype=np.int32)
    factors = rng.normal(size=(count, 12, 12))
    matrices = factors + factors.transpose(0, 2, 1)
    own = rng.normal(size=(n, 3, 3))
    own += own.transpose(0, 2, 1)
    dense = np.zeros((n, 3, n, 3))
    for element, matrix in zip(elements, matrices.reshape(count, 4, 3, 4, 3), strict=True):
        for a in range(4):
            for b in range(4):
                dense[element[a], :, element[b]] += matrix[a, :, b]
    for v in range(n):
        dense[v, :, v] += own[v]
    return elements, matrices, own, dense.reshape(3 * n, 3 * n)


def rows_of(rng, n, pinned):
    """A random row for each vertex but the pinned ones, and the vertex of each row."""
    row_of = np.full(n, -1, dtype=np.int32)
    free = rng.permutation(n)[pinned:]
    row_of[free] = rng.permutation(len(free)).astype(np.int32)
    return row_of, free[np.argsort(row_of[free])]


def assembled(joint, matrices, own, couplings):
    places = joint.places(couplings)
    assert places is not None
    data = np.full((joint.pattern.blocks, 3, 3), np.nan)
    joint.assemble(matrices, own, couplings.blocks, places, data)
    return data


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**31), n=st.integers(4, 30), pinned=st.integers(0, 3), pairs=st.integers(0, 40))
def test_the_sum_is_the_dense_one(seed, n, pinned, pairs):
    rng = np.random.default_rng(seed)
    row_of, vertex_of = rows_of(rng, n, pinned)
    elements, matrices, own, dense = random_elements(rng, n, 6)
    couplings = random_couplings(rng, n, pairs)
    base = build_pattern(row_of[elements], len(vertex_of))
    joint = JointPattern.of(base, couplings, row_of)
    data = assembled(joint, matrices, own[vertex_of], couplings)
    p = joint.pattern
    scalar = (3 * vertex_of[:, None] + np.arange(3)).ravel()
    expected = (dense + dense_couplings([couplings], n))[np.ix_(scalar, scalar)]
    summed = p.to_scipy(data).toarray()
    assert np.abs(summed - expected).max() <= 1e-13 * np.abs(expected).max()
    assert np.array_equal(summed, summed.T)
    row = np.repeat(np.arange(p.rows), np.diff(p.row_start))
    for i in range(p.rows):
        assert (np.diff(p.columns[p.row_start[i] : p.row_start[i + 1]]) > 0).all()  # ascending, none twice
    assert np.array_equal(p.columns[p.diagonal], np.arange(p.rows))
    assert np.array_equal(row[p.mirror], p.columns)
    assert np.array_equal(p.columns[p.mirror], row)


def test_without_couplings_the_sum_has_the_bits_of_the_elements():
    rng = np.random.default_rng(0)
    row_of = np.arange(12, dtype=np.int32)
    elements, matrices, own, _ = random_elements(rng, 12, 9)
    base = build_pattern(elements, 12)
    nothing = Couplings.joined([])
    joint = JointPattern.of(base, nothing, row_of)
    alone = np.empty((base.blocks, 3, 3))
    base.assemble(matrices, own, alone)
    assert np.array_equal(joint.pattern.columns, base.columns)
    assert np.array_equal(assembled(joint, matrices, own, nothing), alone)


def test_a_pattern_serves_all_couplings_that_have_blocks_in_it():
    rng = np.random.default_rng(1)
    elements, matrices, own, dense = random_elements(rng, 20, 5)
    row_of = np.arange(20, dtype=np.int32)
    many = random_couplings(rng, 20, 30)
    few = Couplings(many.columns[7:12], many.rows[7:12], many.blocks[7:12].transpose(0, 2, 1).copy())
    joint = JointPattern.of(build_pattern(elements, 20), many, row_of)
    data = joint.pattern.to_scipy(assembled(joint, matrices, own, few)).toarray()
    expected = dense + dense_couplings([few], 20)
    assert np.abs(data - expected).max() <= 1e-13 * np.abs(expected).max()
    small = JointPattern.of(build_pattern(elements, 20), few, row_of)
    assert small.places(many) is None


def test_couplings_of_pinned_vertices_are_left_out():
    rng = np.random.default_rng(1)
    row_of = np.array([0, 1, 2, 3, -1, -1], dtype=np.int32)
    pattern = build_pattern(np.array([[0, 1, 2, 3]], dtype=np.int32), 4)
    pairs = np.array([[0, 4], [4, 5], [5, 5]], dtype=np.int32)
    joint = JointPattern.of(pattern, Couplings(*pairs.T.copy(), rng.normal(size=(3, 3, 3))), row_of)
    assert np.array_equal(joint.pattern.columns, pattern.columns)
    assert np.array_equal(joint.pattern.row_start, pattern.row_start)


def test_any_number_of_threads_gives_the_bits_of_one():
    rng = np.random.default_rng(5)
    n = 3_000
    elements, matrices, own, _ = random_elements(rng, 40, 60)
    elements = np.concatenate([elements + 40 * k for k in range(n // 40)]).astype(np.int32)
    matrices = np.concatenate([matrices] * (n // 40))
    own = rng.normal(size=(n, 3, 3))
    couplings = random_couplings(rng, n, 9_000)
    joint = JointPattern.of(build_pattern(elements, n), couplings, np.arange(n, dtype=np.int32))
    before = numba.get_num_threads()
    results = []
    for threads in (1, before):
        with numba_threads(threads):
            results.append(assembled(joint, matrices, own, couplings))
    assert np.array_equal(*results)


def test_products_are_those_of_the_dense_matrix():
    rng = np.random.default_rng(3)
    couplings = random_couplings(rng, 9, 30)
    x, out = rng.normal(size=(9, 3)), np.ones((9, 3))
    couplings.add_product(x, out)
    expected = 1.0 + (dense_couplings([couplings], 9) @ x.ravel()).reshape(-1, 3)
    assert np.abs(out - expected).max() < 1e-13 * np.abs(expected).max()


def two_cubes():
    material = sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=1000.0)
    mesh = sp.shapes.box((1, 1, 1), (2, 2, 2))
    bodies = [sp.Body("one", mesh, material), sp.Body("two", mesh, material, position=(2, 0, 0))]
    return build_system(sp.Scene(bodies, pins=[sp.Pin("one", [0, 1, 2])]))


@pytest.mark.parametrize("kind", ["pcg", "auto"])
def test_systems_with_couplings_are_solved_as_directly(kind):
    rng = np.random.default_rng(2)
    system = two_cubes()
    n, m = len(system.rest_positions), len(system.tets)
    solvers = [LinearSolver.of(system, name) for name in (kind, "direct")]
    for solver in solvers:
        solver.begin_step()
    # Couplings that come, change, lie within the last ones, and go again.
    kept = None
    for count in (0, 5, 9, -4, 0, 7):
        hessian = HessianBlocks.zeros(m, n)
        factors = rng.normal(size=(m, 12, 12))
        hessian.elements[:] = factors @ factors.transpose(0, 2, 1)
        hessian.vertices[:] = 0.1 * np.eye(3)
        if count:
            # Positive semi-definite: springs between random vertices.
            ends = (rng.integers(0, n // 2, count), rng.integers(n // 2, n, count)) if count > 0 else kept
            kept = i, j = [side[: abs(count)].astype(np.int32) for side in ends]
            ones = 50.0 * np.broadcast_to(np.eye(3), (len(i), 3, 3))
            hessian.couplings.append(Couplings(np.concatenate([i, j]), np.concatenate([i, j]), np.repeat(ones, 2, 0)))
            hessian.couplings.append(Couplings(i, j, -ones))
        force = rng.normal(size=(n, 3))
        answers = []
        for solver in solvers:
            before = solver.joint
            solver.assemble(hessian)
            assert (solver.joint is before) == (count == -4 or (count == 0 and before is None))
            p, said = solver.solve(force, 1e-10)
            assert p is not None
            answers.append(p)
        assert said.method == "direct"
        assert (answers[0][:3] == 0.0).all()
        assert np.abs(answers[0] - answers[1]).max() < 1e-7 * np.abs(answers[1]).max()


def test_free_pieces_in_contact_move_as_one():
    mesh = sp.shapes.box((1, 1, 1), (1, 1, 1))
    material = sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=1000.0)
    bodies = [sp.Body(f"b{k}", mesh, material, position=(2 * k, 0, 0)) for k in range(6)]
    system = build_system(sp.Scene(bodies, pins=[sp.Pin("b5", [0])]))
    motion = FreeMotion.of(system)
    assert len(motion.totals) == 5
    first = [part.vertices.start for part in system.bodies]

    def touching(*pairs):
        ends = np.array([[first[a], first[b]] for a, b in pairs], dtype=np.int32)
        return Couplings(*ends.T.copy(), np.zeros((len(ends), 3, 3)))

    joined = motion.joined([touching((3, 1), (0, 0)), touching((1, 4), (2, 5))])
    pieces = [set(joined.piece[part.vertices].tolist()) for part in system.bodies]
    assert pieces == [{0}, {1}, {-1}, {1}, {1}, {-1}]
    assert joined.totals == pytest.approx([1000.0, 3000.0])
    rng = np.random.default_rng(4)
    direction, gradient = rng.normal(size=(2, len(system.rest_positions), 3))
    before = direction.copy()
    joined.correct(direction, gradient, 0.5)
    for piece, total in enumerate(joined.totals):
        inside = joined.piece == piece
        moved = (system.masses[inside, None] * direction[inside]).sum(axis=0)
        assert moved == pytest.approx(-0.5 * gradient[inside].sum(axis=0), rel=1e-9)
        assert np.ptp((direction - before)[inside], axis=0) == pytest.approx(0.0, abs=1e-12 / total)
    assert np.array_equal(direction[joined.piece < 0], before[joined.piece < 0])
