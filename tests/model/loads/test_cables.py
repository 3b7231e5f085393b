"""Cables: derivatives, tensions, the capstan's law in both solvers, momentum, and what is refused."""

import numpy as np
import pytest
from tests.derivatives import derivative_errors
from tests.scenes import converged

import supple as sp
from supple.model.system import build_system
from supple.solvers.implicit.energies.loads.actuators import actuators_at
from supple.solvers.implicit.energies.potential import HessianBlocks

E, NU, RHO = 1e5, 0.3, 1000.0
RUBBER = sp.StableNeoHookean(youngs=E, poisson=NU, density=RHO, damping=0.05)
BAR = sp.shapes.box((0.4, 0.2, 0.2), (4, 2, 2))
CUBE = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
STILL = {"gravity": (0.0, 0.0, 0.0)}
POINTS = [("bar", (-0.19, 0.05, 0.01)), ("bar", 22), ("bar", (0.15, -0.04, 0.03)), ("cube", 3), (None, (0.7, 0.3, 0.0))]


def bodies():
    return [sp.Body("bar", BAR, RUBBER), sp.Body("cube", CUBE, RUBBER, position=(0.5, 0.1, 0.0))]


@pytest.mark.parametrize(
    "drive",
    [{"length": 0.8, "stiffness": 40.0}, {"tension": 3.0}, {"tension": 3.0, "friction": 0.4}],
    ids=["length", "tension", "friction"],
)
def test_gradients_and_hessians_have_slope_two(drive):
    system = build_system(sp.Scene(bodies(), cables=[sp.Cable(POINTS, **drive)]))
    rng = np.random.default_rng(0)
    start = system.start_states[0].positions
    # Slips of about the size below which the cable sticks.
    x, d = start + 2e-4 * rng.normal(size=start.shape), rng.normal(size=start.shape)
    (potential,) = actuators_at(system, start, (0.0, 0.5), 1e-4, np.full(len(system.tets), 1e4))
    # Steps within which no eyelet changes from sticking to slipping.
    steps = (2e-6, 1e-6) if "friction" in drive else (2e-5, 1e-5)
    errors, product = derivative_errors(potential, system.tets, x, d, steps)
    for coarse, fine in zip(*errors, strict=True):
        assert fine < 1e-3
        assert fine < 0.3 * coarse or fine < 1e-7
    # A cable that pulls has a positive semi-definite Hessian, which projection leaves as it is.
    if "friction" in drive:
        tensions = -potential.forces(x)
        assert np.ptp(tensions) > 0.1
    convex, again = HessianBlocks.zeros(len(system.tets), len(x)), np.zeros_like(x)
    potential.add_hessian(x, convex, True)
    for part in (*convex.beyond_elements, *convex.low_rank):
        part.add_product(d, again)
    np.testing.assert_array_equal(again, product)


SOLVERS = {
    "implicit": sp.Implicit(tolerance=1e-6, contact=None),
    "newmark": sp.Implicit("newmark", tolerance=1e-9, contact=None),
    "xpbd": sp.XPBD(substeps=20, contact=None),
}
MASS = RHO * 1e-3


def lifted(solver, tension, points, friction, velocity=(0, 0, 0), steps=20, dt=0.005):
    """The frames of a cube of 1 kg that hangs on a cable at its middle."""
    cube = sp.Body("cube", CUBE, RUBBER, velocity=velocity)
    cable = sp.Cable([("cube", (0, 0, 0)), *points], tension=tension, friction=friction)
    return converged(sp.simulate(sp.Scene([cube], cables=[cable]), solver, dt=dt, steps=steps))


OVER = [(None, (0.0, 2.0, 0.0)), (None, (2.0, 2.0, 0.0)), (None, (2.0, 4.0, 0.0))]  # turned by 90 degrees twice
GRIP = np.exp(0.3 * np.pi / 2)


@pytest.mark.parametrize("name", ["implicit", "xpbd"])
def test_friction_at_eyelets_follows_the_capstans_law(name):
    weight = MASS * 9.81
    for tension in (3.0 * weight, 0.25 * weight):
        rising = tension > weight
        frames = lifted(SOLVERS[name], tension, OVER, 0.3)
        tensions = np.array(frames[-1].report.cables["cable"].tension)
        # From the cube to the winch: each eyelet changes it by the same ratio, in the sense of the motion.
        expected = tension * GRIP ** (np.array([-2.0, -1.0, 0.0]) * (1 if rising else -1))
        np.testing.assert_allclose(tensions, expected, rtol=5e-3)
        acceleration = (expected[0] - weight) / MASS
        speed = frames[-1].report.linear_momentum[1] / MASS
        assert speed == pytest.approx(acceleration * 0.1, rel=0.03)


@pytest.mark.parametrize("name", ["implicit", "xpbd"])
def test_within_the_capstans_law_the_cable_sticks(name):
    weight = MASS * 9.81
    for tension in (1.5 * weight, 0.7 * weight):
        frames = lifted(SOLVERS[name], tension, OVER, 0.3, steps=60)
        # Of a free fall, which would be 0.44 m.
        fallen = abs(float(frames[-1].positions["cube"][:, 1].mean() - CUBE.vertices[:, 1].mean()))
        assert fallen < 5e-3
        tensions = np.array(frames[-1].report.cables["cable"].tension)
        assert tensions[0] == pytest.approx(weight, rel=0.02)
        assert tensions[2] == pytest.approx(tension, rel=1e-6)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_cable_pulls_with_its_stiffness_and_never_pushes(name):
    hang = [("cube", (0, 0, 0)), (None, (0, 0.5, 0)), (None, (0, 1.0, 0))]
    cube = sp.Body("cube", CUBE, RUBBER)
    k, weight = 2000.0, MASS * 9.81
    start = 1.0
    slack = sp.Cable(hang, length=1.5, stiffness=k)
    frames = list(sp.simulate(sp.Scene([cube], cables=[slack]), SOLVERS[name], dt=0.01, steps=10))
    assert frames[-1].report.linear_momentum[1] == pytest.approx(-weight * 0.1, rel=1e-6)
    assert frames[-1].report.cables["cable"].tension == (0.0, 0.0)
    assert frames[-1].report.cables["cable"].work == 0.0
    # Begun in equilibrium, it stays there, with the same tension in both spans.
    taut = sp.Cable(hang, length=start - weight / k, stiffness=k)
    frames = list(sp.simulate(sp.Scene([cube], cables=[taut]), SOLVERS[name], dt=0.01, steps=10))
    mean = np.mean([frame.report.cables["cable"].tension for frame in frames], axis=0)
    np.testing.assert_allclose(mean, weight, rtol=0.02)
    wound = sp.Cable(hang, winch_speed=sp.Curve([0.0, 0.1], [0.0, 0.2]), stiffness=k)
    frames = list(sp.simulate(sp.Scene([cube], cables=[wound], **STILL), SOLVERS[name], dt=0.01, steps=20))
    # 0.01 m until 0.1 s, then 0.02 m; the cube is pulled and then swings about, shorter than the cable at rest.
    assert frames[-1].report.cables["cable"].length < start - 0.03 + 0.02
    assert frames[-1].system.actuators[0].law.at(0.2, 0.0).length == pytest.approx(start - 0.03)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_cable_between_bodies_keeps_their_momentum(name):
    cable = sp.Cable(POINTS[:4], length=sp.Curve([0, 0.05], [0.6, 0.5]), stiffness=300.0)
    frames = list(sp.simulate(sp.Scene(bodies(), cables=[cable], **STILL), SOLVERS[name], dt=0.005, steps=16))
    masses = frames[-1].system.masses
    scale = max(masses @ np.linalg.norm(frame.state.velocities, axis=1) for frame in frames)
    assert scale > 0.05
    error = {"implicit": 3e-2, "newmark": 1e-9, "xpbd": 1e-9}[name]
    for frame in frames:
        assert frame.report.status == "converged"
        assert np.linalg.norm(frame.report.linear_momentum) < 1e-9 * scale
        assert np.linalg.norm(frame.report.angular_momentum) < error * scale * 0.5
    # The tension is the stiffness times the elongation, the same in all spans without friction.
    last = frames[-1].report.cables["cable"]
    if name == "implicit":
        np.testing.assert_allclose(last.tension, 300.0 * (last.length - 0.5), rtol=1e-9)
    assert len(last.tension) == 3


@pytest.mark.parametrize("name", ["implicit", "xpbd"])
def test_the_pin_of_a_pulled_bar_feels_the_cable(name):
    held = sp.Pin("bar", sp.InBox((-0.21, -1, -1), (-0.19, 1, 1)), name="wall")
    cable = sp.Cable([("bar", 0), ("bar", (0.15, 0, 0)), (None, (1.0, 0, 0))], tension=2.0)
    solver = sp.Implicit(contact=None) if name == "implicit" else sp.XPBD(substeps=40)
    bar = sp.Body("bar", BAR, sp.StableNeoHookean(youngs=E, poisson=NU, density=RHO, damping=0.2))
    *_, frame = sp.simulate(sp.Scene([bar], pins=[held], cables=[cable], **STILL), solver, dt=0.05, steps=20)
    np.testing.assert_allclose(frame.reactions[held.label], [-2.0, 0, 0], atol=0.02 * 2.0)


FILE = """
bodies:
  - name: bar
    shape: {{kind: box, size: [0.4, 0.2, 0.2], divisions: [4, 2, 2]}}
    material: {{kind: stable_neo_hookean, youngs: 1e5, poisson: 0.3}}
gravity: [0, 0, 0]
solver: {{kind: xpbd, substeps: 40}}
dt: 0.01
steps: 3
cables:
  - points: [{{body: bar, place: [-0.15, 0.05, 0]}}, {{body: bar, vertex: 20}}, {{body: bar, place: [0.15, 0.05, 0]}}]
    {drive}
"""


def test_scene_files_recordings_and_tables_have_cables(tmp_path):
    from supple.results.export.table import report_columns

    path = tmp_path / "scene.yaml"
    path.write_text(FILE.format(drive="tension: {times: [0, 0.01], values: [0, 5]}\n    friction: 0.2"))
    run = sp.load_run(path)
    frames = list(sp.simulate(run.scene, run.solver, run.dt, 3, sinks=[sp.Recorder(tmp_path / "r.vtkhdf")]))
    recording = sp.read_recording(tmp_path / "r.vtkhdf")
    for frame, recorded in zip(frames, recording[1:], strict=True):
        assert recorded.report.cables == frame.report.cables
    columns = report_columns(recording)
    assert columns["cable_tension.cable.1"][-1] == pytest.approx(5.0)
    assert columns["cable_work.cable"].sum() > 0.0
    assert sp.check_recording(tmp_path / "r.vtkhdf").ok


AT = [("bar", 0), ("bar", (0.1, 0, 0))]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: sp.Cable(AT),
            "cable 'cable': none of them given; give exactly one of length, tension",
        ),
        (lambda: sp.Cable(AT, length=1.0, tension=1.0), "length and tension given; give exactly one"),
        (lambda: sp.Cable(AT, length=-1.0, stiffness=1.0), "length is -1; it must be zero or more"),
        (lambda: sp.Cable(AT, tension=-1.0), "tension is -1; it must be zero or more"),
        (lambda: sp.Cable(AT, length=1.0), "stiffness is None; give it"),
        (lambda: sp.Cable(AT, tension=1.0, stiffness=2.0), "it has no effect with tension; leave it out"),
        (lambda: sp.Cable(AT, winch_speed=np.nan, stiffness=1.0), "winch_speed"),
        (lambda: sp.Cable(AT, tension=1.0, friction=-1.0), "friction is -1; it must be zero or more"),
        (lambda: sp.Cable(AT[:1], tension=1.0), "give two or more"),
        (lambda: sp.Cable(3, tension=1.0), "points is 3; give two or more"),
        (lambda: sp.Cable([AT[0], AT[0]], tension=1.0), r"points\[0\] and points\[1\] are the same"),
        (lambda: sp.Cable([(None, (0, 0, 0))] * 2, tension=1.0), "all points are fixed in the world"),
        (lambda: sp.Cable([AT[0], ("bar", (1.0, 0, 0))], tension=1.0), r"points\[1\]: \[1.0, 0.0, 0.0\] is outside of"),
        (lambda: sp.Cable([AT[0], ("rod", 0)], tension=1.0), r"points\[1\]: body 'rod' does not exist"),
        (lambda: sp.Cable([AT[0], ("bar", 999)], tension=1.0), "vertex 999 of body 'bar' does not exist"),
    ],
)
def test_bad_cables_are_one_line(make, message):
    with pytest.raises(sp.SceneError, match=message):
        sp.Scene(bodies(), cables=[make()])


def _ramp(time):
    """The integral of the curve from 0 at 3 ms to 0.2 at 17.1 ms."""
    t = np.clip(time - 0.003, 0.0, 0.0141)
    return 0.5 * t * t * 0.2 / 0.0141 + 0.2 * max(time - 0.0171, 0.0)


@pytest.mark.parametrize(
    ("speed", "wound"),
    [
        (0.3, lambda t: 0.3 * t),
        (lambda t: np.sin(20.0 * t), lambda t: (1.0 - np.cos(20.0 * t)) / 20.0),
        (sp.Curve([0.003, 0.0171], [0.0, 0.2]), _ramp),
    ],
    ids=["number", "function", "curve"],
)
def test_a_winch_winds_up_the_integral_of_its_speed(speed, wound):
    cable = sp.Cable([("cube", 0), (None, (5, 0, 0))], winch_speed=speed, stiffness=1.0)
    (actuator,) = build_system(sp.Scene([sp.Body("cube", CUBE, RUBBER)], cables=[cable])).actuators
    for time in (0.5, 0.0, 0.0137, 0.02, 0.01):
        assert actuator.start - actuator.law.length(time) == pytest.approx(wound(time), abs=1e-9)


def test_cables_and_springs_between_spinning_bodies_keep_their_momentum_in_xpbd():
    box = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1))
    pair = [
        sp.RigidBody("a", box, density=1000, angular_velocity=(0, 2, 4)),
        sp.RigidBody("b", box, density=500, position=(0.55, 0, 0)),
    ]
    cable = sp.Cable(
        [("a", (0.04, 0.04, 0)), ("b", (-0.04, 0.04, 0)), ("b", (0, 0.05, 0.02))], length=0.3, stiffness=500
    )
    spring = sp.Spring(("a", (0, -0.05, 0)), ("b", (0, -0.05, 0)), 200.0, rest_length=0.4)
    scene = sp.Scene(pair, cables=[cable], loads=[spring], gravity=(0, 0, 0))
    frames = list(sp.simulate(scene, sp.XPBD(substeps=20, contact=None), 1 / 60, 12))
    L = np.array([frame.report.angular_momentum for frame in frames])
    assert np.abs(L - L[0]).max() < 1e-10 * np.linalg.norm(L[0])
    assert max(frame.report.cables["cable"].tension[0] for frame in frames) > 50.0


def test_a_tendon_to_a_welded_body_bends_a_beam_as_in_implicit():
    """Its force on the rigid body was lost in XPBD, where both are one piece: the tip moved by a fifth of this."""
    material = sp.StableNeoHookean(youngs=2e5, poisson=0.3, density=1000, damping=0.03)
    beam = sp.Body("beam", sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1)), material)
    cube = sp.RigidBody("cube", sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1)), mass=0.05, position=(-0.25, 0, 0))
    points = [("beam", (0.18, 0.04, 0)), ("beam", (0.0, 0.04, 0)), ("cube", (0.03, 0.04, 0))]
    pulled = sp.Cable(points, tension=sp.Curve([0, 0.1], [0, 30]))
    weld = sp.Weld("beam", "cube", max_distance=1e-6)
    scene = sp.Scene([beam, cube], welds=[weld], cables=[pulled], gravity=(0, 0, 0))
    tips = []
    for solver in (sp.Implicit(contact=None), sp.XPBD(contact=None, substeps=40, sleep_after=None)):
        last = list(sp.simulate(scene, solver, 1 / 60, 40))[-1]
        pose, ends = last.poses["cube"], last.positions["beam"][beam.mesh.vertices[:, 0] > 0.19]
        tips.append((ends.mean(axis=0) - pose.translation) @ pose.rotation - [0.45, 0, 0])
    np.testing.assert_allclose(tips[1], tips[0], atol=0.04 * np.linalg.norm(tips[0]))
    assert np.linalg.norm(tips[0]) > 0.01
