"""What the page tells about the simulation: its speed, its end, long steps, energies, sensors."""

import time
from dataclasses import replace

import numpy as np
from tests.app.viewer.page.conftest import describe, snapshot_of

import supple as sp
from supple.app.viewer import live_page
from supple.app.viewer.live_page import LivePage
from supple.app.viewer.protocol.commands import Play, SetSpeed, SetView
from supple.app.viewer.protocol.snapshots import Notice, Progress, Reading, Timing
from supple.errors import SceneError


def test_the_page_names_the_bottleneck_and_has_a_remedy(live, fake, visitor, received, until):
    warning = lambda: live.panel.overlay.part("warning")  # noqa: E731
    measures = replace(fake.snapshot.measures, iterations=20)
    slow = Timing(40.0, 25.0, 0.42, keeps_up=False)
    fake.show(paused=False, timing=slow, measures=measures)
    until(lambda: "a step takes 40 ms of 17 ms: 20 substeps of 96 tets" in warning())
    assert "Slow motion 0.3" in warning()
    assert "0.42 of real time" in live.panel.time._message.content
    visitor.press(live.panel.time.remedy)
    assert received() == SetSpeed(0.3)
    implicit = replace(fake.snapshot.description, solver="implicit", values={"dt": 0.02}, revision=2)
    measures = replace(measures, iterations=9, contacts=7)
    fake.show(description=implicit, measures=measures)
    until(lambda: "9 Newton iterations with 96 tets and 7 contacts" in warning())
    assert "Slow motion 0.4" in warning()
    visitor.press(live.panel.time.remedy)
    assert received() == SetSpeed(0.4)
    fake.show(timing=replace(slow, step_ms=5.0))
    until(lambda: "the machine is busy with something else" in warning())
    fake.show(timing=Timing(5.0, 60.0, 1.0))
    until(lambda: warning() == "")
    assert fake.received == []


def test_a_simulation_that_has_ended_is_started_again(live, fake, visitor, received, until):
    part = live.panel.overlay.part
    fake.error = "it ran <b>out</b> of memory"
    until(lambda: "has ended: it ran &lt;b&gt;out&lt;/b&gt; of memory" in part("warning"))
    assert "Restart the simulation" in part("warning")
    assert live.panel.time.play.disabled
    visitor.press(live.panel.time.restart)
    until(lambda: fake.starts == 1)
    assert received() == SetView()  # the new process is told what to send
    fake.show(time=0.0)
    until(lambda: part("warning") == "" and not live.panel.time.play.disabled)
    visitor.press(live.panel.time.restart)  # one that runs is not started again
    visitor.press(live.panel.time.play)
    until(lambda: fake.received == [Play()])
    assert fake.starts == 1


def test_a_restart_while_the_end_is_displayed(live, fake, visitor, until, monkeypatch):
    """The page's thread has read the error, and displays it only after the restart."""
    part, show_error = live.panel.overlay.part, live.panel.time.show_error
    fake.error = "the end"
    until(lambda: "has ended" in part("warning"))

    def late(error: str) -> None:
        visitor.press(live.panel.time.restart)
        until(lambda: fake.starts == 1)
        time.sleep(0.2)  # what the restart does after it
        show_error(error)
        monkeypatch.setattr(live.panel.time, "show_error", show_error)

    monkeypatch.setattr(live.panel.time, "show_error", late)
    until(lambda: live.panel.time.show_error == show_error)
    fake.show(time=0.0)
    until(lambda: part("warning") == "" and not live.panel.time.play.disabled)


def test_the_progress_of_a_long_step(live, fake, until, monkeypatch):
    part = live.panel.overlay.part
    fake.show(time=1.25)
    fake.progress = Progress(7.2, 31)
    until(lambda: part("busy").endswith("Busy for 7 s: a long step, substep 31</div>"))
    fake.progress = Progress(8.0, 0, kernels=(12, 68))
    until(lambda: "compiling kernel 12 of 68" in part("busy"))
    until(lambda: "t = 1.25 s" in live.panel.time._message.content)
    fake.progress = None
    until(lambda: part("busy") == "")
    # Without any message of the simulation.
    monkeypatch.setattr(live_page, "_SILENT_AFTER", -1.0)
    until(lambda: "Busy for 0 s" in part("busy"))


def test_nobody_watches_without_a_browser(live, fake, server, visit, until, monkeypatch):
    monkeypatch.setattr(live_page, "_UNWATCHED_AFTER", 0.1)
    until(lambda: not fake.watched)
    visitor = visit(server.get_port())
    until(lambda: fake.watched)
    visitor.leave()
    until(lambda: not fake.watched)


def test_energy_and_smallest_j_are_always_displayed(live, fake, until):
    measures = replace(fake.snapshot.measures, kinetic_energy=1.2e3, min_det_F=0.123)
    fake.show(time=0.5, measures=measures)
    until(lambda: "smallest J 0.123" in live.panel.overlay.part("state"))
    state = live.panel.overlay.part("state")
    assert "energy 1.21 kJ" in state
    assert state.count("<polyline") == 2


def test_sensors_cavities_and_cables_are_plots(live, fake, until):
    plots = live.panel.sensors.plots
    assert not live.panel.sensors._folder.visible
    for k in range(5):
        fingers = Reading("left", "N", 1.0 + k), Reading("right", "N", 2.0 * k), Reading("air", "Pa", 1e3)
        snapshot = fake.show(time=0.1 * k, readings=fingers)
        until(lambda: live.controller.snapshot is snapshot)  # noqa: B023
    until(lambda: set(plots) == {"N", "Pa"} and len(plots["N"].data[0]) >= 5, what="both plots")
    assert [item["label"] for item in plots["N"].series] == ["t [s]", "left", "right"]
    np.testing.assert_allclose(plots["N"].data[1][-5:], [1.0, 2.0, 3.0, 4.0, 5.0])
    np.testing.assert_allclose(plots["N"].data[2][-5:], [0.0, 2.0, 4.0, 6.0, 8.0])
    np.testing.assert_allclose(plots["Pa"].data[1][-5:], 1e3)
    fake.show(time=0.6, readings=(Reading("air", "Pa", 5.0),))
    until(lambda: set(plots) == {"Pa"})


def test_reload_draws_the_scene_that_is_read_again(server, fake, visit, until, monkeypatch):
    """Also where it has the generation of the one before; its notices are new ones."""
    fake.show(notices=(Notice(7, "info", "seven"),))
    two, one = fake.snapshot, snapshot_of(describe(sp.shapes.box((1, 1, 1), (1, 1, 1))))
    fake.again = lambda: fake.__setattr__("snapshot", one)
    page = LivePage(server, fake, two)
    visitor = visit(server.get_port())
    until(server.get_clients)
    assert page.panel.time.reload.visible
    displayed = []
    client = next(iter(server.get_clients().values()))
    monkeypatch.setattr(client, "add_notification", lambda title, text, **_: displayed.append(text))
    visitor.press(page.panel.time.reload)
    until(lambda: [body.name for body in page.stage.model.bodies] == ["body 0"])
    until(lambda: page.panel.bodies.which.options == ("all bodies", "body 0"))
    fake.show(notices=(Notice(1, "info", "one"),))
    until(lambda: displayed == ["one"])

    def broken():
        raise SceneError("scene.yaml:3: wrong")

    fake.again = broken
    visitor.press(page.panel.time.reload)
    until(lambda: displayed[-1] == "scene.yaml:3: wrong")
    until(lambda: page.panel.overlay.part("warning") == "")
    visitor.leave()
    page.stop()


def test_without_a_file_nothing_is_reloaded(live):
    assert not live.panel.time.reload.visible
