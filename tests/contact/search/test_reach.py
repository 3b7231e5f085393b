"""When lists of what is near each other must be renewed."""

import numpy as np
import pytest

from supple.contact.search.reach import any_beyond_radii, common_motions


def rotation(vector):
    angle = np.linalg.norm(vector)
    K = np.cross(np.eye(3), np.asarray(vector) / angle)
    return np.eye(3) - np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@pytest.fixture
def moved():
    """Two pieces, each of which moves as a rigid body of its own, far beyond its radii; and these."""
    rng = np.random.default_rng(4)
    x, pieces = rng.normal(size=(40, 3)), np.repeat(np.arange(2, dtype=np.int32), 20)
    turns = rotation([0.5, -1.0, 2.0]), rotation([3.0, 0.2, 0.1])
    after = np.where(pieces[:, None] == 0, x @ turns[0].T + [5.0, 0.0, 1.0], x @ turns[1].T - [0.0, 2.0, 0.0])
    far, near = np.full((40, 3), np.inf), np.full((40, 3), 1e-3)
    common = np.zeros((3, 3)), np.zeros((2, 3)), np.zeros((2, 3, 3))
    return x, after, far, near, pieces, common


def beyond(moved, each=1):
    x, after, far, near, pieces, common = moved
    return any_beyond_radii(after, after, x, far, near, pieces, True, each, common, np.zeros(len(x)))


def test_some_of_the_points_tell_the_motion_of_a_piece(moved):
    """Points that are not asked for the common motion are compared with it as all others."""
    _, after, *_ = moved
    assert not beyond(moved, each=3)
    after[7, 1] += 3e-3
    assert beyond(moved, each=3)


def test_what_hardly_moves_needs_no_common_motion(moved):
    """One point moves against all others, by less than its radius; against their common motion it moves by more."""
    x, after, *_ = moved
    after[:] = x - [0.0, 0.0, 9e-4]
    after[7, 2] += 18e-4
    assert not beyond(moved)
    after[7, 2] += 2e-4
    assert beyond(moved)


def test_a_rigid_motion_of_a_piece_changes_no_distance_in_it(moved):
    x, after, _, _, pieces, common = moved
    common_motions(x, after - x, pieces, True, 1, common)
    drifts, centers, turns = common
    own = drifts[pieces] + np.einsum("nij,nj->ni", turns[pieces], x - centers[pieces])
    np.testing.assert_allclose(own, after - x, atol=1e-13)
    assert not beyond(moved)


def test_a_point_that_moves_in_its_piece(moved):
    _, after, *_ = moved
    after[7, 1] += 3e-3
    assert beyond(moved)


def test_motions_against_other_pieces_and_lost_points(moved):
    _, after, far, *_ = moved
    far[:, 2] = 1.0
    assert beyond(moved)
    far[:, 2] = np.inf
    after[3] = np.nan
    assert beyond(moved)
