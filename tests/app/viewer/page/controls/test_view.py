"""The legend and its range, the value at the pointer, and cameras that fit and follow."""

import numpy as np

from supple.app.viewer.protocol.commands import Pin, Unpin


def test_the_range_of_the_colors_is_chosen(live, fake, visitor, until):
    views = live.panel.views
    legend = lambda: live.panel.overlay.part("legend")  # noqa: E731
    assert not views.range.kind.visible
    visitor.set(views.color_by, "von Mises stress")
    until(lambda: "not known" in legend())
    assert views.range.kind.visible
    values = np.linspace(0.0, 37e3, len(fake.snapshot.description.bodies) * 48)
    fake.show(tet_values=values, tet_quantity="von_mises")
    until(lambda: "50 kPa" in legend())
    visitor.set(views.range.kind, "fixed")
    until(lambda: (views.range.low.value, views.range.high.value) == ("0 Pa", "50 kPa"))
    visitor.set(views.range.high, "8 kPa")
    until(lambda: ">8 kPa<" in legend())
    visitor.set(views.range.high, "8 kN")  # not complete, or wrong: the last one stays
    visitor.set(views.range.low, "2e3")
    visitor.set(views.range.high, "12 kPa")
    until(lambda: ">2 kPa<" in legend())
    assert ">7 kPa<" in legend()
    visitor.set(views.range.kind, "all values")
    until(lambda: ">50 kPa<" in legend())


def test_the_value_under_the_pointer(live, fake, server, visitor, until):
    """The camera stands at z = -5 and looks along z."""
    views = live.panel.views
    fake.show(tet_values=np.full(96, 1234.0), tet_quantity="von_mises")
    visitor.set(views.color_by, "von Mises stress")
    visitor.set(views.probe.pointer, "0.05 0.05")
    label = lambda: "".join(each.part("value") for each in views.probe._labels.values())  # noqa: E731
    until(lambda: "1.234 kPa · body 0" in label())
    fake.show(tet_values=np.full(96, 777.0), tet_quantity="von_mises")
    until(lambda: "777 Pa · body 0" in label())
    visitor.set(views.probe.pointer, "0.9 0.9")
    until(lambda: label() == "")
    visitor.set(views.probe.pointer, "not a place")
    visitor.set(views.probe.pointer, "0.05 0.05")
    until(lambda: "777 Pa" in label())
    visitor.set(views.color_by, "body")
    until(lambda: label() == "")


def test_two_clicks_fit_the_picture_to_a_body_and_pin_nothing(live, fake, server, visitor, received, until):
    handle, body = live.stage.body_handles[1], live.stage.model.bodies[1]
    x = live.stage.moment.positions
    corner = int(np.argmax(x.sum(axis=1)))
    direction = [-1.0 + 1e-3, -1.0 - 1e-3, -1.0]
    for _ in range(2):
        visitor.click(handle, x[corner] + [1.0, 1.0, 1.0], direction)
    local = corner - body.vertices.start
    assert [received(), received()] == [Pin("body 1", local), Unpin("body 1", local)]
    camera = next(iter(server.get_clients().values())).camera
    middle = 0.5 * (x[body.vertices].min(axis=0) + x[body.vertices].max(axis=0))
    until(lambda: np.allclose(camera.look_at, middle))
    away = np.linalg.norm(np.asarray(camera.position) - middle)
    assert 0.6 < np.sin(0.5 * camera.fov) * away / (0.5 * np.sqrt(3.0)) < 1.3  # it fills the picture


def test_the_camera_follows_a_body(live, fake, server, visitor, until):
    camera = next(iter(server.get_clients().values())).camera
    body = live.stage.model.bodies[1]
    visitor.set(live.panel.views.follow, "body 1")
    middle = lambda: live.stage.moment.positions[body.vertices].mean(axis=0)  # noqa: E731
    until(lambda: np.allclose(camera.look_at, middle()))
    away = np.asarray(camera.position) - np.asarray(camera.look_at)
    fake.show(positions=fake.snapshot.positions + np.array([0.0, 3.0, 0.0]))
    until(lambda: np.allclose(camera.look_at, middle()) and middle()[1] > 2.0)
    np.testing.assert_allclose(np.asarray(camera.position) - np.asarray(camera.look_at), away, atol=1e-9)
