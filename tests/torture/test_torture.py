"""Torture scenes: all their claims hold, and the independent check of their recordings passes."""

from dataclasses import replace

import numpy as np
import pytest
from tests.torture import stack, twist8
from tests.torture.registry import TORTURE

import supple as sp
from supple.model.state import Status
from supple.results.check.report import Verdict


class FirstStep:
    """A sink that passes only the first step on."""

    def __init__(self, sink):
        self.sink, self.steps = sink, 0

    def begin(self, first, dt, steps):
        self.sink.begin(first, dt, steps)

    def write(self, frame):
        if self.steps == 0:
            self.sink.write(frame)
        self.steps += 1

    def end(self):
        self.sink.end()


def assert_holds(demo, path, may_fail=()):
    measurement, after_one_step, solver = demo.measurement(), demo.measurement(), demo.solver()
    sinks = [measurement, FirstStep(after_one_step), sp.Recorder(path, solver=solver)]
    frames = list(sp.simulate(demo.scene(), solver, demo.dt, demo.steps, sinks=sinks))
    assert [claim for claim in measurement.claims() if not claim.holds] == []
    early = after_one_step.claims()
    assert all(claim.text and claim.measured for claim in early)
    assert not all(claim.holds for claim in early)
    assert len(frames) == demo.steps
    for frame in frames:
        assert frame.report.status is Status.CONVERGED
        assert frame.report.min_det_F > 0.0
        assert frame.report.min_distance is None or frame.report.min_distance > 0.0
    checked = sp.check_recording(path)
    failed = [result for result in checked.results if result.verdict is Verdict.FAIL and result.name not in may_fail]
    assert [f"{result.name}: {result.message}" for result in failed] == []
    assert checked.ok or may_fail
    assert checked["intersection"].verdict is Verdict.PASS
    assert checked["inversion"].verdict is Verdict.PASS


# The first step of the arch takes as long as all the others together.
@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name == "arch")) for name in TORTURE])
def test_claims_of_the_small_scene_hold_and_its_recording_passes_the_check(name, tmp_path):
    assert_holds(TORTURE[name].small, tmp_path / "recording.vtkhdf")


@pytest.mark.slow
@pytest.mark.parametrize("name", TORTURE)
def test_claims_of_the_full_scene_hold_and_its_recording_passes_the_check(name, tmp_path):
    assert_holds(TORTURE[name].full, tmp_path / "recording.vtkhdf")


# Twist, squeeze and cut: what quadratic tets are bent by. The check proves that J is positive everywhere in each.
@pytest.mark.slow
@pytest.mark.parametrize("size", ["small", "full"])
@pytest.mark.parametrize("name", ["twist8", "rollers", "knives"])
def test_claims_hold_with_quadratic_bodies(name, size, tmp_path):
    demo = getattr(TORTURE[name], size)
    scene = demo.scene()
    bodies = [body.changed(mesh=body.mesh.to_order(2)) for body in scene.bodies]
    assert_holds(replace(demo, scene=lambda: replace(scene, bodies=bodies)), tmp_path / "recording.vtkhdf")


def test_a_scene_in_millimetres_takes_the_same_shapes():
    """Lengths, gravity and moduli are scaled; times and densities stay: every formula is the same but for a factor."""
    solver = sp.Implicit(tolerance=stack.TOLERANCE)
    steps = 8
    metres = list(sp.simulate(stack.scene(2), solver, 1 / 50, steps))
    millimetres = list(sp.simulate(stack.scene(2, scale=1e-3), solver, 1 / 50, steps))
    assert metres[-1].report.details.contacts > 0
    for large, small in zip(metres, millimetres, strict=True):
        assert small.report.status is large.report.status is Status.CONVERGED
        off = np.abs(1e3 * small.state.positions - large.state.positions).max()
        assert off <= 1e-6 * stack.SIDE


@pytest.mark.slow
@pytest.mark.parametrize("dt", [2e-2, 0.2, 2.0])
def test_the_twist_converges_with_steps_of_any_length(dt, tmp_path):
    # The work of pins is that of their forces along chords: far from that along the arcs of 144 degrees in 2 s.
    assert_holds(twist8.demo((24, 1), dt), tmp_path / "recording.vtkhdf", ("energy",) if dt == 2.0 else ())


@pytest.mark.slow
def test_the_folded_rod_converges_with_steps_of_two_milliseconds():
    demo = twist8.demo((24, 1), 0.2)
    scene = demo.scene()
    *_, folded = sp.simulate(scene, demo.solver(), demo.dt, 50)
    frames = list(sp.simulate(scene, demo.solver(), 2e-3, 200, start=folded))
    assert len(frames) == 200
    for frame in frames:
        assert frame.report.status is Status.CONVERGED
        assert frame.report.min_det_F > 0.0
        assert frame.report.min_distance is not None
        assert frame.report.min_distance > 0.0
