"""The data that the page draws, from snapshots and from recordings."""

import numpy as np

import supple as sp
from supple.app.viewer.from_snapshot import MomentBuilder
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


def test_a_snapshot_becomes_a_moment(fake):
    values = np.linspace(0.0, 1.0, fake.snapshot.description.n_tets)
    snapshot = fake.show(pinned=np.array([3, 30]), tet_values=values, tet_quantity="J", time=0.5)
    translator = MomentBuilder()
    moment = translator.moment(snapshot)
    assert [body.name for body in moment.model.bodies] == ["body 0", "body 1"]
    assert moment.time == 0.5
    assert list(moment.pinned) == [3, 30]
    np.testing.assert_array_equal(moment.tet_values["J"], values)
    np.testing.assert_allclose(np.linalg.det(moment.deformation_gradients), 1.0)
    np.testing.assert_array_equal(moment.poses[0], np.eye(4)[:3])
    # The same generation has the same model, so that no layer is created again.
    assert translator.moment(fake.show()).model is moment.model


def test_the_pusher_does_not_create_a_new_model(fake):
    from dataclasses import replace

    from supple.results.recording.scene import RecordedObstacle

    translator = MomentBuilder()
    before = translator.moment(fake.snapshot)
    old = fake.snapshot.description
    shape = {"center": np.zeros(3), "radius": 0.1, "inside": False}
    ball = RecordedObstacle("pusher", "Sphere", shape, np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    pushed = translator.moment(
        fake.show(
            description=replace(old, generation=2, obstacles=(*old.obstacles, ball)),
            obstacle_poses=(np.stack([np.eye(3)] * 2), np.zeros((2, 3))),
            pusher=((1.0, 0.0, 0.0), 0.1),
        )
    )
    assert pushed.model is before.model
    assert len(pushed.poses) == 1
    assert pushed.pusher[1] == 0.1
    # Another body does.
    assert (
        translator.moment(
            fake.show(
                description=replace(old, generation=3, bodies=old.bodies[:1]), positions=fake.snapshot.positions[:27]
            )
        ).model
        is not before.model
    )


def test_a_skin_follows_the_tets_of_its_body(fake):
    from dataclasses import replace

    body = fake.snapshot.description.bodies[0]
    fine = np.random.default_rng(1).uniform(0.1, 0.9, (50, 3))
    skinned = replace(body, skin=(fine, np.array([[0, 1, 2]])))
    description = replace(fake.snapshot.description, bodies=(skinned, *fake.snapshot.description.bodies[1:]))
    x = fake.snapshot.positions * [1.0, 2.0, 1.0] + [0.0, 1.0, 0.0]
    moment = MomentBuilder().moment(fake.show(description=description, positions=x))
    drawn = moment.model.bodies[0].skin.positions(moment.positions[moment.model.bodies[0].vertices])
    np.testing.assert_allclose(drawn, fine * [1.0, 2.0, 1.0] + [0.0, 1.0, 0.0], atol=1e-12)
