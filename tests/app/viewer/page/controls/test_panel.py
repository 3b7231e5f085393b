"""The panel and the mouse, with a real websocket: input of visitors becomes commands."""

import time
from dataclasses import replace

import numpy as np
import pytest

from supple.app.viewer.protocol.commands import (
    AddBody,
    CopyBody,
    Grab,
    MoveGrab,
    Pause,
    Pin,
    Play,
    ReleaseGrab,
    RemoveBody,
    Reset,
    SetParameter,
    SetSolver,
    SetSpeed,
    SetView,
    Squash,
    Step,
    Unpin,
)
from supple.app.viewer.protocol.snapshots import Notice


def test_time(live, fake, visitor, received, until):
    time_controls = live.panel.time
    visitor.press(time_controls.play)
    assert received() == Play()
    fake.show(paused=False)
    until(lambda: time_controls.play.label == "Pause")
    visitor.press(time_controls.play)
    assert received() == Pause()
    visitor.set(time_controls.frames, "step")
    assert received() == Step()
    visitor.set(time_controls.frames, "reset")
    assert received() == Reset()
    visitor.set(time_controls.speed.handle, 0.25)
    assert received() == SetSpeed(0.25)


def test_solver_and_its_parameters(live, fake, visitor, received, until):
    solver = live.panel.solver
    assert list(solver.inputs) == ["substeps", "momentum_restore", "gravity"]
    visitor.set(solver.kind, "implicit")
    assert received() == SetSolver("implicit")
    visitor.set(solver.inputs["substeps"].handle, 7)
    assert received() == SetParameter("substeps", 7)
    visitor.set(solver.inputs["momentum_restore"].handle, False)
    assert received() == SetParameter("momentum_restore", False)
    visitor.set(solver.inputs["gravity"].handle, -1.5)
    assert received() == SetParameter("gravity", -1.5)
    # Another solver has other parameters.
    description = replace(fake.snapshot.description, revision=2, solver="implicit", values={"gravity": -3.0})
    fake.show(description=description)
    until(lambda: list(solver.inputs) == ["gravity"])
    assert solver.kind.value == "implicit"
    assert solver.inputs["gravity"].handle.value == -3.0


def test_parameters_of_bodies(live, fake, visitor, received, until):
    bodies = live.panel.bodies
    youngs = bodies.inputs["youngs"].handle
    assert (youngs.label, youngs.value) == ("Young's modulus [kPa]", 100.0)
    for typed, pascals in ((1000.0, 1e6), (30.1, 30.1e3), (0.25, 250.0)):
        for digits in (2, 3, typed):  # as a browser sends them; only the last one counts
            visitor.set(youngs, digits)
        assert received() == SetParameter("youngs", pascals)
    for wrong in (1e-3, 1e9, float("nan")):
        visitor.set(youngs, wrong)
        until(lambda: youngs.value == 0.25)
    visitor.set(bodies.inputs["damping"].handle, 0.0)  # the value does not change
    visitor.set(bodies.which, "body 1")
    until(lambda: bodies.change.visible)
    assert fake.received == []
    visitor.set(bodies.inputs["damping"].handle, 10.0)
    assert received() == SetParameter("damping", 0.01, "body 1")
    visitor.set(bodies.inputs["damping"].handle, 0.0)
    assert received() == SetParameter("damping", 0.0, "body 1")
    visitor.set(bodies.inputs["poisson"].handle, 0.25)
    assert received() == SetParameter("poisson", 0.25, "body 1")


def test_bodies_are_added_copied_and_removed(live, fake, visitor, received, until):
    bodies = live.panel.bodies
    visitor.set(bodies.squash, "squash")
    assert received() == Squash(0.5)
    visitor.set(bodies.squash, "stretch")
    assert received() == Squash(1.5)
    visitor.set(bodies.shape, "torus")
    visitor.set(bodies.size.handle, 0.75)
    visitor.set(bodies.resolution.handle, 8)
    visitor.press(bodies.add)
    assert received() == AddBody("torus", size=0.75, resolution=8, youngs=1e5)
    visitor.set(bodies.which, "body 1")
    until(lambda: bodies.change.visible)
    visitor.set(bodies.change, "copy")
    assert received() == CopyBody("body 1")
    visitor.set(bodies.change, "remove")
    assert received() == RemoveBody("body 1")
    old = fake.snapshot.description
    fake.show(
        description=replace(old, generation=2, bodies=old.bodies[:1], n_vertices=27, n_tets=48),
        positions=fake.snapshot.positions[:27],
    )
    until(lambda: bodies.which.options == ("all bodies", "body 0"))
    assert bodies.which.value == "all bodies"


def test_inputs_follow_the_simulation_unless_a_value_is_pending(live, fake, visitor, received, until, monkeypatch):
    old = fake.snapshot.description
    changed = replace(old, revision=2, values=old.values | {"substeps": 33})
    fake.show(description=changed)
    substeps = live.panel.solver.inputs["substeps"]
    until(lambda: substeps.handle.value == 33)
    visitor.set(substeps.handle, 50)
    received()
    displayed = lambda snapshot: until(lambda: live.panel._numbers_of is snapshot)  # noqa: E731
    # The command has not been executed yet: a step may be long.
    monkeypatch.setattr("supple.app.viewer.controls.parameter_input._KEEP_SECONDS", 0.0)
    displayed(fake.show())
    assert substeps.handle.value == 50
    # Now it has been executed, without effect.
    fake.show(applied=fake.sent)
    until(lambda: substeps.handle.value == 33)


def test_a_selected_solver_is_pending_until_its_command_is_executed(live, fake, visitor, received, until, monkeypatch):
    monkeypatch.setattr("supple.app.viewer.controls.parameter_input._KEEP_SECONDS", 0.0)
    solver = live.panel.solver
    visitor.set(solver.kind, "implicit")
    assert received() == SetSolver("implicit")
    snapshot = fake.show()
    until(lambda: live.panel._numbers_of is snapshot)
    assert solver.kind.value == "implicit"
    fake.show(applied=fake.sent)  # the command failed
    until(lambda: solver.kind.value == "xpbd")
    visitor.set(solver.kind, "implicit")
    assert received() == SetSolver("implicit")


def test_simultaneous_clicks_are_handled_in_order(live, visitor, fake, until):
    """A later click does not change an earlier one."""
    time_controls, bodies = live.panel.time, live.panel.bodies
    youngs = bodies.inputs["youngs"].handle
    for k in range(20):
        visitor.set(time_controls.frames, "step" if k % 2 else "reset")
        visitor.set(bodies.squash, "stretch" if k % 2 else "squash")
        visitor.set(youngs, 200.0 + k)
    until(lambda: len(fake.received) >= 41)
    assert [command for command in fake.received if isinstance(command, (Step, Reset))] == [Reset(), Step()] * 10
    assert [command for command in fake.received if isinstance(command, Squash)] == [Squash(0.5), Squash(1.5)] * 10
    moduli = [command.value for command in fake.received if isinstance(command, SetParameter)]
    assert moduli == [219e3]  # the others were typed on the way


def test_a_drag_is_a_grab_with_release(live, visitor, received):
    handle = live.stage.body_handles[0]
    x = live.stage.frame.positions[live.stage.model.bodies[0].vertices]
    corner = int(np.argmax(x.sum(axis=1)))
    visitor.drag(handle, "start", x[corner], x[corner])
    grab = received()
    assert isinstance(grab, Grab)
    assert grab.body == "body 0"
    assert grab.vertices[int(np.argmax(grab.weights))] == corner
    assert max(grab.weights) == pytest.approx(1.0)
    visitor.drag(handle, "update", x[corner], x[corner] + [0.0, 1.0, 0.0])
    moved = received()
    assert moved == MoveGrab(grab.grab, tuple(x[corner] + [0.0, 1.0, 0.0]))
    visitor.drag(handle, "end", x[corner], x[corner])
    assert received() == ReleaseGrab(grab.grab)


def test_a_visitor_who_leaves_releases_the_grab(live, server, visit, received, until):
    visitor = visit(server.get_port())
    until(server.get_clients)
    handle, x = live.stage.body_handles[0], live.stage.frame.positions[0]
    visitor.drag(handle, "start", x, x)
    grab = received()
    visitor.leave()
    assert received() == ReleaseGrab(grab.grab)


def test_a_click_pins_and_unpins(live, fake, visitor, received, until):
    handle = live.stage.body_handles[1]
    x = live.stage.frame.positions
    corner = int(np.argmax(x.sum(axis=1)))
    origin = x[corner] + [1.0, 1.0, 1.0]
    direction = [-1.0 + 1e-3, -1.0 - 1e-3, -1.0]
    visitor.click(handle, origin, direction)
    local = corner - live.stage.model.bodies[1].vertices.start
    assert received() == Pin("body 1", local)
    fake.show(pinned=np.array([corner]))
    until(lambda: len(live.controller.snapshot.pinned) == 1)
    visitor.click(handle, origin, direction)
    assert received() == Unpin("body 1", local)
    visitor.press(live.panel.mouse_controls.unpin)
    assert received() == Unpin()


def test_the_view_options_request_values(live, visitor, received, until):
    views = live.panel.views
    visitor.set(views.color_by, "von Mises stress")
    assert received() == SetView("von_mises")
    visitor.set(views.velocities, True)
    assert received() == SetView("von_mises", velocities=True)
    visitor.set(views.contacts, True)
    assert received() == SetView("von_mises", velocities=True, contacts=True)
    until(lambda: "not known" in views._message.content)
    visitor.set(views.surface, "wireframe")
    assert received() == SetView(None, velocities=True, contacts=True)
    until(lambda: live.stage.options.surface == "wireframe")


def test_simultaneous_view_options_all_take_effect(live, visitor, until):
    views = live.panel.views
    for k in range(20):
        surface, color = ("tets", "energy density") if k % 2 else ("skin", "body")
        visitor.set(views.surface, surface)
        visitor.set(views.color_by, color)
        visitor.set(views.velocities, bool(k % 2))
    wanted = ("tets", "energy density", True)
    displayed = lambda: (live.stage.options.surface, live.stage.options.color_by, live.stage.options.velocities)  # noqa: E731
    until(lambda: displayed() == wanted)
    time.sleep(0.3)
    assert displayed() == wanted


@pytest.mark.parametrize(
    ("preset", "ahead"), [("top", (0.0, -1.0, 0.0)), ("corner", None), ("front", None), ("side", None)]
)
def test_the_whole_scene_is_visible_from_camera_presets(live, server, visitor, until, preset, ahead):
    view, camera = live.stage.model.view, next(iter(server.get_clients().values())).camera
    before = np.array(camera.position)
    visitor.set(live.panel.views.cameras.presets, preset)

    def axis():
        """The viewing direction of the camera."""
        w, x, y, z = camera.wxyz
        return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])

    def looks():
        way = np.asarray(camera.look_at) - np.asarray(camera.position)
        return way / np.linalg.norm(way)

    def is_in_the_picture():
        toward = view.outline - np.asarray(camera.position)
        right = np.cross(looks(), view.up)
        above = np.cross(right / np.linalg.norm(right), looks())
        return (np.abs(toward @ above) / (toward @ looks())).max() < np.tan(0.5 * np.radians(35.0))

    moved = preset == "corner"  # where it is already
    until(lambda: moved or not np.allclose(camera.position, before))
    # Its position and the point it looks at are set one after the other.
    until(lambda: np.allclose(axis(), looks(), atol=1e-6) and is_in_the_picture())
    if ahead is not None:
        until(lambda: np.allclose(looks(), ahead, atol=2e-3))


def test_notices_are_displayed_once(live, server, fake, visitor, until, monkeypatch):
    displayed = []
    client = next(iter(server.get_clients().values()))
    monkeypatch.setattr(client, "add_notification", lambda title, text, **_: displayed.append(text))
    notices = (Notice(1, "info", "one"), Notice(2, "error", "two"))
    fake.show(notices=notices[:1])
    until(lambda: displayed == ["one"])
    fake.show(notices=notices)
    fake.show(notices=notices)
    until(lambda: len(displayed) >= 2)
    time.sleep(0.2)
    assert displayed == ["one", "two"]
