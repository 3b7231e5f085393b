"""The panel and the mouse, over a real line to the server: what visitors do becomes commands."""

import random
import time
from dataclasses import replace

import numpy as np
import pytest

from supple.viewer import live_page
from supple.viewer.controls import pending
from supple.viewer.drawing.moments.from_snapshot import Translator
from supple.viewer.protocol.messages import (
    AddBody,
    CopyBody,
    Grab,
    GrabState,
    MoveGrab,
    MovePusher,
    Notice,
    Pause,
    Pin,
    Play,
    ReleaseGrab,
    RemoveBody,
    RemovePusher,
    Reset,
    SetParameter,
    SetSolver,
    SetSpeed,
    SetView,
    Squash,
    Step,
    Timing,
    Unpin,
)


@pytest.fixture
def told(made_up, until):
    """The command that comes next."""

    def next_command():
        until(lambda: made_up.told, what="a command")
        return made_up.told.pop(0)

    return next_command


def test_time(live, made_up, visitor, told, until):
    time_controls = live.panel.time
    visitor.press(time_controls.play)
    assert told() == Play()
    made_up.show(paused=False)
    until(lambda: time_controls.play.label == "Pause")
    visitor.press(time_controls.play)
    assert told() == Pause()
    visitor.set(time_controls.back, "step")
    assert told() == Step()
    visitor.set(time_controls.back, "reset")
    assert told() == Reset()
    visitor.set(time_controls.speed, 0.25)
    assert told() == SetSpeed(0.25)


def test_the_page_says_when_the_simulation_is_slow_or_gone(live, made_up, until):
    said = lambda: live.panel.time._said.content  # noqa: E731
    made_up.show(paused=False, timing=Timing(40.0, 25.0, 0.42, keeps_up=False))
    until(lambda: "Too slow for real time" in said() and "0.42 of real time" in said() and "40.0 ms" in said())
    made_up.error = "it ran out of memory"
    until(lambda: "gone" in said() and "out of memory" in said())


def test_the_page_says_when_nothing_is_heard_of_the_simulation(live, made_up, until, monkeypatch):
    said = lambda: live.panel.time._said.content  # noqa: E731
    monkeypatch.setattr(live_page, "_SILENCE", 0.05)
    made_up.show(time=1.25)
    until(lambda: "t = 1.25 s" in said() and "Busy for 0 s" in said())
    monkeypatch.setattr(live_page, "_SILENCE", 1e9)
    made_up.show(time=2.5)
    until(lambda: "t = 2.50 s" in said() and "Busy" not in said())


def test_solver_and_its_numbers(live, made_up, visitor, told, until):
    solver = live.panel.solver
    assert list(solver.inputs) == ["substeps", "momentum_restore", "gravity"]
    visitor.set(solver.kind, "implicit")
    assert told() == SetSolver("implicit")
    visitor.set(solver.inputs["substeps"].handle, 7)
    assert told() == SetParameter("substeps", 7)
    visitor.set(solver.inputs["momentum_restore"].handle, False)
    assert told() == SetParameter("momentum_restore", False)
    visitor.set(solver.inputs["gravity"].handle, -1.5)
    assert told() == SetParameter("gravity", -1.5)
    # Another solver has other numbers.
    description = replace(made_up.snapshot.description, revision=2, solver="implicit", values={"gravity": -3.0})
    made_up.show(description=description)
    until(lambda: list(solver.inputs) == ["gravity"])
    assert solver.kind.value == "implicit"
    assert solver.inputs["gravity"].handle.value == -3.0


def test_numbers_of_bodies(live, made_up, visitor, told, until):
    bodies = live.panel.bodies
    visitor.set(bodies.inputs["youngs"].handle, 6.0)
    assert told() == SetParameter("youngs", 1e6)
    until(lambda: "1 MPa" in bodies.inputs["youngs"].handle.label)
    visitor.set(bodies.inputs["damping"].handle, -12.0)  # the left end: it is there already
    visitor.set(bodies.which, "body 1")
    until(lambda: bodies.change.visible)
    assert made_up.told == []
    visitor.set(bodies.inputs["damping"].handle, -2.0)
    assert told() == SetParameter("damping", 0.01, "body 1")
    visitor.set(bodies.inputs["damping"].handle, -12.0)
    assert told() == SetParameter("damping", 0.0, "body 1")
    visitor.set(bodies.inputs["poisson"].handle, 0.25)
    assert told() == SetParameter("poisson", 0.25, "body 1")


def test_bodies_come_and_go(live, made_up, visitor, told, until):
    bodies = live.panel.bodies
    visitor.set(bodies.squash, "squash")
    assert told() == Squash(0.5)
    visitor.set(bodies.squash, "stretch")
    assert told() == Squash(1.5)
    visitor.set(bodies.shape, "torus")
    visitor.set(bodies.size, 0.75)
    visitor.set(bodies.resolution, 8)
    visitor.press(bodies.add)
    assert told() == AddBody("torus", size=0.75, resolution=8, youngs=1e5)
    visitor.set(bodies.which, "body 1")
    until(lambda: bodies.change.visible)
    visitor.set(bodies.change, "copy")
    assert told() == CopyBody("body 1")
    visitor.set(bodies.change, "remove")
    assert told() == RemoveBody("body 1")
    old = made_up.snapshot.description
    made_up.show(
        description=replace(old, generation=2, bodies=old.bodies[:1], n_vertices=27, n_tets=48),
        positions=made_up.snapshot.positions[:27],
    )
    until(lambda: bodies.which.options == ("all bodies", "body 0"))
    assert bodies.which.value == "all bodies"


def test_values_follow_the_simulation_but_not_under_the_hand(live, made_up, visitor, told, until, monkeypatch):
    old = made_up.snapshot.description
    changed = replace(old, revision=2, values=old.values | {"substeps": 33})
    made_up.show(description=changed)
    substeps = live.panel.solver.inputs["substeps"]
    until(lambda: substeps.handle.value == 33)
    visitor.set(substeps.handle, 50)
    told()
    shown = lambda snapshot: until(lambda: live.panel._numbers_of is snapshot)  # noqa: E731
    # The command has not been acted upon yet, however long that takes: a step may be long.
    monkeypatch.setattr(pending, "_HANDS_OFF", 0.0)
    shown(made_up.show())
    assert substeps.handle.value == 50
    # Now it has been, and came to nothing.
    made_up.show(applied=made_up.sent)
    until(lambda: substeps.handle.value == 33)


def test_a_choice_of_solver_stands_until_it_is_answered(live, made_up, visitor, told, until, monkeypatch):
    monkeypatch.setattr(pending, "_HANDS_OFF", 0.0)
    solver = live.panel.solver
    visitor.set(solver.kind, "implicit")
    assert told() == SetSolver("implicit")
    snapshot = made_up.show()
    until(lambda: live.panel._numbers_of is snapshot)
    assert solver.kind.value == "implicit"
    made_up.show(applied=made_up.sent)  # it was refused
    until(lambda: solver.kind.value == "xpbd")
    visitor.set(solver.kind, "implicit")
    assert told() == SetSolver("implicit")


def test_clicks_that_come_at_once_are_taken_one_by_one(live, visitor, made_up, until):
    """Each is what it was, whatever was clicked right after it."""
    time_controls, bodies = live.panel.time, live.panel.bodies
    youngs = bodies.inputs["youngs"].handle
    for k in range(20):
        visitor.set(time_controls.back, "step" if k % 2 else "reset")
        visitor.set(bodies.squash, "stretch" if k % 2 else "squash")
        visitor.set(youngs, 5.0 + 0.1 * k)
    until(lambda: len(made_up.told) >= 59)  # the first modulus is there already
    assert [command for command in made_up.told if isinstance(command, (Step, Reset))] == [Reset(), Step()] * 10
    assert [command for command in made_up.told if isinstance(command, Squash)] == [Squash(0.5), Squash(1.5)] * 10
    moduli = [command.value for command in made_up.told if isinstance(command, SetParameter)]
    np.testing.assert_allclose(moduli, 10.0 ** (5.0 + 0.1 * np.arange(1, 20)))


def test_a_drag_ends_whatever_the_mouse_does_by_then(live, visitor, told, until):
    handle, x = live.stage.body_handles[0], live.stage.moment.positions[0]
    visitor.drag(handle, "start", x, x)
    grab = told()
    visitor.set(live.panel.mouse_controls.mode, "push")  # by anyone
    visitor.drag(handle, "end", x, x)
    assert told() == ReleaseGrab(grab.grab)


def test_a_drag_is_a_spring_that_is_let_go(live, visitor, told):
    handle = live.stage.body_handles[0]
    x = live.stage.moment.positions[live.stage.model.bodies[0].vertices]
    corner = int(np.argmax(x.sum(axis=1)))
    visitor.drag(handle, "start", x[corner], x[corner])
    grab = told()
    assert isinstance(grab, Grab)
    assert grab.body == "body 0"
    assert grab.vertices[int(np.argmax(grab.weights))] == corner
    assert max(grab.weights) == pytest.approx(1.0)
    visitor.drag(handle, "update", x[corner], x[corner] + [0.0, 1.0, 0.0])
    moved = told()
    assert moved == MoveGrab(grab.grab, tuple(x[corner] + [0.0, 1.0, 0.0]))
    visitor.drag(handle, "end", x[corner], x[corner])
    assert told() == ReleaseGrab(grab.grab)


def test_who_leaves_lets_go(live, server, visit, told, until):
    visitor = visit(server.get_port())
    until(server.get_clients)
    handle, x = live.stage.body_handles[0], live.stage.moment.positions[0]
    visitor.drag(handle, "start", x, x)
    grab = told()
    visitor.leave()
    assert told() == ReleaseGrab(grab.grab)


def test_a_click_pins_and_unpins(live, made_up, visitor, told, until):
    handle = live.stage.body_handles[1]
    x = live.stage.moment.positions
    corner = int(np.argmax(x.sum(axis=1)))
    origin = x[corner] + [1.0, 1.0, 1.0]
    direction = [-1.0 + 1e-3, -1.0 - 1e-3, -1.0]
    visitor.click(handle, origin, direction)
    local = corner - live.stage.model.bodies[1].vertices.start
    assert told() == Pin("body 1", local)
    made_up.show(pinned=np.array([corner]))
    until(lambda: len(live.desk.snapshot.pinned) == 1)
    visitor.click(handle, origin, direction)
    assert told() == Unpin("body 1", local)
    visitor.press(live.panel.mouse_controls.unpin)
    assert told() == Unpin()


def test_the_ball_follows_the_pointer(live, server, visitor, told, until):
    controls = live.panel.mouse_controls
    visitor.set(controls.mode, "push")
    until(lambda: live.panel.mouse._backdrop is not None)
    visitor.set(controls.radius_input, 0.2)
    backdrop = server.scene._handle_from_node_name["/backdrop"]
    # The camera stands at z = -5 and looks along z: the ball stays in the plane of the bodies' middle.
    middle = live.stage.moment.positions.mean(axis=0)
    visitor.drag(backdrop, "start", (0.0, 0.0, 50.0), (0.0, 0.0, 50.0))
    until(lambda: live.panel.mouse._pushes)
    visitor.drag(backdrop, "update", (0.0, 0.0, 50.0), (11.0, 0.0, 50.0))
    first, second = told(), told()
    assert isinstance(first, MovePusher)
    assert first.radius == pytest.approx(0.2)
    np.testing.assert_allclose(first.center, (0.0, 0.0, middle[2]), atol=1e-9)
    np.testing.assert_allclose(second.center, (11.0 * (5.0 + middle[2]) / 55.0, 0.0, middle[2]), atol=1e-9)
    # On a body it starts before it, as seen from the camera.
    handle, touched = live.stage.body_handles[0], live.stage.moment.positions[0]
    visitor.drag(backdrop, "end", (0.0, 0.0, 50.0), (11.0, 0.0, 50.0))
    visitor.drag(handle, "start", touched, touched)
    ahead = np.asarray(told().center) - touched
    assert np.linalg.norm(ahead) == pytest.approx(1.05 * 0.2)
    assert ahead @ (np.array([0.0, 0.0, -5.0]) - touched) > 0.0
    visitor.set(controls.mode, "drag and pin")
    assert told() == RemovePusher()
    until(lambda: "/backdrop" not in server.scene._handle_from_node_name)


def test_what_is_looked_at_is_asked_for(live, visitor, told, until):
    views = live.panel.views
    visitor.set(views.color_by, "von Mises stress")
    assert told() == SetView("von_mises")
    visitor.set(views.velocities, True)
    assert told() == SetView("von_mises", velocities=True)
    visitor.set(views.contacts, True)
    assert told() == SetView("von_mises", velocities=True, contacts=True)
    until(lambda: "none are told" in views._said.content)
    visitor.set(views.surface, "wireframe")
    assert told() == SetView(None, velocities=True, contacts=True)
    until(lambda: live.stage.options.surface == "wireframe")


def test_choices_made_at_once_are_all_taken(live, visitor, until):
    views = live.panel.views
    for k in range(20):
        surface, color = ("tets", "energy density") if k % 2 else ("skin", "body")
        visitor.set(views.surface, surface)
        visitor.set(views.color_by, color)
        visitor.set(views.velocities, bool(k % 2))
    wanted = ("tets", "energy density", True)
    shown = lambda: (live.stage.options.surface, live.stage.options.color_by, live.stage.options.velocities)  # noqa: E731
    until(lambda: shown() == wanted)
    time.sleep(0.3)
    assert shown() == wanted


@pytest.mark.parametrize(
    ("preset", "ahead"), [("top", (0.0, -1.0, 0.0)), ("corner", None), ("front", None), ("side", None)]
)
def test_camera_presets_look_at_everything(live, server, visitor, until, preset, ahead):
    view, camera = live.stage.model.view, next(iter(server.get_clients().values())).camera
    visitor.set(live.panel.views.camera, preset)

    def axis():
        """The camera's third axis, which it looks along."""
        w, x, y, z = camera.wxyz
        return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])

    def looks_there():
        looks = np.asarray(camera.look_at) - np.asarray(camera.position)
        return np.allclose(camera.look_at, view.center) and np.allclose(
            axis(), looks / np.linalg.norm(looks), atol=1e-6
        )

    until(lambda: np.linalg.norm(camera.position) > 3.0 and looks_there())
    looks = np.asarray(camera.look_at) - np.asarray(camera.position)
    angle = np.arcsin(view.radius / np.linalg.norm(looks))
    assert angle < 0.5 * np.radians(35.0)  # all of it is in the picture
    if ahead is not None:
        np.testing.assert_allclose(looks / np.linalg.norm(looks), ahead, atol=2e-3)


def test_notices_are_shown_once(live, server, made_up, visitor, until, monkeypatch):
    shown = []
    client = next(iter(server.get_clients().values()))
    monkeypatch.setattr(client, "add_notification", lambda title, text, **_: shown.append(text))
    notices = (Notice(1, "info", "one"), Notice(2, "error", "two"))
    made_up.show(notices=notices[:1])
    until(lambda: shown == ["one"])
    made_up.show(notices=notices)
    made_up.show(notices=notices)
    until(lambda: len(shown) >= 2)
    time.sleep(0.2)
    assert shown == ["one", "two"]


def test_a_thousand_random_events(live, server, made_up, visit, until, caplog, capfd):
    """Three visitors do anything at all, also what no page would let them; the page stays well."""
    visitors = [visit(server.get_port()) for _ in range(3)]
    until(lambda: len(server.get_clients()) == 3)
    rng = random.Random(3)
    values = (
        0.0,
        1.0,
        -1.0,
        1e30,
        float("nan"),
        float("inf"),
        5,
        True,
        "push",
        "skin",
        "cut",
        "xpbd",
        "x",
        None,
        [],
        0.3,
    )
    numbers = (0.0, 0.5, -2.0, 1e9, float("nan"), float("inf"))
    for k in range(1000):
        visitor = rng.choice(visitors)
        handles = list(server.gui._gui_input_handle_from_uuid.values())
        what = rng.random()
        if what < 0.6:
            handle = rng.choice(handles)
            options = getattr(handle, "options", None)
            value = rng.choice(options) if options and rng.random() < 0.7 else rng.choice(values)
            if not options and rng.random() < 0.5:
                value = rng.uniform(getattr(handle, "min", 0.0), getattr(handle, "max", 1.0))
            visitor.set(handle, value)
        elif what < 0.9:
            handle = rng.choice(live.stage.body_handles)
            phase = rng.choice(("start", "update", "update", "end"))
            visitor.drag(handle, phase, rng.choices(numbers, k=3), rng.choices(numbers, k=3))
        else:
            handle = rng.choice(live.stage.body_handles)
            visitor.click(handle, rng.choices(numbers, k=3), rng.choices(numbers, k=3))
        if k % 100 == 0:
            grabs = (GrabState(1, "body 0", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),) if rng.random() < 0.5 else ()
            made_up.show(grabs=grabs, time=0.01 * k)
    # All of it has been dealt with once what was said last has come through; another visitor may have been faster.
    factors = iter(np.linspace(0.2, 0.9, 1000))

    def heard(visitor, said):
        said.append(float(next(factors)))
        visitor.set(live.panel.time.speed, said[-1])
        time.sleep(0.3)
        return any(SetSpeed(factor) in made_up.told for factor in said)

    for visitor in visitors:
        said = []
        until(lambda: heard(visitor, said), 60.0)  # noqa: B023 - it is asked for here and now
    made_up.show(time=99.0)
    until(lambda: live.desk.snapshot.time == 99.0)
    assert len(server.get_clients()) == 3
    assert caplog.records == []
    printed = capfd.readouterr()
    assert "Traceback" not in printed.out + printed.err
    assert Translator().moment(made_up.snapshot).positions is not None
    for visitor in visitors:
        visitor.leave()
