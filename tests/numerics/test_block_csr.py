"""Block CSR: the assembled matrix is the sum of the element matrices, for all elements."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from supple.numerics.sparse.block_csr import build_pattern


def dense_sum(elements, matrices, diagonal):
    rows = len(diagonal)
    out = np.zeros((3 * rows, 3 * rows))
    for tet, matrix in zip(elements, matrices, strict=True):
        for a in range(4):
            for b in range(4):
                if tet[a] >= 0 and tet[b] >= 0:
                    i, j = 3 * tet[a], 3 * tet[b]
                    out[i : i + 3, j : j + 3] += matrix[3 * a : 3 * a + 3, 3 * b : 3 * b + 3]
    for i in range(rows):
        out[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += diagonal[i]
    return out


def symmetric(rng, count, size):
    M = rng.normal(size=(count, size, size))
    return M + M.transpose(0, 2, 1)


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 12), st.integers(0, 20), st.integers(0, 2**31))
def test_assembles_the_sum_of_element_matrices(rows, n_elements, seed):
    rng = np.random.default_rng(seed)
    # Four different nodes each, some of them without a row.
    elements = np.array([rng.permutation(rows + 4)[:4] for _ in range(n_elements)], dtype=np.int32).reshape(-1, 4)
    elements[elements >= rows] = -1
    matrices, diagonal = symmetric(rng, n_elements, 12), symmetric(rng, rows, 3)
    pattern = build_pattern(elements, rows)
    data = np.full((pattern.blocks, 3, 3), np.nan)
    pattern.assemble(matrices, diagonal, data)
    matrix = pattern.to_scipy(data).toarray()
    assert np.allclose(matrix, dense_sum(elements, matrices, diagonal), atol=1e-12)
    assert np.array_equal(matrix, matrix.T)


def test_a_vertex_without_elements_keeps_its_diagonal_block():
    pattern = build_pattern(np.zeros((0, 4), dtype=np.int32), 2)
    data = np.zeros((pattern.blocks, 3, 3))
    pattern.assemble(np.zeros((0, 12, 12)), np.stack([np.eye(3), 2 * np.eye(3)]), data)
    assert pattern.blocks == 2
    assert np.array_equal(pattern.to_scipy(data).toarray(), np.diag([1.0] * 3 + [2.0] * 3))


def test_columns_ascend_and_mirrors_are_mutual():
    rng = np.random.default_rng(3)
    elements = np.array([rng.permutation(40)[:4] for _ in range(60)], dtype=np.int32)
    pattern = build_pattern(elements, 40)
    rows = np.repeat(np.arange(40), np.diff(pattern.row_start))
    assert np.array_equal(rows[pattern.mirror], pattern.columns)
    assert np.array_equal(pattern.columns[pattern.mirror], rows)
    for i in range(40):
        assert np.all(np.diff(pattern.columns[pattern.row_start[i] : pattern.row_start[i + 1]]) > 0)
    assert np.array_equal(pattern.columns[pattern.diagonal], np.arange(40))
