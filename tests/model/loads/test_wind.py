"""Wind: drag on plates, spheres and falling bodies in both solvers, its potential, scene files and checks."""

import numpy as np
import pytest
from tests.derivatives import derivative_errors, gradient_of
from tests.scenes import converged

import supple as sp
from supple.app.cli.app import main
from supple.model.state import State
from supple.model.system import build_system
from supple.solvers.implicit.energies.loads.pressure import drags_at

STIFF = sp.StableNeoHookean(youngs=2e5, poisson=0.0, density=40.0, damping=0.01)
PLATE = sp.shapes.box((0.02, 0.4, 0.5), (1, 4, 5))
CUBE = sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2))
SOLVERS = {"xpbd": sp.XPBD(substeps=60), "implicit": sp.Implicit(), "bdf2": sp.Implicit(integrator="bdf2")}
BOTH = pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS)


def test_the_potential_has_the_forces_where_a_step_begins_and_its_derivatives_are_exact():
    system = build_system(sp.Scene([sp.Body("cube", CUBE, STIFF)], loads=[sp.Wind("cube", (3.0, -1.0, 0.5), drag=1.1)]))
    rng = np.random.default_rng(0)
    x = system.rest_positions + 0.01 * rng.normal(size=system.rest_positions.shape)
    v, d = rng.normal(size=x.shape), rng.normal(size=x.shape)
    (potential,) = drags_at(system, State(0.0, x, v), v, 100.0, 0.0)
    errors, _ = derivative_errors(potential, system.tets, x + 0.01 * d, d, (1e-2,))
    assert np.max(errors) < 1e-8  # it is quadratic
    (load,) = system.loads
    forces = load.coefficients(x, v, 0.0)[:, None] * (np.array([3.0, -1.0, 0.5]) - v)
    np.testing.assert_allclose(gradient_of(potential, x), -forces, atol=1e-15)
    # Of each triangle, by hand: half of density times drag times the area that faces the flow.
    by_hand = np.zeros(3)
    for corners in CUBE.surface.triangles:
        a, b, c = x[corners]
        area, u = 0.5 * np.cross(b - a, c - a), np.array([3.0, -1.0, 0.5]) - v[corners].mean(axis=0)
        by_hand += 0.5 * 1.2 * 1.1 * max(-area @ u, 0.0) * u
    np.testing.assert_allclose(forces.sum(axis=0), by_hand, rtol=1e-12)


@BOTH
@pytest.mark.parametrize(
    ("mesh", "area"),
    [(PLATE, 0.4 * 0.5), (sp.shapes.sphere(0.2, 0.06), np.pi * 0.2**2)],
    ids=["plate", "sphere"],
)
def test_the_force_is_that_of_the_projected_area(solver, mesh, area):
    """On a body that starts at rest, from its momentum after a short step."""
    wind = sp.Wind("body", (8.0, 0.0, 0.0), drag=1.28)
    scene = sp.Scene([sp.Body("body", mesh, STIFF)], loads=[wind], gravity=(0, 0, 0))
    last = converged(sp.simulate(scene, solver, 1e-5, 1))[-1]
    force = 0.5 * 1.2 * 1.28 * area * 8.0**2
    # A polyhedron of a sphere has less area: 2.3 % here.
    np.testing.assert_allclose(last.report.linear_momentum / 1e-5, (force, 0, 0), atol=0.025 * force)
    if mesh is PLATE:
        np.testing.assert_allclose(last.report.linear_momentum[0] / 1e-5, force, rtol=1e-3)


@BOTH
def test_a_falling_body_reaches_its_terminal_velocity(solver):
    """v(t) = v_t tanh(g t / v_t) with v_t^2 = 2 m g / (density drag area)."""
    mesh = sp.shapes.sphere(0.1, 0.04)
    rubber = sp.StableNeoHookean(youngs=5e4, poisson=0.0, density=40.0, damping=0.01)
    scene = sp.Scene([sp.Body("ball", mesh, rubber)], loads=[sp.Wind("ball", (0, 0, 0), drag=0.47, density=10.0)])
    corners = mesh.vertices[mesh.surface.triangles]
    areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 1]
    mass, area = 40.0 * mesh.volume, 0.5 * np.abs(areas).sum()
    terminal = np.sqrt(2.0 * mass * 9.81 / (10.0 * 0.47 * area))
    frames = converged(sp.simulate(scene, solver, 0.02, 70))
    times = np.array([frame.time for frame in frames])
    speeds = np.array([-frame.report.linear_momentum[1] / mass for frame in frames])
    assert speeds[-1] == pytest.approx(terminal, rel=1e-2)
    # Forces of a step of 0.02 s are those of its beginning: first order.
    np.testing.assert_allclose(speeds, terminal * np.tanh(9.81 * times / terminal), atol=0.03 * terminal)


def test_both_solvers_bend_a_flag_alike():
    """A soft plate that is held at its upper edge, in steady wind."""
    flag = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=200.0, damping=0.05)
    mesh = sp.shapes.box((0.03, 0.4, 0.2), (1, 8, 4))
    top = np.flatnonzero(mesh.vertices[:, 1] > 0.199)
    scene = sp.Scene([sp.Body("flag", mesh, flag)], pins=[sp.Pin("flag", top)], loads=[sp.Wind("flag", (6.0, 0, 0))])
    ends = []
    for solver in (sp.XPBD(substeps=60), sp.Implicit()):
        last = converged(sp.simulate(scene, solver, 1 / 60, 50))[-1]
        ends.append(last.positions["flag"][:, 0].max())
    assert ends[0] == pytest.approx(ends[1], rel=0.03)
    assert ends[0] > 0.03


def test_light_things_in_strong_wind_are_stable():
    """Explicit forces would turn the velocity over in every substep."""
    foil = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1.0, damping=0.01)
    scene = sp.Scene(
        [sp.Body("foil", PLATE, foil)], loads=[sp.Wind("foil", (30.0, 0, 0), density=50.0)], gravity=(0, 0, 0)
    )
    for solver in (sp.XPBD(substeps=4), sp.Implicit()):
        frames = list(sp.simulate(scene, solver, 1 / 60, 10))
        speeds = [frame.velocities["foil"][:, 0].mean() for frame in frames]
        assert (np.diff(speeds) > -0.01).all()
        assert 28.0 < min(speeds[1:]) <= max(speeds) < 30.0 + 1e-6


FILE = """\
bodies:
  - {name: plate, shape: {kind: box, size: [0.02, 0.4, 0.5], divisions: [1, 2, 2]},
     material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.3, density: 400, damping: 0.01}}
pins: [{body: plate, box: {low: [-1, 0.19, -1], high: [1, 1, 1]}}]
loads:
  - {kind: wind, body: plate, velocity: {times: [0, 1], values: [[0, 0, 0], [9, 0, 0]]}, drag: 1.28, name: gust}
solver: {kind: SOLVER}
dt: 0.01
steps: 12
"""


@pytest.mark.parametrize("solver", ["xpbd, substeps: 30", "implicit"])
def test_file_info_recording_and_check_know_wind(tmp_path, capsys, solver):
    path = tmp_path / "scene.yaml"
    path.write_text(FILE.replace("SOLVER", solver))
    (wind,) = sp.load_scene(path).loads
    assert (type(wind), wind.drag, wind.density, wind.velocity(0.5).tolist()) == (sp.Wind, 1.28, 1.2, [4.5, 0, 0])
    main(["info", str(path)])
    assert "wind 'gust' on body 'plate'" in capsys.readouterr().out
    main(["run", str(path), "-o", str(tmp_path / "out"), "--quiet"])
    recording = tmp_path / "out" / "recording.vtkhdf"
    with sp.read_recording(recording) as read:
        assert read[-1].report.work["wind"] > 0.0
        assert [type(load) for load in read.scene.loads] == [sp.Wind]
    report = sp.check_recording(recording)
    assert report.ok, report.failures
    assert "wind" in report["works"].message


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sp.Wind("plate", 3.0), "wind on body 'plate': velocity has shape .*; give three numbers"),
        (lambda: sp.Wind("plate", (1, 0, 0), drag=-1), "drag is -1; it must be zero or more"),
        (lambda: sp.Wind("plate", (1, 0, 0), density=np.nan), "density is nan; it must be finite"),
        (lambda: sp.Wind("stone", (1, 0, 0)), "body 'stone' is rigid; wind acts on soft ones"),
        (lambda: sp.Wind("plot", (1, 0, 0)), "body 'plot' does not exist; did you mean 'plate'"),
    ],
)
def test_bad_winds_are_one_line(make, message):
    stone = sp.RigidBody("stone", sp.shapes.box_surface((0.1, 0.1, 0.1)), density=1000, position=(2, 0, 0))
    with pytest.raises(sp.SceneError, match=message):
        sp.Scene([sp.Body("plate", PLATE, STIFF), stone], loads=[make()])
