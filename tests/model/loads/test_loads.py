"""Loads: derivatives, closed forms in both solvers, momentum, scene files, and what is refused."""

import numpy as np
import pytest
from tests.derivatives import derivative_errors, gradient_of

import supple as sp
from supple.model.system import build_system
from supple.solvers.implicit.energies.loads.pressure import pressures_at
from supple.solvers.implicit.energies.loads.springs import springs_at
from supple.solvers.implicit.newton.objective import Objective

E, NU, RHO = 1e5, 0.3, 1000.0
RUBBER = sp.StableNeoHookean(youngs=E, poisson=NU, density=RHO, damping=0.05)
BAR = sp.shapes.box((0.4, 0.2, 0.2), (4, 2, 2))
STILL = {"gravity": (0.0, 0.0, 0.0)}


def bar(**changes):
    return sp.Body("bar", BAR, changes.pop("material", RUBBER), **changes)


def face(normal_axis, sign):
    """The triangles of one face of the bar."""
    x = BAR.vertices[BAR.surface.triangles][:, :, normal_axis]
    end = sign * np.abs(BAR.vertices[:, normal_axis]).max()
    return np.flatnonzero(np.isclose(x, end).all(axis=1))


@pytest.mark.parametrize(
    "load",
    [
        sp.Pressure("bar", 3e3),
        sp.Pressure("bar", 3e3, region=face(0, 1)),
        sp.Spring(("bar", 0), ("bar", (0.11, 0.03, -0.02)), 40.0, rest_length=0.1),
        sp.Spring(("bar", (0.1, 0.01, 0.02)), (None, (0.5, 0.1, 0.3)), 40.0, rest_length=1.0),
        sp.Spring(("bar", 3), ("cube", (0.0, 0.01, 0.02)), 40.0),
    ],
    ids=["closed", "open", "spring", "to the world", "between bodies"],
)
def test_gradients_and_hessians_have_slope_two(load):
    cube = sp.Body("cube", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), RUBBER, position=(0.5, 0, 0))
    system = build_system(sp.Scene([bar(), cube], loads=[load]))
    rng = np.random.default_rng(0)
    start = system.start_states[0].positions + 0.01 * rng.normal(size=system.rest_positions.shape)
    x, d = start + 0.01 * rng.normal(size=start.shape), rng.normal(size=start.shape)
    potential = Objective([*pressures_at(system, start, 0.0), *springs_at(system, 0.0)]).terms[0]

    errors, _ = derivative_errors(potential, system.tets, x, d, (2e-3, 1e-3))
    (value, force), (finer_value, finer_force) = errors
    assert finer_value < 1e-3
    assert finer_force < 1e-3
    assert finer_value < 0.3 * value or finer_value < 1e-9
    assert finer_force < 0.3 * force or finer_force < 1e-9
    # Where a step begins, the potential has the forces of the load.
    forces = np.zeros_like(start)
    for item in system.loads:
        item.add_forces(start, 0.0, forces)
    np.testing.assert_allclose(gradient_of(potential, start), -forces, atol=1e-12 * np.abs(forces).max() + 1e-15)


def test_a_closed_pressure_pushes_and_turns_nothing():
    system = build_system(sp.Scene([bar()], loads=[sp.Pressure("bar", 3e3)]))
    x = system.rest_positions + 0.01 * np.random.default_rng(1).normal(size=system.rest_positions.shape)
    forces = np.zeros_like(x)
    system.loads[0].add_forces(x, 0.0, forces)
    scale = np.abs(forces).max()
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-12 * scale)
    np.testing.assert_allclose(np.cross(x, forces).sum(axis=0), 0.0, atol=1e-12 * scale)


SOLVERS = {
    # Long steps of backward Euler end in the equilibrium.
    "implicit": (sp.Implicit(tolerance=1e-9), 0.5, 25, 1e-6),
    "xpbd": (sp.XPBD(substeps=40), 1 / 60, 60, 1e-2),
}


def ended(name, bodies, loads, **parts):
    solver, dt, steps, tolerance = SOLVERS[name]
    *_, frame = sp.simulate(sp.Scene(bodies, loads=loads, **{**STILL, **parts}), solver, dt=dt, steps=steps)
    return frame, tolerance


@pytest.mark.parametrize("name", SOLVERS)
def test_pressure_all_around_makes_that_pressure_inside(name):
    p = 5e3
    frame, tolerance = ended(name, [bar()], [sp.Pressure("bar", p)])
    expected = np.tile(-p * np.eye(3), (len(BAR.tets), 1, 1))
    np.testing.assert_allclose(frame.stress["bar"], expected, atol=2 * tolerance * p)


@pytest.mark.parametrize("name", SOLVERS)
def test_tractions_on_both_ends_make_that_stress(name):
    t = 5e3
    pulls = [sp.Traction("bar", (sign * t, 0, 0), region=face(0, sign)) for sign in (1, -1)]
    frame, tolerance = ended(name, [bar()], pulls)
    expected = np.zeros((len(BAR.tets), 3, 3))
    expected[:, 0, 0] = t
    np.testing.assert_allclose(frame.first_piola["bar"], expected, atol=2 * tolerance * t)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_weight_on_a_spring_stretches_it(name):
    # It begins with the length of the equilibrium, and stays there while the bar sags by a little.
    k, weight = 300.0, 9.81 * RHO * 0.016
    length = 0.25 + weight / k
    hung = sp.Spring(("bar", (0, 0.05, 0)), (None, (0, 0.05 + length, 0)), k, rest_length=0.25)
    frame, tolerance = ended(name, [bar()], [hung], gravity=(0, -9.81, 0))
    assert frame.system.loads[0].length(frame.state.positions)[0] == pytest.approx(length, rel=tolerance)


@pytest.mark.parametrize("solver", [sp.Implicit(tolerance=1e-9), sp.XPBD(substeps=10)], ids=["implicit", "xpbd"])
def test_a_constant_force_per_mass_is_gravity(solver):
    held = [sp.Pin("bar", sp.InBox((-0.21, -1, -1), (-0.19, 1, 1)))]
    (first,), (second,) = (
        list(sp.simulate(sp.Scene([bar()], pins=held, loads=loads, gravity=g), solver, dt=0.01, steps=1))
        for loads, g in (([], (0, -9.81, 0)), ([sp.BodyForce((0, -9.81, 0))], (0, 0, 0)))
    )
    np.testing.assert_allclose(second.positions["bar"], first.positions["bar"], atol=1e-9)


@pytest.mark.parametrize("solver", [sp.Implicit(tolerance=1e-9), sp.XPBD(substeps=1)], ids=["implicit", "xpbd"])
def test_a_force_of_place_and_time_pushes_every_vertex(solver):
    bodies = [bar(), sp.Body("cube", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), RUBBER, position=(0, 1, 0))]
    seen = []

    def push(x, t):
        seen.append(t)
        return np.column_stack([np.full(len(x), 2.0), 3.0 * x[:, 1].round(1) ** 0, np.zeros(len(x))]) * (1.0 + t)

    h = 1e-3
    scene = sp.Scene(bodies, loads=[sp.BodyForce(push, "cube")], **STILL)
    (frame,) = sp.simulate(scene, solver, dt=h, steps=1)
    expected = np.tile(h * (1 + h) * np.array([2.0, 3.0, 0.0]), (8, 1))
    np.testing.assert_allclose(frame.velocities["cube"], expected, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(frame.velocities["bar"], 0.0, atol=1e-9)
    assert set(seen) == {h}


@pytest.mark.parametrize("name", SOLVERS)
def test_a_spring_between_bodies_keeps_their_momentum(name):
    cube = sp.Body("cube", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), RUBBER, position=(0.5, 0.2, 0))
    spring = sp.Spring(("bar", (0.15, 0.02, 0.03)), ("cube", (0.01, 0, 0)), 200.0, rest_length=0.1)
    newmark = sp.Implicit(integrator="newmark", tolerance=1e-9)
    solver = newmark if name == "implicit" else sp.XPBD(substeps=40)
    frames = list(sp.simulate(sp.Scene([bar(), cube], loads=[spring], **STILL), solver, dt=0.005, steps=16))
    masses = frames[-1].system.masses
    speeds = np.linalg.norm(frames[-1].state.velocities, axis=1)
    assert speeds.max() > 0.05
    scale = masses @ speeds
    for frame in frames:
        assert np.linalg.norm(frame.report.linear_momentum) < 1e-9 * scale
        assert np.linalg.norm(frame.report.angular_momentum) < 1e-9 * scale * 0.5
        assert frame.report.status == "converged"


def test_curves_and_functions_of_time_are_the_same():
    curve = sp.Curve([0.0, 0.1], [0.0, 100.0])
    assert curve(0.05) == pytest.approx(50.0)
    assert curve(-1.0) == 0.0
    assert curve(9.0) == 100.0
    assert sp.Curve([0, 1], [[0, 0, 0], [2, 4, 6]])(0.5).tolist() == [1, 2, 3]
    ends = []
    for given in (curve, lambda t: 1000.0 * min(t, 0.1)):
        scene = sp.Scene([bar()], loads=[sp.Pressure("bar", given, region=face(1, -1))], **STILL)
        *_, frame = sp.simulate(scene, sp.XPBD(substeps=50), dt=0.05, steps=3)
        ends.append(frame.positions["bar"])
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-12)
    # The pressure pushes one face of 0.08 m^2: 50 Pa on average for 0.1 s, then 100 Pa for 0.05 s.
    assert frame.report.linear_momentum[1] == pytest.approx(0.08 * (50 * 0.1 + 100 * 0.05), rel=0.02)


FILE = """
bodies:
  - name: bar
    shape: {{kind: box, size: [0.4, 0.2, 0.2], divisions: [4, 2, 2]}}
    material: {{kind: neo_hookean, youngs: 1e5, poisson: 0.3}}
gravity: [0, 0, 0]
loads:
  - {{kind: traction, body: bar, traction: [5.0, 0, 0], box: {{low: [0.19, -1, -1], high: [0.21, 1, 1]}}}}
  - {{kind: pressure, body: bar, pressure: {{times: [0, 1], values: [0, 2e3]}}, triangles: [0, 1]}}
  - {{kind: body_force, force: {{times: [0, 1], values: [[0, 0, 0], [0, 1, 0]]}}}}
  - {{kind: spring, first: {{body: bar, vertex: 3}}, second: {{place: [0, 1, 0]}}, stiffness: 10, rest_length: 0.5}}
{more}
"""


def test_scene_files_describe_loads(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(FILE.format(more=""))
    traction, pressure, force, spring = sp.load_scene(path).loads
    assert traction.traction.tolist() == [5.0, 0.0, 0.0]
    assert sorted(traction.triangles(sp.load_scene(path).bodies[0])) == sorted(face(0, 1))
    assert pressure.pressure(0.5) == 1e3
    assert pressure.region.tolist() == [0, 1]
    assert force.at(np.zeros((2, 3)), 0.5).tolist() == [[0, 0.5, 0]] * 2
    assert spring.first == ("bar", 3)
    assert spring.second[0] is None
    assert spring.stiffness == 10.0


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("  - {kind: pressure, body: bra, pressure: 1}", r"body 'bra' does not exist; did you mean 'bar'\?"),
        ("  - {kind: pressure, body: bar, pressure: .inf}", "loads\\[4\\]"),
        ("  - {kind: pressure, body: bar, pressure: {times: [1, 0], values: [1, 2]}}", r"times\[1\] = 0 s does not"),
        ("  - {kind: thrust, body: bar}", "thrust"),
        ("  - {kind: spring, first: {body: bar}, second: {place: [0, 0, 0]}, stiffness: 1}", "either `vertex` or"),
    ],
)
def test_bad_loads_of_scene_files_are_one_line(tmp_path, more, message):
    path = tmp_path / "scene.yaml"
    path.write_text(FILE.format(more=more))
    with pytest.raises(sp.SceneError, match=message) as error:
        sp.load_scene(path)
    assert "scene.yaml:" in str(error.value)


AT = ("bar", (0.1, 0.0, 0.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sp.Pressure("bar", np.nan), "pressure on body 'bar': pressure is nan; it must be finite"),
        (lambda: sp.Pressure("bar", (1, 2)), "pressure has shape .2,.; give one number"),
        (lambda: sp.Pressure("bar", 1.0, region=[]), "region must be a non-empty list"),
        (lambda: sp.Pressure("bar", 1.0, region=[-1]), "region holds -1, which is negative"),
        (lambda: sp.Pressure("bar", 1.0, region=[1, 1]), "region names a triangle twice"),
        (lambda: sp.Pressure("bar", 1.0, region=[10**6]), "triangle 1000000 does not exist; the surface has"),
        (lambda: sp.Traction("bar", 3.0), "traction has shape ..; give three numbers"),
        (lambda: sp.Traction("bar", (1, 0, 0), region=sp.InBox((5, 5, 5), (6, 6, 6))), "holds no triangle"),
        (lambda: sp.Traction("rod", (1, 0, 0)), "body 'rod' does not exist"),
        (lambda: sp.BodyForce((1, np.inf, 0)), "body force: force is .* it must be finite"),
        (lambda: sp.BodyForce((1, 0, 0), "rod"), "body force: body 'rod' does not exist"),
        (lambda: sp.Spring(AT, ("bar", (0.1, 0.0, 0.0)), 1.0), "both ends are the same point of body 'bar'"),
        (lambda: sp.Spring(AT, ("bar", (1.0, 0.0, 0.0)), 1.0), r"second: \[1.0, 0.0, 0.0\] is outside of body 'bar'"),
        (lambda: sp.Spring(AT, ("bar", 9999), 1.0), "vertex 9999 of body 'bar' does not exist; it has"),
        (lambda: sp.Spring(AT, ("bar", -1), 1.0), "vertex -1 is negative"),
        (lambda: sp.Spring(AT, (None, 3), 1.0), "the world has no vertices"),
        (lambda: sp.Spring((None, (0, 0, 0)), (None, (1, 0, 0)), 1.0), "both ends are fixed in the world"),
        (lambda: sp.Spring(AT, ("bar", 0), 0.0), "stiffness is 0; it must be above zero"),
        (lambda: sp.Spring(AT, ("bar", 0), 1.0, rest_length=-0.1), "rest_length is -0.1; it must be zero or more"),
        (lambda: sp.Curve([0, 0], [1, 2]), "does not come after"),
        (lambda: sp.Curve([0, 1], [1, 2, 3]), "give 2 numbers or vectors"),
        (lambda: sp.Pressure("rigid", 1.0), "pressure on body 'rigid': body 'rigid' is rigid; pressure acts on soft"),
        (lambda: 3.0, "loads.0. is a float; give a Load"),
    ],
)
def test_bad_loads_are_one_line(make, message):
    with pytest.raises(sp.SceneError, match=message):
        sp.Scene([bar(), sp.RigidBody("rigid", BAR, density=1, position=(1, 0, 0))], loads=[make()])


def test_functions_are_checked_when_they_are_called():
    for load, message in (
        (sp.Pressure("bar", lambda t: np.nan), r"pressure\(0.01\) is nan; it must be finite"),
        (sp.BodyForce(lambda x, t: x[:2]), r"force\(x, 0.01\) has shape \(2, 3\); give \(3,\) or"),
        (sp.Spring(AT, ("bar", 0), 1.0, rest_length=lambda t: -t), r"rest_length\(0.01\) is -0.01; it must be zero"),
    ):
        with pytest.raises(sp.SceneError, match=message):
            list(sp.simulate(sp.Scene([bar()], loads=[load]), sp.XPBD(substeps=1), dt=0.01, steps=1))
