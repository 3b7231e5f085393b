"""Welds in both solvers: vertices that follow rigid bodies, masses and momenta, forces, contact, refusals."""

import numpy as np
import pytest
from tests.scenes import converged

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


def welded(*welds, **more):
    return sp.Scene([beam(), cube()], welds=welds, **more)


def xpbd(substeps=20, contact=None):
    return sp.XPBD(substeps=substeps, sleep_after=None, contact=contact)


def implicit(integrator="backward_euler", contact=None):
    return sp.Implicit(integrator=integrator, contact=contact)


def run(scene, steps, solver=None, dt=1 / 60, **more):
    return converged(sp.simulate(scene, solver or xpbd(), dt, steps, **more))


def off_the_cube(frame):
    pose = frame.poses["cube"]
    return np.abs(frame.positions["beam"][LEFT] - (ON_CUBE @ pose.rotation.T + pose.translation)).max()


@pytest.mark.parametrize(
    ("solver", "dt", "steps", "angular", "off"),
    [(xpbd(), 1 / 60, 60, 1e-11, 1e-14), (implicit("bdf2"), 0.005, 20, 1e-3, 1e-6)],
    ids=["xpbd", "implicit"],
)
def test_what_is_welded_flies_as_one_body(solver, dt, steps, angular, off):
    """Soft and rigid parts of like weight, which swing against each other."""
    spin = np.array([0.5, 0.2, 3.0])
    rigid = cube(velocity=np.cross(spin, (-0.25, 0, 0)), angular_velocity=spin)
    scene = sp.Scene([beam(0.0, angular_velocity=spin), rigid], welds=[WELD], gravity=(0, 0, 0))
    frames = run(scene, steps, solver, dt)
    P, L = (np.array([getattr(f.report, key) for f in frames]) for key in ("linear_momentum", "angular_momentum"))
    assert np.abs(P - P[0]).max() < 1e-11 * np.linalg.norm(P[0])
    assert np.abs(L - L[0]).max() < angular * np.linalg.norm(L[0])
    assert max(off_the_cube(frame) for frame in frames) < off
    forces = [np.linalg.norm(frame.report.details.weld_forces["weld"]) for frame in frames]
    assert np.ptp(forces) > 0.1
    # A run that continues has the same bits.
    rest = list(sp.simulate(scene, solver, dt, steps // 3, start=frames[-1 - steps // 3]))
    np.testing.assert_array_equal(rest[-1].positions["beam"], frames[-1].positions["beam"])


@pytest.mark.parametrize(
    ("damping", "loads"), [(0.02, []), (0.0, [sp.Muscle("beam", 2e4, (1, 0.3, 0), sp.Curve([0, 0.1], [0, 1]))])]
)
def test_viscous_forces_and_muscles_of_welded_bodies_change_no_momentum(damping, loads):
    spin = np.array([0.0, 2.0, 4.0])
    bodies = [beam(damping, velocity=(1, 0, 0)), cube(velocity=(1, 0, 0), angular_velocity=spin)]
    frames = run(sp.Scene(bodies, welds=[WELD], gravity=(0, 0, 0), loads=loads), 12)
    P, L = (np.array([getattr(f.report, key) for f in frames]) for key in ("linear_momentum", "angular_momentum"))
    assert np.abs(P - P[0]).max() < 1e-11 * np.linalg.norm(P[0])
    assert np.abs(L - L[0]).max() < 1e-10 * np.linalg.norm(L[0])
    if not loads:
        assert max(np.diff([frame.report.energy for frame in frames])) < 1e-5


@pytest.mark.parametrize(
    ("solver", "dt", "steps", "atol"),
    [(xpbd(), 1 / 60, 60, 1e-13), (implicit("static"), 1.0, 1, 1e-12)],
    ids=["xpbd", "implicit"],
)
def test_a_beam_welded_to_a_held_body_is_a_beam_that_is_held(solver, dt, steps, atol):
    """The pin of the rigid body carries both."""
    held = sp.Scene([beam()], pins=[sp.Pin("beam", LEFT)])
    one, other = (run(scene, steps, solver, dt)[-1] for scene in (held, welded(WELD, pins=[sp.Pin("cube")])))
    np.testing.assert_allclose(other.positions["beam"], one.positions["beam"], atol=atol)
    (carried,), (alone,) = one.reactions.values(), other.reactions.values()
    np.testing.assert_allclose(alone, np.add(carried, [0, G, 0]), atol=1e-7)
    np.testing.assert_allclose(other.report.details.weld_forces["weld"], carried, atol=1e-7)


@pytest.mark.parametrize(("solver", "atol"), [(xpbd(), 1e-13), (implicit(), 1e-6)], ids=["xpbd", "implicit"])
def test_a_beam_welded_to_a_body_that_is_moved_is_a_beam_that_is_moved(solver, atol):
    turned = sp.Keyframes([0, 1], angles=[0, 2])
    held = sp.Scene([beam()], pins=[sp.Pin("beam", LEFT, motion=turned)])
    one, other = (run(scene, 5, solver) for scene in (held, welded(WELD, pins=[sp.Pin("cube", motion=turned)])))
    np.testing.assert_allclose(other[-1].positions["beam"], one[-1].positions["beam"], atol=atol)
    assert max(off_the_cube(frame) for frame in other) < atol


@pytest.mark.parametrize(
    ("solver", "steps"),
    [(xpbd(contact=sp.XPBDContact()), 40), (implicit(contact=sp.IPCContact()), 20)],
    ids=["xpbd", "implicit"],
)
def test_contact_is_masked_near_the_weld_only(solver, steps, tmp_path):
    """Faces that are welded touch from the start; a table that the beam leans on is felt."""
    table = sp.RigidBody(
        "table", sp.shapes.box_surface((0.2, 0.1, 0.3), (1, 1, 1)), density=1000, position=(0.15, -0.11, 0)
    )
    scene = sp.Scene(
        [beam(friction=0.3), cube(), table],
        pins=[sp.Pin("cube"), sp.Pin("table")],
        welds=[sp.Weld("beam", "cube", max_distance=1e-6)],
    )
    frames = run(scene, steps, solver, sinks=[sp.Recorder(tmp_path / "weld.vtkhdf")])
    assert frames[-1].report.details.contact_forces["table"][1] < -0.1 * 4.0 * G
    assert frames[-1].contacts.force_between("beam", "cube").tolist() == [0, 0, 0]
    report = sp.check_recording(tmp_path / "weld.vtkhdf")
    assert report.ok, str(report)
    assert report["welds"].worst < 1e-13


@pytest.mark.parametrize("solver", [sp.XPBD(), sp.Implicit()], ids=["xpbd", "implicit"])
def test_a_start_off_the_weld_is_refused(solver):
    moved = {"beam": np.add(BEAM.vertices, [0, 0.01, 0])}
    with pytest.raises(sp.SceneError, match=r"weld 'weld'.*: at the start vertex \d+ is 0.01 m off its place"):
        next(iter(sp.simulate(welded(WELD), solver, 1 / 60, 1, initial_positions=moved)))


def test_a_free_fall_needs_no_force():
    (last,) = run(welded(WELD), 1)[-1:]
    np.testing.assert_allclose(last.report.details.weld_forces["weld"], 0.0, atol=1e-9)
    np.testing.assert_allclose(last.poses["cube"].velocity, [0, -G / 60, 0], atol=1e-12)


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
    last = run(scene, 60 if density < 100 else 150, xpbd(substeps=40))[-1]
    sag = -0.25 - exact.poses["cube"].translation[1]
    assert last.poses["cube"].translation[1] == pytest.approx(-0.25 - sag, abs=0.01 * sag)
    weight = density * 1e-3 * G
    np.testing.assert_allclose(last.report.details.weld_forces["weld"], [0, -weight, 0], atol=2e-3 * weight)


def test_welded_vertices_that_touch_push_their_body():
    """The welded end of the beam lands on the floor, at the cube's side."""
    floor = sp.HalfSpace(point=(0, -0.06, 0), normal=(0, 1, 0), name="floor")
    frames = run(welded(WELD, obstacles=[floor]), 60, xpbd(contact=sp.XPBDContact()))
    assert min(points[:, 1].min() for frame in frames for points in frame.positions.values()) > -0.06
    assert frames[-1].report.details.contact_forces["floor"][1] == pytest.approx(-5.0 * G, rel=1e-3)
    assert off_the_cube(frames[-1]) < 1e-14


def test_what_is_welded_sleeps_together():
    floor = sp.HalfSpace(point=(0, -0.0501, 0), normal=(0, 1, 0), friction=0.5)
    scene = welded(WELD, obstacles=[floor])
    details = [f.report.details for f in sp.simulate(scene, sp.XPBD(substeps=20, sleep_after=0.2), 1 / 60, 25)]
    slept = [(one.asleep["beam"], one.asleep["cube"]) for one in details]
    assert slept[0] == (False, False)
    assert slept[-1] == (True, True)
    assert (True, False) not in slept
    assert (False, True) not in slept
    awake = details[slept.index((True, True)) - 1]
    assert np.linalg.norm(awake.weld_forces["weld"]) > 1.0
    np.testing.assert_array_equal(details[-1].weld_forces["weld"], awake.weld_forces["weld"])


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: sp.Weld("beam", "cube"), "give the vertices by one of `vertices`, `box` and `max_distance`"),
        (lambda: sp.Weld("beam", "cube", [0], 0.1), "give the vertices by one of `vertices`, `box` and `max_distance`"),
        (lambda: sp.Weld("beam", "cube", max_distance=-1), "max_distance is -1; it must be above zero"),
        (lambda: welded(sp.Weld("bean", "cube", [0])), "body 'bean' does not exist; did you mean 'beam'?"),
        (lambda: welded(sp.Weld("cube", "beam", [0])), "body 'cube' is rigid; a weld is of a soft body to a rigid"),
        (lambda: welded(sp.Weld("beam", "cube", [99])), "vertex 99 does not exist"),
        (lambda: welded(sp.Weld("beam", "cube", LEFT), sp.Weld("beam", "cube", LEFT[:1])), "is already welded"),
        (
            lambda: sp.Scene([beam(), cube(position=(-1, 0, 0))], welds=[sp.Weld("beam", "cube", max_distance=0.1)]),
            "no vertex is within 0.1 m of body 'cube'; the nearest is 0.75 m away",
        ),
        (
            lambda: sp.Scene([beam(), cube()], pins=[sp.Pin("beam", LEFT)], welds=[sp.Weld("beam", "cube", LEFT)]),
            "is also held by a pin; pin the rigid body instead",
        ),
    ],
)
def test_bad_welds_are_refused_in_one_line(make, problem):
    with pytest.raises(sp.SceneError) as error:
        make()
    assert problem in str(error.value)


@pytest.mark.parametrize("solver", [xpbd(60), implicit("static")], ids=["xpbd", "implicit"])
def test_a_joint_at_the_center_of_a_body_with_a_weld_carries_the_moment_about_it(solver):
    """Not about the center of the body with what is welded to it, where XPBD had it."""
    stiff = sp.StableNeoHookean(youngs=3e5, poisson=0.3, density=100, damping=0.02)
    light = sp.Body("beam", sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1)), stiff)
    clamp = sp.FixedJoint("cube", name="clamp")
    scene = sp.Scene([light, cube(mass=0.1, density=None)], welds=[WELD], joints=[clamp])
    static = isinstance(solver, sp.Implicit)
    frames = run(scene, 1 if static else 24, solver)
    readings = [frame.report.joints["clamp"] for frame in frames[-16:]]
    assert np.mean([one.force[1] for one in readings]) == pytest.approx(0.5 * G, rel=0.01)
    assert np.mean([one.torque[2] for one in readings]) == pytest.approx(0.4 * G * 0.25, rel=0.02)
