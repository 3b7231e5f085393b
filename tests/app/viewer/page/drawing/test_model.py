"""The data that the page draws, from snapshots and from recordings."""

import numpy as np

from supple.app.viewer.messages import frame_of


def test_a_snapshot_becomes_a_render_frame(fake):
    values = np.linspace(0.0, 1.0, fake.snapshot.description.n_tets)
    snapshot = fake.show(pinned=np.array([3, 30]), tet_values=values, tet_quantity="J", time=0.5)
    frame = frame_of(snapshot)
    assert [body.name for body in frame.model.bodies] == ["body 0", "body 1"]
    assert frame.time == 0.5
    assert list(frame.pinned) == [3, 30]
    np.testing.assert_array_equal(frame.tet_values["J"], values)
    np.testing.assert_allclose(np.linalg.det(frame.deformation_gradients), 1.0)
    np.testing.assert_array_equal(frame.poses[0], np.eye(4)[:3])
