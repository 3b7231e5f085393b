"""Welds in `XPBD`: vertices that follow rigid bodies, masses and momenta of both, forces, contact near them."""

import numpy as np
import pytest

import supple as sp

G = 9.81
BEAM = sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1))
LEFT = np.flatnonzero(BEAM.vertices[:, 0] < -0.199)
ON_CUBE = np.add(BEAM.vertices[LEFT], [0.25, 0.0, 0.0])
CUBE = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1))
WELD = sp.Weld("beam", "cube", LEFT, name="weld")


def beam(damping=0.1, **values):
    material = sp.StableNeoHookean(youngs=2e5, poisson=0.3, density=1000, damping=damping)
    return sp.Body("beam", BEAM, material, **values)


def cube(**values):
    return sp.RigidBody("cube", CUBE, **({"density": 1000, "position": (-0.25, 0, 0)} | values))


def run(scene, steps, substeps=20, contact=None, **more):
    solver = sp.XPBD(substeps=substeps, sleep_after=None, contact=contact)
    frames = list(sp.simulate(scene, solver, 1 / 60, steps, **more))
    assert {frame.report.status for frame in frames} == {"converged"}
    return frames


def off_the_cube(frame):
    pose = frame.poses["cube"]
    return np.abs(frame.positions["beam"][LEFT] - (ON_CUBE @ pose.rotation.T + pose.translation)).max()


def test_what_is_welded_flies_as_one_body():
    """Soft and rigid parts of like weight, which swing against each other."""
    spin = np.array([0.5, 0.2, 3.0])
    rigid = cube(velocity=np.cross(spin, (-0.25, 0, 0)), angular_velocity=spin)
    frames = run(sp.Scene([beam(0.0, angular_velocity=spin), rigid], welds=[WELD], gravity=(0, 0, 0)), 60)
    P, L = (np.array([getattr(f.report, key) for f in frames]) for key in ("linear_momentum", "angular_momentum"))
    assert np.abs(P - P[0]).max() < 1e-11 * np.linalg.norm(P[0])
    assert np.abs(L - L[0]).max() < 1e-11 * np.linalg.norm(L[0])
    assert max(off_the_cube(frame) for frame in frames) < 1e-14
    forces = [np.linalg.norm(frame.report.details.weld_forces["weld"]) for frame in frames]
    assert np.ptp(forces) > 0.1
    # A run that continues has the same bits.
    rest = list(sp.simulate(frames[-1].system.scene, sp.XPBD(substeps=20, contact=None), 1 / 60, 20, start=frames[39]))
    np.testing.assert_array_equal(rest[-1].positions["beam"], frames[-1].positions["beam"])


def test_a_free_fall_needs_no_force():
    (last,) = run(sp.Scene([beam(), cube()], welds=[WELD]), 1)[-1:]
    np.testing.assert_allclose(last.report.details.weld_forces["weld"], 0.0, atol=1e-9)
    np.testing.assert_allclose(last.poses["cube"].velocity, [0, -G / 60, 0], atol=1e-12)


def test_a_beam_welded_to_a_held_body_is_a_beam_that_is_held():
    """The pin of the rigid body carries both."""
    held = sp.Scene([beam()], pins=[sp.Pin("beam", LEFT)])
    welded = sp.Scene([beam(), cube()], pins=[sp.Pin("cube")], welds=[WELD])
    one, other = (run(scene, 90)[-1] for scene in (held, welded))
    np.testing.assert_allclose(other.positions["beam"], one.positions["beam"], atol=1e-13)
    (carried,), (alone,) = one.reactions.values(), other.reactions.values()
    np.testing.assert_allclose(alone, np.add(carried, [0, G, 0]), atol=1e-9)
    turned = sp.Keyframes([0, 1], displacements=[(0, 0, 0), (0, 0.1, 0)], angles=[0, 2])
    moved = run(sp.Scene([beam(), cube()], pins=[sp.Pin("cube", motion=turned)], welds=[WELD]), 10)
    assert max(off_the_cube(frame) for frame in moved) < 1e-14


@pytest.mark.parametrize("density", [10.0, 20000.0])
def test_a_block_hangs_on_a_beam_as_in_implicit(density):
    """From a hundredth to five times the beam's mass; the weld carries the block."""
    upright = sp.Body("beam", sp.shapes.box((0.1, 0.4, 0.1), (1, 4, 1)), beam().material)
    y = upright.mesh.vertices[:, 1]
    scene = sp.Scene(
        [upright, cube(density=density, position=(0, -0.25, 0))],
        pins=[sp.Pin("beam", np.flatnonzero(y > 0.199))],
        welds=[sp.Weld("beam", "cube", np.flatnonzero(y < -0.199), name="weld")],
    )
    (exact,) = sp.simulate(scene, sp.Implicit(integrator="static", contact=None), 1.0, 1)
    last = run(scene, 150, substeps=40)[-1]
    sag = -0.25 - exact.poses["cube"].translation[1]
    assert last.poses["cube"].translation[1] == pytest.approx(-0.25 - sag, abs=0.01 * sag)
    weight = density * 1e-3 * G
    np.testing.assert_allclose(last.report.details.weld_forces["weld"], [0, -weight, 0], atol=2e-3 * weight)


def test_contact_is_masked_near_the_weld_only(tmp_path):
    """Faces that are welded touch from the start; a table that the beam leans on is felt."""
    table = sp.RigidBody(
        "table", sp.shapes.box_surface((0.2, 0.1, 0.3), (1, 1, 1)), density=1000, position=(0.15, -0.11, 0)
    )
    scene = sp.Scene(
        [beam(friction=0.3), cube(), table],
        pins=[sp.Pin("cube"), sp.Pin("table")],
        welds=[sp.Weld("beam", "cube", max_distance=1e-6)],
    )
    recorder = sp.Recorder(tmp_path / "weld.vtkhdf")
    frames = run(scene, 40, contact=sp.XPBDContact(), sinks=[recorder])
    assert frames[-1].report.details.contact_forces["table"][1] < -0.1 * 4.0 * G
    assert frames[-1].contacts.force_between("beam", "cube").tolist() == [0, 0, 0]
    report = sp.check_recording(tmp_path / "weld.vtkhdf")
    assert report.ok, str(report)
    assert report["welds"].worst < 1e-13


def test_welded_vertices_that_touch_push_their_body():
    """The welded end of the beam lands on the floor, at the cube's side."""
    floor = sp.HalfSpace(point=(0, -0.06, 0), normal=(0, 1, 0), name="floor")
    frames = run(sp.Scene([beam(), cube()], obstacles=[floor], welds=[WELD]), 60, contact=sp.XPBDContact())
    assert min(points[:, 1].min() for frame in frames for points in frame.positions.values()) > -0.06
    assert frames[-1].report.details.contact_forces["floor"][1] == pytest.approx(-5.0 * G, rel=1e-3)
    assert off_the_cube(frames[-1]) < 1e-14


def test_what_is_welded_sleeps_together():
    floor = sp.HalfSpace(point=(0, -0.0501, 0), normal=(0, 1, 0), friction=0.5)
    scene = sp.Scene([beam(), cube()], obstacles=[floor], welds=[WELD])
    details = [f.report.details for f in sp.simulate(scene, sp.XPBD(substeps=20, sleep_after=0.2), 1 / 60, 25)]
    slept = [(one.asleep["beam"], one.asleep["cube"]) for one in details]
    assert slept[0] == (False, False)
    assert slept[-1] == (True, True)
    assert (True, False) not in slept
    assert (False, True) not in slept
    np.testing.assert_array_equal(details[-1].weld_forces["weld"], 0.0)


def test_a_start_off_the_weld_is_refused():
    scene = sp.Scene([beam(), cube()], welds=[WELD])
    moved = {"beam": np.add(BEAM.vertices, [0, 0.01, 0])}
    with pytest.raises(sp.SceneError, match=r"weld 'weld'.*: at the start vertex \d+ is 0.01 m off its place"):
        next(iter(sp.simulate(scene, sp.XPBD(), 1 / 60, 1, initial_positions=moved)))
