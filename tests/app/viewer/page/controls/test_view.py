"""The legend and its range, the value at a place, and cameras that fit and follow."""

import numpy as np

from supple.app.viewer.protocol.commands import Pin, Unpin
from supple.app.viewer.protocol.snapshots import GrabState


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
    until(lambda: (views.range.low.value, views.range.high.value) == (0.0, 50e3))
    assert (views.range.low.label, views.range.high.label) == ("From [Pa]", "To [Pa]")
    visitor.set(views.range.high, 8e3)
    until(lambda: ">8 kPa<" in legend())
    visitor.set(views.range.high, -1.0)  # not complete, or wrong: the last one stays
    visitor.set(views.range.low, 2e3)
    visitor.set(views.range.high, 12e3)
    until(lambda: ">2 kPa<" in legend())
    assert ">7 kPa<" in legend()
    visitor.set(views.range.kind, "all values")
    until(lambda: ">50 kPa<" in legend())


def test_the_value_at_a_place_that_is_clicked_with_shift(live, fake, server, visitor, until):
    views, body = live.panel.views, live.stage.model.bodies[0]
    middle = live.stage.frame.positions[body.vertices].mean(axis=0)
    label = lambda: views.probe._label.text if views.probe._label else ""  # noqa: E731
    fake.show(tet_values=np.full(96, 1234.0), tet_quantity="von_mises")
    visitor.set(views.color_by, "von Mises stress")
    until(lambda: live.stage.value_at(0) is not None and len(live.stage.body_handles[0]._impl.click_cb) == 2)
    visitor.click(live.stage.body_handles[0], middle + np.array([0.0, 0.0, 5.0]), [0.0, 0.0, -1.0], modifier="shift")
    until(lambda: label() == "1.234 kPa · body 0")
    assert fake.received[-1].tet_values == "von_mises"  # nothing is pinned
    place = views.probe._label.position.copy()
    assert np.linalg.norm(place - middle) < 0.8
    fake.show(tet_values=np.full(96, 777.0), tet_quantity="von_mises", positions=fake.snapshot.positions + 1.0)
    until(lambda: label() == "777 Pa · body 0")
    np.testing.assert_allclose(views.probe._label.position, place + 1.0, atol=1e-6)
    visitor.set(views.color_by, "body")
    until(lambda: label() == "")


def test_two_clicks_fit_the_picture_to_a_body_and_pin_nothing(live, fake, server, visitor, received, until):
    handle, body = live.stage.body_handles[1], live.stage.model.bodies[1]
    x = live.stage.frame.positions
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
    visitor.set(live.panel.views.cameras.follow, "body 1")
    middle = lambda: live.stage.frame.positions[body.vertices].mean(axis=0)  # noqa: E731
    until(lambda: np.allclose(camera.look_at, middle()))
    away = np.asarray(camera.position) - np.asarray(camera.look_at)
    fake.show(positions=fake.snapshot.positions + np.array([0.0, 3.0, 0.0]))
    until(lambda: np.allclose(camera.look_at, middle()) and middle()[1] > 2.0)
    np.testing.assert_allclose(np.asarray(camera.position) - np.asarray(camera.look_at), away, atol=1e-9)


def test_the_camera_stays_with_bodies_that_leave_the_picture(live, fake, server, visitor, until):
    camera, radius = next(iter(server.get_clients().values())).camera, live.stage.model.view.radius
    start, x = np.asarray(camera.look_at), fake.snapshot.positions
    fake.show(positions=x + np.array([0.3 * radius, 0.0, 0.0]))
    until(lambda: np.allclose(live.stage.frame.positions, fake.snapshot.positions))
    np.testing.assert_allclose(camera.look_at, start)
    pulled = GrabState(1, "body 0", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    fake.show(positions=x + np.array([2.0 * radius, 0.0, 0.0]), grabs=(pulled,))
    until(lambda: live.stage.frame.springs)
    np.testing.assert_allclose(camera.look_at, start)  # it stands still while a body is pulled

    def moved(way: float) -> bool:
        fake.show(grabs=())
        return bool(np.allclose(camera.look_at, start + np.array([way * radius, 0.0, 0.0]), atol=0.01 * radius))

    until(lambda: moved(1.65))
    fake.show(positions=x)
    until(lambda: moved(0.0))


def test_a_late_report_of_the_browser_does_not_move_the_camera_away(live, fake, server, visitor, until):
    camera, radius = next(iter(server.get_clients().values())).camera, live.stage.model.view.radius
    start, eye, x = np.asarray(camera.look_at), np.asarray(camera.position), fake.snapshot.positions
    wished = start + np.array([1.65 * radius, 0.0, 0.0])

    def there() -> bool:
        fake.show(positions=x + np.array([2.0 * radius, 0.0, 0.0]))
        return bool(np.allclose(camera.look_at, wished, atol=0.01 * radius))

    near = lambda place: bool(np.allclose(camera.look_at, place, atol=0.05 * radius))  # noqa: E731 - it still glides
    until(there)
    reports = []
    camera.on_update(lambda _: reports.append(1))
    visitor.report_camera(position=eye, look_at=start)  # sent before the moves came
    until(lambda: reports and near(wished))
    np.testing.assert_allclose(np.asarray(camera.position) - np.asarray(camera.look_at), eye - start, atol=1e-9)
    visitor.report_camera(position=eye + 7.0 * radius, look_at=start + 7.0 * radius)  # the visitor moves it
    until(lambda: len(reports) == 2)
    until(lambda: near(start + 7.0 * radius))
