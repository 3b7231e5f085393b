"""The sum of two block matrices of different patterns against SciPy's."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import bsr_matrix, coo_matrix

from supple.numerics.sparse.block_csr import build_pattern
from supple.numerics.sparse.block_sum import join


def random_symmetric(rng, n, count):
    """(3 n, 3 n) of symmetric pattern and values, in blocks, `count` random pairs of them."""
    i, j = rng.integers(0, n, count), rng.integers(0, n, count)
    blocks = rng.normal(size=(count, 3, 3))
    rows, columns = np.concatenate([i, j]), np.concatenate([j, i])
    data = np.concatenate([blocks, blocks.transpose(0, 2, 1)])
    # One scalar entry at a time: SciPy adds up what comes twice.
    r = (3 * rows[:, None, None] + np.arange(3)[None, :, None] + np.zeros((1, 1, 3), dtype=int)).ravel()
    c = (3 * columns[:, None, None] + np.zeros((1, 3, 1), dtype=int) + np.arange(3)[None, None, :]).ravel()
    return bsr_matrix(coo_matrix((data.ravel(), (r, c)), shape=(3 * n, 3 * n)).tocsr(), blocksize=(3, 3))


def base_of(rng, row_of, tets):
    """A pattern over the rows that vertices have, with random blocks, and the same as a SciPy matrix."""
    rows = int(row_of.max()) + 1
    elements = np.array([rng.choice(len(row_of), 4, replace=False) for _ in range(tets)], dtype=np.int32)
    pattern = build_pattern(row_of[elements].astype(np.int32), rows)
    data = rng.normal(size=(pattern.blocks, 3, 3))
    matrix = bsr_matrix((data, pattern.columns, pattern.row_start), shape=(3 * rows, 3 * rows))
    return pattern, data, matrix


def restricted(extra, row_of):
    """The rows and columns of a matrix over vertices that have a row, in the order of the rows."""
    held = np.flatnonzero(row_of >= 0)
    vertex = held[np.argsort(row_of[held])]
    scalar = (3 * vertex[:, None] + np.arange(3)).ravel()
    return extra.tocsr()[scalar][:, scalar]


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    n=st.integers(4, 30),
    pinned=st.integers(0, 3),
    pairs=st.integers(0, 40),
)
def test_the_sum_is_that_of_scipy(seed, n, pinned, pairs):
    rng = np.random.default_rng(seed)
    row_of = np.full(n, -1, dtype=np.int32)
    free = rng.permutation(n)[pinned:]
    row_of[free] = rng.permutation(len(free)).astype(np.int32)
    pattern, data, base = base_of(rng, row_of, 6)
    extra = random_symmetric(rng, n, pairs)
    joint = join(pattern, extra, row_of)
    blocks = joint.add(data, extra.data)
    rows = joint.rows
    size = base.shape[0]
    summed = bsr_matrix((blocks, rows.columns, rows.row_start), shape=(size, size)).toarray()
    expected = base.toarray() + restricted(extra, row_of).toarray()
    assert np.abs(summed - expected).max() <= 1e-14 * np.abs(expected).max()
    for i in range(len(rows.row_start) - 1):
        row = rows.columns[rows.row_start[i] : rows.row_start[i + 1]]
        assert (np.diff(row) > 0).all()  # ascending, none twice
        assert rows.columns[rows.diagonal[i]] == i
    assert (joint.of_base >= 0).all()


def test_nothing_extra_leaves_the_matrix_as_it_is():
    rng = np.random.default_rng(0)
    row_of = np.arange(8, dtype=np.int32)
    pattern, data, _ = base_of(rng, row_of, 4)
    nothing = bsr_matrix((24, 24), blocksize=(3, 3))
    joint = join(pattern, nothing, row_of)
    assert np.array_equal(joint.rows.columns, pattern.columns)
    assert np.array_equal(joint.rows.row_start, pattern.row_start)
    assert np.array_equal(joint.add(data, nothing.data), data)


def test_what_couples_pinned_vertices_is_left_out():
    rng = np.random.default_rng(1)
    row_of = np.array([0, 1, 2, 3, -1, -1], dtype=np.int32)
    pattern = build_pattern(np.array([[0, 1, 2, 3]], dtype=np.int32), 4)
    data = rng.normal(size=(pattern.blocks, 3, 3))
    blocks = rng.normal(size=(2, 3, 3))
    extra = bsr_matrix((blocks, [4, 5], [0, 1, 1, 1, 1, 2, 2]), shape=(18, 18))  # (0, 4) and (4, 5)
    joint = join(pattern, extra, row_of)
    assert (joint.of_extra == -1).all()
    assert np.array_equal(joint.add(data, blocks), data)


@pytest.mark.parametrize("kind", ["pcg", "auto"])
def test_systems_with_couplings_are_solved_as_directly(kind):
    import supple as sp
    from supple.implicit.energies.potential import HessianBlocks
    from supple.implicit.newton.linear_solver import LinearSolver
    from supple.system import build_system

    rng = np.random.default_rng(2)
    material = sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=1000.0)
    mesh = sp.shapes.box((1, 1, 1), (2, 2, 2))
    bodies = [sp.Body("one", mesh, material), sp.Body("two", mesh, material, position=(2, 0, 0))]
    system = build_system(sp.Scene(bodies, pins=[sp.Pin("one", [0, 1, 2])]))
    n, m = len(system.rest_positions), len(system.tets)
    solvers = [LinearSolver.of(system, name) for name in (kind, "direct")]
    # Couplings that come, change and go again.
    for count in (0, 5, 9, 0, 7):
        hessian = HessianBlocks.zeros(m, n)
        factors = rng.normal(size=(m, 12, 12))
        hessian.elements[:] = factors @ factors.transpose(0, 2, 1)
        hessian.vertices[:] = 0.1 * np.eye(3)
        if count:
            # Positive semi-definite: springs between random vertices.
            i, j = rng.integers(0, n // 2, count), rng.integers(n // 2, n, count)
            dense = np.zeros((3 * n, 3 * n))
            for a, b in zip(i, j, strict=True):
                for p, q, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                    dense[3 * p : 3 * p + 3, 3 * q : 3 * q + 3] += 50.0 * sign * np.eye(3)
            hessian.couplings.append(bsr_matrix(dense, blocksize=(3, 3)))
        force = rng.normal(size=(n, 3))
        answers = []
        for solver in solvers:
            solver.begin_step()
            solver.assemble(hessian)
            p, said = solver.solve(force, 1e-10)
            assert p is not None
            answers.append(p)
        assert said.method == "direct"
        assert (answers[0][:3] == 0.0).all()
        assert np.abs(answers[0] - answers[1]).max() < 1e-7 * np.abs(answers[1]).max()
