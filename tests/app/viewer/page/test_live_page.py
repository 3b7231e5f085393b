"""What the page of a live simulation sends to browsers, and what their messages do; with a fake simulation."""

import json
import logging
import random
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from tests.app.viewer.page.conftest import Visitor, describe, served_page, snapshot_of

import supple as sp
from supple.app.viewer import live_page
from supple.app.viewer.messages import measured, slowness
from supple.app.viewer.protocol.commands import (
    Grab,
    MoveGrab,
    Pause,
    Pin,
    Play,
    ReleaseGrab,
    Reset,
    SetParameter,
    SetSolver,
    SetSpeed,
    SetView,
    Step,
    Unpin,
)
from supple.app.viewer.protocol.snapshots import GrabState, Notice, Progress, Reading, Timing
from supple.errors import SceneError


@pytest.fixture
def received(fake, until):
    """Wait for a command."""

    def wait():
        until(lambda: fake.received, what="a command")
        return fake.received.pop(0)

    return wait


def test_the_scene_comes_once_and_frames_follow(visitor, fake, until):
    (scene,) = visitor.scenes
    assert [body["name"] for body in scene["bodies"]] == ["body 0", "body 1"]
    assert (scene["title"], scene["command"], scene["reload"]) == ("boxes", "supple view boxes.yaml", False)
    assert {"name": "youngs", "label": "Young's modulus [kPa]", "factor": 1e3, "whole": False} in scene["parameters"]
    for k in range(1, 4):
        fake.show(positions=fake.snapshot.positions + 0.1, time=0.1 * k)
        until(lambda k=k: visitor.frames[-1]["time"] == 0.1 * k)
        points = visitor.arrays[-1](visitor.frames[-1]["points"]).reshape(-1, 3)
        np.testing.assert_allclose(points, fake.snapshot.positions, atol=1e-6)
    assert len(visitor.scenes) == 1
    assert visitor.frames[-1]["bodies"][0]["youngs"] == 1e5
    assert visitor.frames[-1]["values"]["substeps"] == 20


def test_nothing_is_sent_while_nothing_changes(visitor, until):
    until(lambda: visitor.statuses)
    before = len(visitor.frames), len(visitor.statuses)
    time.sleep(0.5)
    assert (len(visitor.frames), len(visitor.statuses)) == before


def test_another_scene_is_sent_before_its_frames(visitor, fake, until):
    fake.snapshot = snapshot_of(describe(sp.shapes.box((1, 1, 1), (1, 1, 1))))
    fake.starts += 1
    until(lambda: len(visitor.scenes) == 2)
    until(lambda: visitor.frames[-1]["points"]["count"] == 3 * 8)
    assert [body["name"] for body in visitor.scenes[1]["bodies"]] == ["body 0"]


def test_acts_become_commands(visitor, received):
    for act, values, command in (
        ("Play", {}, Play()),
        ("Pause", {}, Pause()),
        ("Step", {"count": 3}, Step(3)),
        ("Reset", {}, Reset()),
        ("SetSpeed", {"factor": 0.5}, SetSpeed(0.5)),
        ("SetSolver", {"kind": "implicit"}, SetSolver("implicit")),
        ("SetParameter", {"name": "youngs", "value": 3e4, "body": "body 1"}, SetParameter("youngs", 3e4, "body 1")),
        ("SetParameter", {"name": "gravity", "value": 0, "body": None}, SetParameter("gravity", 0.0)),
        ("Unpin", {}, Unpin()),
        ("view", {"field": "J", "contacts": True}, SetView("J", True)),
    ):
        visitor.send(act, **values)
        assert received() == command


@pytest.mark.parametrize(
    ("message", "why"),
    [
        ("hello", "a message is not JSON"),
        ("[" * 30_000, "a message is not JSON"),
        ("[1]", "a message is not an object"),
        ('{"act": "AddBody", "shape": "box"}', "'AddBody' is not an act of this page"),
        ('{"act": "put", "kind": "a", "message": "b"}', "'put' is not an act of this page"),
        ('{"act": "Play", "count": 1}', "Play does not take 'count'"),
        ('{"act": "Step", "count": 1e9}', "count is 1000000000.0; give a whole number"),
        ('{"act": "SetSpeed", "factor": "fast"}', "speed is 'fast'; give a number"),
        ('{"act": "SetParameter", "name": "__class__", "value": 1}', "parameter '__class__' does not exist"),
        ('{"act": "SetSolver", "kind": ["xpbd"]}', "solver is ['xpbd']; it must be xpbd or implicit"),
        ('{"act": "grab", "point": [0, 0, NaN], "target": [0, 0, 0]}', "point is nan"),
        ('{"act": "grab", "point": [0, 0, 0], "target": [1e99, 0, 0]}', "target is 1e+99"),
        ('{"act": "click", "point": 7}', "point is 7; give a list"),
        ('{"act": "view", "field": "x", "contacts": false}', "tet_values is 'x'"),
        ('{"act": "grab"}', "does not take nothing"),
    ],
)
def test_what_makes_no_sense_is_rejected_in_a_line(visitor, fake, until, message, why):
    visitor.line.send(message)
    until(lambda: visitor.notices)
    (notice,) = visitor.notices
    assert notice["level"] == "error"
    assert notice["text"].startswith("Rejected: ")
    assert why in notice["text"]
    assert len(notice["text"]) < 200
    assert fake.received == []
    visitor.send("Play")
    until(lambda: fake.received == [Play()])


def test_a_body_is_grabbed_where_it_is_and_released(visitor, fake, received):
    corner = fake.snapshot.positions[0]
    visitor.send("move", target=[0, 0, 0])  # of nothing
    visitor.send("grab", point=list(corner - 0.01), target=[0.0, 1.0, 0.0])
    grab = received()
    assert isinstance(grab, Grab)
    assert (grab.body, grab.target, grab.stiffness) == ("body 0", (0.0, 1.0, 0.0), 1.0)
    held = np.array(grab.weights) @ fake.snapshot.positions[list(grab.vertices)]
    np.testing.assert_allclose(held, corner, atol=1e-9)
    visitor.send("move", target=[0.0, 2.0, 0.0])
    assert received() == MoveGrab(grab.grab, (0.0, 2.0, 0.0))
    fake.show(grabs=(GrabState(grab.grab, "body 0", tuple(corner), (0.0, 2.0, 0.0)),))
    visitor.send("release")
    assert received() == ReleaseGrab(grab.grab)
    visitor.send("release")
    visitor.send("Play")
    assert received() == Play()


def test_who_leaves_releases_what_is_held(live, visitor, fake, received, until):
    other = Visitor(live.port)
    until(lambda: other.frames)
    grabs = []
    for who in (visitor, other):
        who.send("grab", point=[0, 0, 0], target=[0, 1, 0])
        grabs.append(received().grab)
    assert grabs[0] != grabs[1]
    other.line.socket.close()
    assert received() == ReleaseGrab(grabs[1])
    visitor.leave()
    assert received() == ReleaseGrab(grabs[0])


def test_a_click_pins_and_another_one_unpins(visitor, fake, received, until):
    corner = fake.snapshot.positions[27]
    visitor.send("click", point=list(corner))
    assert received() == Pin("body 1", 0)
    fake.show(pinned=np.array([27]))
    until(lambda: visitor.frames[-1]["pins"]["count"] == 1)
    visitor.send("click", point=list(corner))
    assert received() == Unpin("body 1", 0)


def test_springs_contacts_and_fields_are_in_frames(visitor, fake, until):
    forces = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), np.array([[0.0, 5.0, 0.0], [0.0, 10.0, 0.0]])
    values = np.linspace(0.5, 1.5, fake.snapshot.description.n_tets)
    spring = GrabState(1, "body 0", (0.0, 1.0, 2.0), (3.0, 4.0, 5.0))
    fake.show(grabs=(spring,), contact_points=forces[0], contact_forces=forces, tet_values=values, tet_quantity="J")
    until(lambda: visitor.frames[-1]["field"])
    frame, array = visitor.frames[-1], visitor.arrays[-1]
    np.testing.assert_array_equal(array(frame["grabs"]), [0, 1, 2, 3, 4, 5])
    np.testing.assert_array_equal(array(frame["touching"]), forces[0].ravel())
    arrows = array(frame["contacts"]).reshape(-1, 2, 3)
    np.testing.assert_array_equal(arrows[:, 0], forces[0])
    lengths = np.linalg.norm(arrows[:, 1] - arrows[:, 0], axis=1)
    assert lengths[1] == pytest.approx(2.0 * lengths[0])
    assert frame["field"]["key"] == "J"
    assert frame["field"]["ends"] == [0.5, 1.5]
    shares = array(frame["field"]["values"])
    assert (len(shares), shares.dtype) == (len(fake.snapshot.positions), np.uint8)
    assert shares.min() < 60
    assert shares.max() > 195


def test_numbers_of_all_snapshots_are_in_frames(live, visitor, fake, until):
    titles = {plot["title"]: [one["name"] for one in plot["series"]] for plot in visitor.scenes[0]["plots"]}
    assert titles["energy [J]"] == ["kinetic", "elastic", "potential"]
    width = 1 + sum(map(len, titles.values()))
    rows = lambda: visitor.arrays[-1](visitor.frames[-1]["numbers"]).reshape(-1, width)  # noqa: E731
    for k in range(1, 5):
        fake.show(time=0.1 * k, measures=replace(fake.snapshot.measures, kinetic_energy=float(k)))
        until(lambda k=k: live.frame.time == 0.1 * k)
    until(lambda: rows()[-1, 0] == 0.4)
    np.testing.assert_allclose(rows()[:, 0], [0.0, 0.1, 0.2, 0.3, 0.4])
    np.testing.assert_allclose(rows()[1:, 1], [1.0, 2.0, 3.0, 4.0])
    fake.show(time=0.0)
    until(lambda: rows()[-1, 0] == 0.0)
    assert len(rows()) == 1


def test_a_visitor_who_never_reads_does_not_block_others(live, fake, until):
    stuck = Visitor(live.port, reads=False)
    others = [Visitor(live.port) for _ in range(9)]
    until(lambda: all(other.frames for other in others))
    end = threading.Event()

    def run():
        while not end.wait(0.005):
            fake.show(positions=fake.snapshot.positions + 1e-4, time=fake.snapshot.time + 0.01)

    thread = threading.Thread(target=run)
    thread.start()
    until(lambda: all(len(other.frames) > 40 for other in others), 60.0)
    # Of the one who never says that a frame was drawn, nothing waits: it gets the next one when it does.
    waiting = [len(visitor._waiting) for visitor in live._visitors]
    end.set()
    thread.join()
    assert max(waiting) <= 3
    for visitor in (stuck, *others):
        visitor.leave()


def test_a_simulation_that_has_ended_is_started_again(visitor, fake, received, until):
    visitor.send("restart")  # one that runs is not
    visitor.send("Play")
    assert received() == Play()
    fake.error = "it ran <b>out</b> of memory"
    until(lambda: visitor.statuses and visitor.statuses[-1]["error"] == fake.error)
    assert fake.starts == 0
    visitor.send("view", field="J", contacts=False)
    assert received() == SetView("J")
    visitor.send("restart")
    until(lambda: fake.starts == 1)
    assert received() == SetView("J")  # the new process is told what to send
    until(lambda: visitor.statuses[-1]["error"] is None)


def test_reload_sends_the_scene_that_is_read_again(fake, until):
    fake.show(notices=(Notice(7, "info", "seven"),))
    one = snapshot_of(describe(sp.shapes.box((1, 1, 1), (1, 1, 1))))
    fake.again = lambda: fake.__setattr__("snapshot", one)
    with served_page(fake) as page:
        visitor = Visitor(page.port)
        until(lambda: visitor.frames)
        assert visitor.scenes[0]["reload"]
        visitor.send("reload")
        until(lambda: len(visitor.scenes) == 2)
        assert [body["name"] for body in visitor.scenes[1]["bodies"]] == ["body 0"]
        fake.show(notices=(Notice(1, "info", "one"),))
        until(lambda: visitor.notices and visitor.notices[-1]["text"] == "one")

        def broken():
            raise SceneError("scene.yaml:3: wrong")

        fake.again = broken
        visitor.send("reload")
        until(lambda: visitor.notices[-1]["text"] == "Not started: scene.yaml:3: wrong")
        visitor.leave()


def test_the_progress_of_a_long_step(visitor, fake, until, monkeypatch):
    said = lambda: visitor.statuses[-1]["busy"] if visitor.statuses else ""  # noqa: E731
    fake.progress = Progress(7.2, 31)
    until(lambda: said() == "Busy for 7 s: a long step, substep 31")
    fake.progress = Progress(8.0, 0, kernels=(12, 68))
    until(lambda: "compiling kernel 12 of 68" in said())
    fake.progress = None
    until(lambda: said() == "")
    monkeypatch.setattr(live_page, "_SILENT_AFTER", -1.0)  # without any message of the simulation
    until(lambda: "Busy for 0 s" in said())


def test_the_page_is_there_before_the_simulation(fake, until):
    with served_page(None) as page:
        visitor = Visitor(page.port)
        until(lambda: visitor.statuses and visitor.statuses[-1]["busy"].endswith("s: reading and meshing"))
        with page.reading():
            logging.getLogger("supple.mesh.meshing").warning("filling %d triangles", 12)
        until(lambda: visitor.statuses[-1]["busy"].endswith("reading and meshing: filling 12 triangles"))
        assert visitor.statuses[-1]["command"] == "supple view boxes.yaml"
        for act, values in (
            ("Play", {}),
            ("click", {"point": [0, 0, 0]}),
            ("grab", {"point": [0] * 3, "target": [0] * 3}),
        ):
            visitor.send(act, **values)
            until(lambda: visitor.notices)
            assert visitor.notices.pop()["text"] == "Rejected: the simulation has not started yet"
        for act in ("restart", "reload", "release"):
            visitor.send(act)
        visitor.send("record", on=True)
        shown, fake.snapshot, fake.progress = fake.snapshot, None, Progress(3.0, 0, kernels=(2, 9))
        page.attach(fake)
        until(lambda: visitor.statuses[-1]["busy"] == "Busy for 3 s: compiling kernel 2 of 9, once on this machine")
        assert visitor.scenes == []
        fake.snapshot, fake.progress = shown, None
        until(lambda: visitor.frames)
        until(lambda: visitor.statuses[-1]["busy"] == "")
        assert (fake.received, visitor.notices) == ([], [])
        visitor.leave()


def test_nobody_watches_without_a_browser(live, fake, until, monkeypatch):
    monkeypatch.setattr(live_page, "_UNWATCHED_AFTER", 0.1)
    until(lambda: not fake.watched)
    visitor = Visitor(live.port)
    until(lambda: fake.watched)
    visitor.leave()
    until(lambda: not fake.watched)


def test_a_recorded_page_is_sent_to_who_stops(live, visitor, fake, until):
    visitor.send("record", on=True)
    until(lambda: visitor.statuses and visitor.statuses[-1]["recording"])
    for k in range(3):
        wanted = fake.show(positions=fake.snapshot.positions + 0.1, time=0.1 * (k + 1))
        until(lambda wanted=wanted: live.frame.time == wanted.time)
    visitor.send("record", on=False)
    until(lambda: visitor.files)
    (file,) = visitor.files
    assert file["name"] == "supple.html"
    assert b"<title>body 0, body 1 \xc2\xb7 Supple</title>" in file["content"]
    assert b'<script id="data" type="text/plain">' in file["content"]
    until(lambda: not visitor.statuses[-1]["recording"])


def test_slowness_has_a_cause_and_a_remedy(fake):
    slow = Timing(40.0, 25.0, 0.42, keeps_up=False)
    measures = replace(fake.snapshot.measures, iterations=20)
    snapshot = fake.show(paused=False, timing=slow, measures=measures)
    assert slowness(snapshot) == (
        "Too slow: a step takes 40 ms of 17 ms: 20 substeps, 96 tets, 0 contacts; slow motion 0.3 keeps up"
    )
    implicit = replace(snapshot.description, solver="implicit", values={"dt": 0.02})
    said = slowness(replace(snapshot, description=implicit, measures=replace(measures, iterations=9)))
    assert "a step takes 40 ms of 20 ms: 9 Newton iterations" in said
    assert said.endswith("slow motion 0.4 keeps up")
    assert "busy with something else" in slowness(replace(snapshot, timing=replace(slow, step_ms=5.0)))
    assert slowness(replace(snapshot, timing=Timing(5.0, 60.0, 1.0))) == ""
    assert slowness(replace(snapshot, paused=True)) == ""


def test_measures_are_lines(fake):
    measures = replace(fake.snapshot.measures, kinetic_energy=1.2e3, min_det_F=0.123)
    readings = (Reading("left", "N", 1.5), Reading("air", "Pa", 2e3))
    lines = measured(fake.show(measures=measures, readings=readings))
    assert lines[0] == "energy 1.21 kJ, of motion 1.2 kJ"
    assert lines[1] == "smallest J 0.123, 0 contacts"
    assert lines[-2:] == ["left 1.5 N", "air 2 kPa"]
    bad = replace(measures, status="inverted", message="12 tets of body 'x' inverted; take substeps=60")
    assert "inverted: 12 tets of body 'x' inverted; take substeps=60" in measured(fake.show(measures=bad))


def test_random_messages_change_nothing_but_what_they_say(visitor, fake, until, caplog):
    generator = random.Random(5)
    values = [None, True, -1, 1e300, "x" * 3000, [], {}, [0, 0, 0], [[1]], "body 0", float("nan"), 3]
    keys = ["act", "count", "factor", "kind", "name", "value", "body", "point", "target", "on", "field", "vertex"]
    acts = ["Play", "Step", "SetSpeed", "SetSolver", "SetParameter", "grab", "move", "click", "view", "drawn", "record"]
    for _ in range(400):
        told = {key: generator.choice(values) for key in generator.sample(keys, generator.randint(0, 4))}
        visitor.line.send(json.dumps({**told, "act": generator.choice([*acts, generator.choice(values)])}))
    fake.received.clear()
    visitor.send("Reset")
    until(lambda: Reset() in fake.received)
    assert [record for record in caplog.records if record.levelname in ("ERROR", "WARNING")] == []
