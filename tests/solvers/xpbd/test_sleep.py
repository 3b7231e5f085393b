"""Bodies at rest sleep, carry their weight, and wake when anything happens to them."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.model.state import State
from supple.model.system import build_system
from supple.results.checkpoint.file import Checkpoint, RunFacts, read_checkpoint, write_checkpoint

MESH = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
MATERIAL = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0, damping=0.02)
FLOOR = sp.HalfSpace(name="floor", friction=0.5)
DT = 1 / 60
WEIGHT = 9.81  # of one box [N]


def box(name: str, *place: float, **more) -> sp.Body:
    return sp.Body(name, MESH, MATERIAL, friction=0.5, position=place, **more)


def stack(*more: sp.Body, **scene) -> sp.Scene:
    """Two boxes that rest on each other after a short fall."""
    bodies = [box("low", 0, 0.052, 0), box("high", 0.01, 0.156, 0.005), *more]
    return sp.Scene(bodies, **{"obstacles": [FLOOR], **scene})


def asleep(frame: sp.Frame) -> set[str]:
    return {name for name, rests in frame.report.details.asleep.items() if rests}


@pytest.fixture(scope="module")
def settled() -> sp.Frame:
    """The stack when it has slept for two frames."""
    slept = 0
    for frame in sp.simulate(stack(), sp.XPBD(), DT, 120):
        slept += bool(asleep(frame))
        if slept == 2:
            return frame
    raise AssertionError("nothing fell asleep")


def continued(frame: sp.Frame, scene: sp.Scene, state: State | None = None, steps: int = 1) -> list[sp.Frame]:
    return list(sp.simulate(scene, sp.XPBD(), DT, steps, start=state or frame.state))[-steps:]


def test_sleeping_bodies_keep_their_bits_and_their_weights(settled):
    assert asleep(settled) == {"low", "high"}
    assert settled.time > 0.5
    frames = continued(settled, stack(), steps=3)
    for frame in frames:
        assert frame.report.status is sp.Status.CONVERGED
        assert asleep(frame) == {"low", "high"}
        assert np.array_equal(frame.state.positions, settled.state.positions)
        assert not frame.state.velocities.any()
        forces = frame.report.details.contact_forces
        np.testing.assert_allclose(forces["floor"], [0, -2 * WEIGHT, 0], atol=0.01 * WEIGHT)
        np.testing.assert_allclose(forces["high"], [0, WEIGHT, 0], atol=0.01 * WEIGHT)
        for name in ("low", "high"):
            total = frame.contact_force[name].sum(axis=0)
            np.testing.assert_allclose(total, [0, WEIGHT, 0], atol=0.01 * WEIGHT)


def test_the_place_of_rest_is_that_of_a_simulation_without_sleep(settled):
    for frame in sp.simulate(stack(), sp.XPBD(sleep_after=None), DT, 120):
        assert not asleep(frame)
    np.testing.assert_allclose(frame.state.positions, settled.state.positions, atol=0.01 * 0.05)


def test_only_the_island_that_is_hit_wakes():
    # The third box lies apart; the fourth falls on the stack.
    scene = stack(box("apart", 0.4, 0.052, 0), box("falling", 0.02, 3.5, 0))
    woken = None
    for frame in sp.simulate(scene, sp.XPBD(), DT, 60):
        assert frame.report.min_det_F > 0.0
        if asleep(frame) == {"low", "high", "apart"}:
            place = frame.positions["high"].copy()
        elif woken is None and asleep(frame) == {"apart"} and frame.time > 0.7:
            woken = frame
    assert woken is not None
    # It woke in the frame of the blow, which it took up at once.
    assert np.abs(woken.velocities["high"]).max() > 0.5
    assert np.abs(woken.positions["high"] - place).max() > 1e-3
    assert woken.report.details.contact_forces["falling"][1] > 10 * WEIGHT
    forces = woken.report.details.contact_forces
    np.testing.assert_allclose(forces["apart"], [0, WEIGHT, 0], atol=0.01 * WEIGHT)


def test_a_changed_state_wakes(settled):
    faster = settled.state.velocities.copy()
    faster[settled.system.bodies[1].vertices] = [0.0, 1.0, 0.0]
    thrown = replace(settled.state, velocities=faster)
    (frame,) = continued(settled, stack(), thrown)
    assert not asleep(frame)
    assert frame.velocities["high"][:, 1].mean() == pytest.approx(1.0 - 9.81 * DT, abs=0.05)


@pytest.mark.parametrize(
    "changed",
    [
        {"gravity": (0.0, 0.0, 9.81)},
        {"obstacles": [sp.HalfSpace(name="floor", friction=0.5, point=(0, -1, 0))]},
        {"obstacles": [sp.HalfSpace(name="floor", friction=0.5, motion=lambda t: (0.0, 0.1 * np.sin(40 * t), 0.0))]},
        {"forces": [sp.Force("high", [0], (0.0, 0.0, 40.0))]},
        {"cables": [sp.Cable([("high", 0), (None, (0.0, 1.0, 0.0))], tension=40.0)]},
    ],
    ids=["gravity", "another floor", "a floor that moves", "a force", "a cable"],
)
def test_a_changed_scene_wakes(settled, changed):
    (frame,) = continued(settled, stack(**changed))
    assert not asleep(frame)
    assert not np.array_equal(frame.state.positions, settled.state.positions)


def test_drifting_without_gravity_is_no_rest():
    scene = sp.Scene([box("drifting", 0, 0, 0, velocity=(1e-7, 0.0, 0.0))], gravity=(0, 0, 0))
    for frame in sp.simulate(scene, sp.XPBD(substeps=2), DT, 45):
        assert not asleep(frame)
    assert frame.velocities["drifting"][:, 0] == pytest.approx(1e-7, rel=1e-6)


def test_turning_slowly_is_no_rest():
    # At the turning point of its swing a soft beam is slow for longer than a body must rest.
    soft = sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=1000.0)
    mesh = sp.shapes.box((1.0, 0.1, 0.1), (8, 1, 1))
    pin = sp.Pin("beam", np.flatnonzero(mesh.vertices[:, 0] < -0.49))
    scene = sp.Scene([sp.Body("beam", mesh, soft, position=(0, 0, 0))], pins=[pin], gravity=(0, 0, -0.002))
    tip = []
    for frame in sp.simulate(scene, sp.XPBD(substeps=10), 0.1, 250):
        assert not asleep(frame)
        tip.append(frame.positions["beam"][:, 2].min())
    # It swings to and fro.
    assert np.ptp(tip) > 0.01
    assert np.sign(np.diff(tip)).min() == -1
    assert np.sign(np.diff(tip)).max() == 1


def test_a_sleeping_state_is_resumed_with_the_same_bits(settled, tmp_path):
    run = RunFacts(0, 10, DT, "stack", (0.0, 1.0), "XPBD()")
    began = settled.system.start_states[:1]
    write_checkpoint(tmp_path / "rest", Checkpoint(run, 1, settled.state, began, (), {}))
    states = settled.state, read_checkpoint(tmp_path / "rest").state
    frames = [continued(settled, stack(), state, steps=2)[-1] for state in states]
    assert asleep(frames[1]) == {"low", "high"}
    assert np.array_equal(frames[0].state.positions, frames[1].state.positions)


def test_bad_times():
    for bad in (0.0, -1.0, np.nan, "now", True):
        with pytest.raises(sp.SolverError, match=r"XPBD: sleep_after is .*; (it must be|give a)"):
            sp.XPBD(sleep_after=bad)


def test_sleep_of_a_system_with_other_loads_is_that_of_its_own():
    """A drag on the page changes loads only: what does not depend on them is not computed again."""
    cube = sp.Body("cube", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), sp.StableNeoHookean(youngs=1e5, poisson=0.3))
    other = sp.Body("other", cube.mesh, cube.material, position=(1.0, 0.0, 0.0))
    pull = sp.SoftTarget("cube", [0], 10.0)

    def sleep(**loads):
        return sp.XPBD().prepare(build_system(sp.Scene([cube, other], **loads))).sleep

    free, pulled = sleep(), sleep(soft_targets=[pull])
    changed = free.of(pulled._system)
    assert (changed._scene == pulled._scene, changed._scene == free._scene) == (True, False)
    np.testing.assert_array_equal(changed._times, pulled._times)
    assert (np.isinf(changed._times[0]), np.isfinite(changed._times[1])) == (True, True)
    back = changed.of(free._system)
    assert back._scene == free._scene
    np.testing.assert_array_equal(back._times, free._times)
