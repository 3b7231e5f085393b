"""The pairs of vertices and triangles, grouped by vertex and owner of the triangle."""

from itertools import pairwise

import numpy as np

from supple.contact.features.vertex_features import grouped


def test_groups_have_all_pairs_with_a_feature_and_one_vertex_and_owner_each() -> None:
    rng = np.random.default_rng(5)
    owner = np.repeat(np.arange(4, dtype=np.int32), 10)
    triangles = (10 * rng.integers(4, size=(30, 1)) + np.argsort(rng.random((30, 10)))[:, :3]).astype(np.int32)
    pairs = np.column_stack([rng.integers(40, size=200), rng.integers(30, size=200)]).astype(np.int32)
    features = np.where(rng.random(200) < 0.8, 0, -1).astype(np.int32)

    rows, start = grouped(pairs, features, triangles, owner)

    others = owner[triangles[pairs[:, 1], 0]]
    groups = [rows[begin:end] for begin, end in pairwise(start)]
    assert sorted(rows) == list(np.flatnonzero(features >= 0))
    keys = [{(int(pairs[k, 0]), int(others[k])) for k in group} for group in groups]
    assert all(len(key) == 1 for key in keys)
    assert len(set().union(*keys)) == len(groups)
