"""The data that the page draws, from snapshots and from recordings."""

import numpy as np

import supple as sp
from supple.app.viewer.from_snapshot import RenderFrameBuilder
from supple.results.view.model import facets_of


def test_every_facet_is_found_once_and_outer_facets_are_the_surface():
    mesh = sp.shapes.box(size=(1.0, 1.0, 1.0), divisions=(3, 2, 2))
    facets = facets_of(mesh.tets)
    outer = facets.triangles[facets.outer < 0]
    assert 2 * (len(facets.outer) - len(outer)) + len(outer) == 4 * len(mesh.tets)
    # The same triangles, turned the same way: the first corner is the lowest vertex of each.
    turned = [
        np.array(sorted(tuple(np.roll(t, -int(np.argmin(t)))) for t in triangles))
        for triangles in (outer, mesh.surface.triangles)
    ]
    np.testing.assert_array_equal(*turned)
    for inner, outer in zip(facets.inner, facets.outer, strict=True):
        assert outer < 0 or len(set(mesh.tets[inner]) & set(mesh.tets[outer])) == 3


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
    # The same generation has the same model, so that no layer is created again.
    assert translator.frame(fake.show()).model is frame.model


def test_another_generation_has_a_new_model(fake):
    from dataclasses import replace

    translator = RenderFrameBuilder()
    before = translator.frame(fake.snapshot)
    smaller = replace(fake.snapshot.description, generation=2, bodies=fake.snapshot.description.bodies[:1])
    after = translator.frame(fake.show(description=smaller, positions=fake.snapshot.positions[:27]))
    assert after.model is not before.model
    assert [body.name for body in after.model.bodies] == ["body 0"]
