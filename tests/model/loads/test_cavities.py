"""Cavities: derivatives, laws, closed forms in both solvers, momentum, and what is refused."""

import numpy as np
import pytest
from tests.derivatives import derivative_errors

import supple as sp
from supple.mesh.closed_surfaces import enclosed_voids
from supple.model.loads.actuators.laws import GivenForce, GivenGas, GivenValue
from supple.model.system import build_system
from supple.solvers.implicit.energies.loads.actuators import ActuatorPotential, actuators_at
from supple.solvers.implicit.energies.potential import HessianBlocks

INNER, OUTER, E, NU = 0.1, 0.15, 1e5, 0.4
SHELL = sp.shapes.spherical_shell(INNER, OUTER, 0.06)
MU = E / (2 * (1 + NU))


def shell(material=None, **changes):
    material = material or sp.StableNeoHookean(youngs=E, poisson=NU, damping=0.02)
    return sp.Body("shell", SHELL, material, **changes)


def scene(cavity, **parts):
    return sp.Scene([shell(**parts)], cavities=[cavity], gravity=(0, 0, 0))


V0 = build_system(scene(sp.Cavity("shell", pressure=0.0))).actuators[0].start


@pytest.mark.parametrize(
    "cavity",
    [sp.Cavity("shell", pressure=3e3), sp.Cavity("shell", gas=sp.Gas(gamma=1.4)), sp.Cavity("shell", volume=1.1 * V0)],
    ids=["pressure", "gas", "volume"],
)
def test_gradients_and_hessians_have_slope_two(cavity):
    system = build_system(scene(cavity))
    rng = np.random.default_rng(0)
    x = system.rest_positions + 0.005 * rng.normal(size=system.rest_positions.shape)
    d = rng.normal(size=x.shape)
    mu = np.full(len(system.tets), MU)
    (potential,) = actuators_at(system, system.rest_positions, (0.0, 0.01), 1e-4, mu)
    assert isinstance(potential, ActuatorPotential)
    errors, _ = derivative_errors(potential, system.tets, x, d, (2e-3, 1e-3))
    for coarse, fine in zip(*errors, strict=True):
        assert fine < 2e-2
        assert fine < 0.3 * coarse or fine < 1e-9
    # With projection only the part is left that is positive semi-definite.
    convex = HessianBlocks.zeros(len(system.tets), len(x))
    potential.add_hessian(x, convex, True)
    assert not convex.beyond_elements


@pytest.mark.parametrize(
    "law",
    [
        GivenForce(lambda t: 5.0, 1.0),
        GivenValue(lambda t: 1.3),
        GivenGas(lambda t: 1e5, 1.0, 1.4, 1e5),
        GivenGas(lambda t: 2e5, 1.0, 1.0, 1e5),
        GivenGas(lambda t: 1e4, 1.0, 1.4, 1e5),
    ],
)
@pytest.mark.parametrize("mobility", [1e-8, 1e-5, 1e-2])
def test_the_force_that_a_law_gives_leads_to_a_coordinate_with_that_force(law, mobility):
    for s in (1.02, 0.3, 2.0):
        Q = law.reached(0.0, s, mobility)
        end = s + mobility * Q
        if isinstance(law, GivenValue):
            assert end == pytest.approx(1.3)
        else:
            assert pytest.approx(law.at(0.0, 0.0).force(end), rel=1e-6, abs=1e-3) == Q


def closed_form(stretch, mu):
    """The pressure in a thick sphere of incompressible Neo-Hookean material at a stretch of its inner radius [Pa].

    The integral of dW/ds / (s^3 - 1) over the hoop stretch s from the outer to the inner radius, W the energy density.
    """
    outer = (1 + (stretch**3 - 1) * (INNER / OUTER) ** 3) ** (1 / 3)
    at = lambda s: 2 / s + 1 / (2 * s**4)  # noqa: E731
    return mu * (at(outer) - at(stretch))


def inflated(mesh, material, stretches):
    """The pressures at these stretches of the inner radius, reached one after the other by the volume."""
    body = sp.Body("shell", mesh, material)
    start = build_system(sp.Scene([body], cavities=[sp.Cavity("shell", pressure=0.0)])).actuators[0].start
    volumes = sp.Curve(np.arange(len(stretches)) + 1.0, start * np.asarray(stretches) ** 3)
    filled = sp.Scene([body], cavities=[sp.Cavity("shell", volume=volumes)], gravity=(0, 0, 0))
    # Long steps of backward Euler end in the equilibrium.
    solver = sp.Implicit(contact=None, tolerance=1e-6)
    frames = list(sp.simulate(filled, solver, dt=1.0, steps=len(stretches)))
    for frame, stretch in zip(frames, stretches, strict=True):
        assert frame.report.status == "converged"
        assert frame.report.cavities["shell"].volume == pytest.approx(start * stretch**3, rel=1e-8)
    return np.array([frame.report.cavities["shell"].pressure for frame in frames])


STRETCHES = [1.1, 1.3, 1.6, 1.8, 2.0]


def test_the_pressure_falls_beyond_the_limit_point():
    mu = 1e5 / 2.6
    pressures = inflated(SHELL, sp.NeoHookean(youngs=1e5, poisson=0.3), STRETCHES)
    expected = np.array([closed_form(stretch, mu) for stretch in STRETCHES])
    assert pressures.argmax() in (2, 3)
    assert pressures[-1] < pressures.max()
    # Compressible and coarse; the closed form is for the limit of both.
    assert np.abs(pressures[1:] / expected[1:] - 1).max() < 0.35


@pytest.mark.slow
def test_the_curve_of_a_nearly_incompressible_sphere_is_the_closed_form_within_one_percent():
    rubber = sp.NeoHookean(youngs=1e5, poisson=0.49)
    pressures = inflated(sp.shapes.spherical_shell(INNER, OUTER, 0.05, order=2), rubber, STRETCHES)
    expected = np.array([closed_form(stretch, 1e5 / 2.98) for stretch in STRETCHES])
    assert expected.argmax() == pressures.argmax() == 2
    assert np.abs(pressures / expected - 1).max() < 0.01


SOLVERS = {
    "implicit": (sp.Implicit(contact=None, tolerance=1e-6), 0.01),
    "newmark": (sp.Implicit("newmark", contact=None, tolerance=1e-9), 0.01),
    "xpbd": (sp.XPBD(), 0.03),
}


def ended(name, cavity, steps=20):
    """The frames of half a second, and the work of the cavity in them."""
    filled = scene(cavity)
    frames = list(sp.simulate(filled, SOLVERS[name][0], dt=0.5 / steps, steps=steps))
    return frames, sum(frame.report.cavities["shell"].work for frame in frames)


@pytest.mark.parametrize("name", SOLVERS)
def test_pressure_volume_and_gas_agree_and_keep_momenta(name):
    tolerance = SOLVERS[name][1]
    ramp = lambda end: sp.Curve([0.0, 0.25], [0.0, end])  # noqa: E731
    frames, work = ended(name, sp.Cavity("shell", pressure=ramp(8e3)))
    first = frames[-1].report.cavities["shell"]
    assert first.pressure == pytest.approx(8e3, rel=1e-9)
    assert first.volume > 1.2 * V0
    # What the material's damping took is missing.
    assert 0.98 * frames[-1].report.elastic_energy < work < 1.3 * frames[-1].report.elastic_energy
    volume = sp.Curve([0.0, 0.25], [V0, first.volume])
    law = sp.Gas(sp.Curve([0.0, 0.25], [101325 * V0 / RT, (101325 + 8e3) * first.volume / RT]))
    for cavity in (sp.Cavity("shell", volume=volume), sp.Cavity("shell", gas=law)):
        frames, _ = ended(name, cavity)
        at_end = frames[-1].report.cavities["shell"]
        assert at_end.pressure == pytest.approx(8e3, rel=tolerance)
        assert at_end.volume == pytest.approx(first.volume, rel=tolerance)
        masses = frames[0].system.masses
        scale = max(masses @ np.linalg.norm(frame.state.velocities, axis=1) for frame in frames)
        for frame in frames:
            assert frame.report.status == "converged"
            assert np.linalg.norm(frame.report.linear_momentum) < 1e-9 * scale
            # Backward Euler itself conserves angular momentum only up to the first order of the step.
            error = 1e-3 if name == "implicit" else 1e-9
            assert np.linalg.norm(frame.report.angular_momentum) < error * OUTER * scale


RT = 8.31446261815324 * 293.15


def test_a_gas_without_exchange_of_heat_keeps_p_v_to_the_gamma():
    gas = sp.Gas(gamma=1.4, ambient=2e4)
    squeezed = sp.Scene([shell()], cavities=[sp.Cavity("shell", gas=gas)], loads=[OUTSIDE], gravity=(0, 0, 0))
    for solver in (SOLVERS["implicit"][0], SOLVERS["xpbd"][0]):
        *_, frame = sp.simulate(squeezed, solver, dt=0.02, steps=20)
        end = frame.report.cavities["shell"]
        assert end.volume < 0.95 * V0
        assert (end.pressure + 2e4) * (end.volume / V0) ** 1.4 == pytest.approx(2e4, rel=1e-3)


outer = np.linalg.norm(SHELL.vertices, axis=1)[SHELL.surface.triangles].min(axis=1) > 0.99 * OUTER
OUTSIDE = sp.Pressure("shell", 6e3, region=np.flatnonzero(outer))


def test_voids_are_found_by_size_and_chosen_by_triangles():
    small = sp.shapes.spherical_shell(0.02, 0.04, 0.02)
    n = len(SHELL.vertices)
    beside = small.vertices + np.array([0.3, 0, 0])
    both = sp.TetMesh(np.concatenate([SHELL.vertices, beside]), np.concatenate([SHELL.tets, small.tets + n]))
    voids = enclosed_voids(both.vertices, both.surface.triangles)
    assert len(voids) == 2
    radii = np.linalg.norm(both.vertices, axis=1)[both.surface.triangles[voids[0]]]
    np.testing.assert_allclose(radii, INNER, rtol=1e-9)
    body = sp.Body("shell", both, sp.StableNeoHookean(youngs=E, poisson=NU))
    cavities = [
        sp.Cavity("shell", pressure=1.0, triangles=voids[1], name="small"),
        sp.Cavity("shell", pressure=1.0, void=1, name="again"),
        sp.Cavity("shell", pressure=1.0),
    ]
    starts = [build_system(sp.Scene([body], cavities=[item])).actuators[0].start for item in cavities]
    assert starts[0] == starts[1] < 0.01 * starts[2]


FILE = """
bodies:
  - name: shell
    shape: {{kind: spherical_shell, inner_radius: 0.1, outer_radius: 0.15, edge_length: 0.06}}
    material: {{kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}}
gravity: [0, 0, 0]
solver: {{kind: xpbd, substeps: 40}}
dt: 0.01
steps: 4
cavities:
  - {cavity}
"""


def test_scene_files_recordings_tables_and_resumed_runs_have_cavities(tmp_path, capsys):
    from supple.app.cli.app import main
    from supple.results.export.table import report_columns

    path = tmp_path / "scene.yaml"
    path.write_text(FILE.format(cavity="{body: shell, pressure: {times: [0, 0.02], values: [0, 4e3]}, name: lung}"))
    whole = sp.load_run(path)
    assert main(["info", str(path)]) == 0
    assert "cavity lung" in capsys.readouterr().out
    frames = list(sp.simulate(whole.scene, whole.solver, whole.dt, 4))
    recorder = sp.Recorder(tmp_path / "r.vtkhdf")
    for _ in sp.simulate(whole.scene, whole.solver, whole.dt, 4, sinks=[recorder]):
        pass
    recording = sp.read_recording(tmp_path / "r.vtkhdf")
    assert recording[0].report.cavities["lung"].volume == pytest.approx(V0)
    for frame, recorded in zip(frames, recording[1:], strict=True):
        assert recorded.report.cavities == frame.report.cavities
    columns = report_columns(recording)
    assert columns["cavity_pressure.lung"][-1] == 4e3
    assert (np.diff(columns["cavity_volume.lung"]) > 0).any()
    assert sp.check_recording(tmp_path / "r.vtkhdf").ok
    (last,) = sp.simulate(whole.scene, whole.solver, whole.dt, 1, start=frames[2])
    np.testing.assert_array_equal(last.positions["shell"], frames[3].positions["shell"])
    assert last.report.cavities == frames[3].report.cavities


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sp.Cavity("shell"), "cavity 'shell': none of them given; give exactly one of pressure, volume"),
        (lambda: sp.Cavity("shell", pressure=1, volume=1), "pressure and volume given; give exactly one"),
        (lambda: sp.Cavity("shell", pressure=np.inf), "pressure is inf; it must be finite"),
        (lambda: sp.Cavity("shell", volume=0.0), "volume is 0; it must be above zero"),
        (lambda: sp.Cavity("shell", gas=1.0), "gas is 1.0; give a Gas"),  # pyright: ignore[reportArgumentType]
        (lambda: sp.Cavity("shell", gas=sp.Gas(amount=-1.0)), "gas: amount is -1; it must be above zero"),
        (lambda: sp.Cavity("shell", gas=sp.Gas(ambient=0.0)), "the cavity is empty at the start; give the amount"),
        (lambda: sp.Cavity("shell", pressure=1.0, void=1), "void 1 does not exist; body 'shell' encloses 1"),
        (lambda: sp.Cavity("shell", pressure=1.0, void=-1), "void is -1; give a whole number from 0"),
        (lambda: sp.Cavity("shell", pressure=1.0, triangles=[0, 1]), "are not a closed surface; add those that are"),
        (lambda: sp.Cavity("shell", pressure=1.0, triangles=np.flatnonzero(outer)), "its triangles face outward"),
        (lambda: sp.Cavity("shell", pressure=1.0, triangles=[10**6]), "triangle 1000000 does not exist"),
        (lambda: sp.Cavity("cube", pressure=1.0), "void 0 does not exist; body 'cube' encloses 0: the surface"),
        (lambda: sp.Cavity("rigid", pressure=1.0), "body 'rigid' is rigid; a cavity acts on soft bodies"),
        (lambda: sp.Cavity("shel", pressure=1.0), "body 'shel' does not exist; did you mean 'shell'"),
        (lambda: sp.Cavity("", pressure=1.0), "cavity: body: name is ''"),
    ],
)
def test_bad_cavities_are_one_line(make, message):
    box = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    bodies = [
        shell(),
        sp.Body("cube", box, sp.StableNeoHookean(youngs=E, poisson=NU), position=(1, 0, 0)),
        sp.RigidBody("rigid", SHELL, density=1000, position=(2, 0, 0)),
    ]
    with pytest.raises(sp.SceneError, match=message):
        sp.Scene(bodies, cavities=[make()])


def test_cavities_are_checked_further_where_they_are_used(tmp_path):
    with pytest.raises(sp.SceneError, match="another cavity has this name"):
        sp.Scene([shell()], cavities=[sp.Cavity("shell", pressure=1.0), sp.Cavity("shell", volume=1.0)])
    with pytest.raises(
        sp.SceneError, match="cavity 'air': cavity 'shell' has the same triangles; give each surface one"
    ):
        sp.Scene([shell()], cavities=[sp.Cavity("shell", pressure=1.0), sp.Cavity("shell", volume=1.0, name="air")])
    never = sp.Cavity("shell", volume=lambda t: -t)
    with pytest.raises(sp.SceneError, match=r"volume\(0.01\) is -0.01; it must be above zero"):
        list(sp.simulate(scene(never), sp.XPBD(substeps=1), dt=0.01, steps=1))
    path = tmp_path / "scene.yaml"
    path.write_text(FILE.format(cavity="{body: shell, pressure: 1, volume: 1}"))
    with pytest.raises(sp.SceneError, match=r"scene.yaml:11.*pressure and volume given"):
        sp.load_run(path)


def test_a_shell_is_the_wall_of_a_cavity_whichever_way_it_faces(tmp_path):
    ball, sheet = sp.shapes.sphere_surface(0.1, 0.05), sp.shapes.sheet(0.1, 0.1, 0.05)
    material = sp.ShellMaterial(youngs=1e6, poisson=0.4, thickness=1e-3)
    small = ball.transformed(0.5, translation=(0.3, 0, 0))
    both = sp.SurfaceMesh(
        np.concatenate([ball.vertices, small.vertices]),
        np.concatenate([ball.triangles, small.flipped().triangles + len(ball.vertices)]),
    )
    volumes = []
    for surface in (ball, ball.flipped()):
        filled = sp.Scene(
            [sp.Shell("balloon", surface, material)], cavities=[sp.Cavity("balloon", pressure=500.0)], gravity=(0, 0, 0)
        )
        sink = sp.Recorder(tmp_path / "balloon.vtkhdf")
        *_, last = sp.simulate(filled, sp.Implicit(contact=None), 1 / 60, 1, sinks=[sink])
        volumes.append(last.report.cavities["balloon"].volume)
        assert sp.check_recording(tmp_path / "balloon.vtkhdf").ok
    assert volumes[0] > 1.001 * ball.volume
    assert volumes[1] == pytest.approx(volumes[0], rel=1e-6)
    pair = sp.Shell("pair", both, material)
    for void, surface in enumerate((ball, small)):
        start = build_system(sp.Scene([pair], cavities=[sp.Cavity("pair", pressure=1.0, void=void)])).actuators[0].start
        assert start == pytest.approx(surface.volume)
    chosen = sp.Cavity("pair", pressure=1.0, triangles=np.arange(len(ball.triangles)))
    assert build_system(sp.Scene([pair], cavities=[chosen])).actuators[0].start == pytest.approx(ball.volume)
    with pytest.raises(sp.SceneError, match="encloses 0: the surface of the cavity is open"):
        sp.Scene([sp.Shell("cloth", sheet, material)], cavities=[sp.Cavity("cloth", pressure=1.0)])
