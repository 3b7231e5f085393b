"""The data that the page draws, from snapshots and from recordings."""

import numpy as np

from supple.app.viewer.from_snapshot import RenderFrameBuilder


def test_a_snapshot_becomes_a_render_frame(fake):
    values = np.linspace(0.0, 1.0, fake.snapshot.description.n_tets)
    snapshot = fake.show(pinned=np.array([3, 30]), tet_values=values, tet_quantity="J", time=0.5)
    translator = RenderFrameBuilder()
    frame = translator.frame(snapshot)
    assert [body.name for body in frame.model.bodies] == ["body 0", "body 1"]
    assert frame.time == 0.5
    assert list(frame.pinned) == [3, 30]
    np.testing.assert_array_equal(frame.tet_values["J"], values)
    np.testing.assert_allclose(np.linalg.det(frame.deformation_gradients), 1.0)
    np.testing.assert_array_equal(frame.poses[0], np.eye(4)[:3])
    # The same generation has the same model, so that the scene is not sent again.
    assert translator.frame(fake.show()).model is frame.model


def test_another_generation_has_a_new_model(fake):
    from dataclasses import replace

    translator = RenderFrameBuilder()
    before = translator.frame(fake.snapshot)
    smaller = replace(fake.snapshot.description, generation=2, bodies=fake.snapshot.description.bodies[:1])
    after = translator.frame(fake.show(description=smaller, positions=fake.snapshot.positions[:27]))
    assert after.model is not before.model
    assert [body.name for body in after.model.bodies] == ["body 0"]
