"""Materials that flow: closed forms of relaxation and of plasticity, energies of steps, and what a state keeps."""

import numpy as np
import pytest
from tests.derivatives import derivative_errors, gradient_of

import supple as sp
from supple.errors import SceneError, SolverError
from supple.materials.laws.internal import at_rest, count_of
from supple.model.state import State
from supple.model.system import build_system
from supple.results.check.recorded import RecordedTrajectory
from supple.results.checkpoint.file import Checkpoint, RunFacts, read_checkpoint, write_checkpoint
from supple.results.export.exporter import export
from supple.solvers.implicit.energies.elasticity import elasticity_of

CUBE = sp.shapes.box((1, 1, 1), (1, 1, 1))
RUBBER = sp.MooneyRivlin(c10=8e4, c01=2e4, bulk=1e7)
SLOW = sp.Viscoelastic(material=RUBBER, prony=[(0.3, 0.1), (0.2, 1.0)])
G0 = 2e5 / 0.5
YOUNGS, POISSON, YIELD, HARDENING = 2e11, 0.3, 2e8, 1e9
MU = YOUNGS / (2 * (1 + POISSON))
METAL = sp.J2Plastic(youngs=YOUNGS, poisson=POISSON, yield_stress=YIELD, hardening=HARDENING)
STATIC = sp.Implicit(integrator="static", contact=None)


def driven(material, F, dt, steps, solver=STATIC):
    """A cube whose vertices all follow F(t)."""
    x = CUBE.vertices
    pins = [sp.Pin("cube", [i], motion=lambda t, i=i: (F(t) - np.eye(3)) @ x[i]) for i in range(len(x))]
    scene = sp.Scene([sp.Body("cube", CUBE, material)], pins=pins, gravity=(0, 0, 0))
    return sp.simulate(scene, solver, dt=dt, steps=steps)


def isochoric(strain):
    return np.diag(np.exp([strain, -0.5 * strain, -0.5 * strain]))


def axial(frame):
    """sigma_0 - sigma_1 of Cauchy's stress, of Kirchhoff's where J = 1."""
    stress = frame.stress["cube"][0]
    return stress[0, 0] - stress[1, 1]


def test_relaxation_is_the_prony_series():
    stretched, strain = isochoric(np.log(1.5)), 1.5 * np.log(1.5)
    rest = 2 * (1.5 - 1.5**-2) * (8e4 + 2e4 / 1.5) * 1.5
    dissipated = [0.0]
    for frame in driven(SLOW, lambda t: stretched if t > 0 else np.eye(3), 0.02, 60):
        shares = 0.3 * np.exp(-frame.time / 0.1) + 0.2 * np.exp(-frame.time)
        assert axial(frame) == pytest.approx(rest + 2 * G0 * strain * shares, rel=1e-9)
        dissipated.append(frame.dissipated_energy["cube"][0])
    assert (np.diff(dissipated) > 0).all()
    # What was stored in the springs at once is dissipated, but for what they still hold.
    at_once = G0 * (0.3 + 0.2) * 1.5 * np.log(1.5) ** 2
    held = G0 * (0.3 * np.exp(-12 * 2) + 0.2 * np.exp(-1.2 * 2)) * 1.5 * np.log(1.5) ** 2
    assert dissipated[-1] == pytest.approx(at_once - held, rel=1e-9)


@pytest.mark.parametrize("steps", [20, 40])
def test_a_ramp_converges_to_the_series_with_first_order(steps):
    rate, end, T = 0.4, 0.5, 0.25
    material = sp.Viscoelastic(material=RUBBER, prony=[(0.4, T)])
    *_, frame = driven(material, lambda t: isochoric(rate * t), end / steps, steps)
    l = np.exp(rate * end)  # noqa: E741
    rest = 2 * (l - l**-2) * (8e4 + 2e4 / l) * l
    element = 2 * (0.4 * 2e5 / 0.6) * 1.5 * rate * T * (1 - np.exp(-end / T))
    assert abs(axial(frame) - rest - element) / element == pytest.approx(end / steps / T / 2, rel=0.1)


def test_rotation_does_not_flow():
    def turning(t):
        c, s = np.cos(3 * t), np.sin(3 * t)
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    for material in (SLOW, METAL):
        *_, frame = driven(material, turning, 0.1, 8)
        assert frame.dissipated_energy["cube"].max() < 1e-20 * YOUNGS
        assert np.abs(frame.stress["cube"]).max() < 1e-9 * YIELD


def test_cyclic_curve_plastic_work_and_volume():
    peak, steps = 0.02, 40
    path = np.interp(np.arange(3 * steps + 1), [0, steps, 2 * steps, 3 * steps], [0, peak, -peak, 0.3 * peak])
    frames = list(driven(METAL, lambda t: isochoric(np.interp(t, np.arange(len(path)), path)), 1.0, 3 * steps))
    # 3 mu (e - p) = Y + H a on the way up, then the same with the other sign, and again.
    a = p = 0.0
    exact = []
    for sign, until in ((1, peak), (-1, -peak), (1, 0.3 * peak)):
        grown = max((3 * MU * sign * (until - p) - YIELD - HARDENING * a) / (3 * MU + HARDENING), 0.0)
        a, p = a + grown, p + sign * grown
        exact.append((3 * MU * (until - p), a))
    for frame, (stress, accumulated) in zip(frames[steps - 1 :: steps], exact, strict=True):
        assert axial(frame) == pytest.approx(stress, rel=1e-6)
        assert frame.plastic_strain["cube"][0] == pytest.approx(accumulated, rel=1e-6)
        work = YIELD * accumulated + 0.5 * HARDENING * accumulated**2
        np.testing.assert_allclose(frame.dissipated_energy["cube"], work, rtol=1e-6)
    works = np.array([frame.dissipated_energy["cube"][0] for frame in frames])
    assert (np.diff(works) >= 0).all()
    inverse = frames[-1].state.internal[:, :9].reshape(-1, 3, 3)
    np.testing.assert_allclose(np.linalg.det(inverse), 1.0, rtol=1e-6)
    # The work of the stress along the path is what is dissipated and what is stored.
    stresses = np.array([0.0, *(axial(frame) for frame in frames)])
    done = (0.5 * (stresses[1:] + stresses[:-1]) * np.diff(path)).sum()
    stored = frames[-1].energy_density["cube"][0]
    assert done == pytest.approx(works[-1] + stored, rel=5e-3)


def test_saturation_and_unloading_leave_the_plastic_strain():
    metal = sp.J2Plastic(
        youngs=YOUNGS, poisson=POISSON, yield_stress=YIELD, saturation_stress=1.5 * YIELD, saturation_rate=200.0
    )
    frames = list(driven(metal, lambda t: isochoric(0.05 * min(t, 1.0)), 0.02, 50))
    a = frames[-1].plastic_strain["cube"][0]
    assert axial(frames[-1]) == pytest.approx(YIELD + 0.5 * YIELD * (1 - np.exp(-200 * a)), rel=1e-6)
    assert a == pytest.approx(0.05 - axial(frames[-1]) / (3 * MU), rel=1e-6)
    # Back to the strain that is plastic, no stress is left.
    *_, back = driven(metal, lambda t: isochoric(np.interp(t, [0, 1, 2], [0, 0.05, a])), 0.02, 100)
    assert abs(axial(back)) < 1e-6 * YIELD
    assert back.plastic_strain["cube"][0] == pytest.approx(a, rel=1e-12)


def test_the_energy_of_a_step_has_slope_two():
    parts = [SLOW, METAL, sp.NeoHookean(youngs=1e5, poisson=0.3)]
    mesh = sp.shapes.box((0.3, 0.2, 0.2), (2, 1, 1))
    material = sp.Regions(materials=parts, index=np.arange(len(mesh.tets)) % 3)
    system = build_system(sp.Scene([sp.Body("block", mesh, material)]))
    rng = np.random.default_rng(0)
    whole = elasticity_of(system)
    first = mesh.vertices @ (np.eye(3) + 0.05 * rng.normal(size=(3, 3))).T
    internal = whole.flowed(first, at_rest(count_of(system.laws.material)), 0.05)
    step = whole.in_step(internal, 0.1)
    x = first + 0.003 * rng.normal(size=first.shape)
    d = rng.normal(size=x.shape)

    (coarse, fine), _ = derivative_errors(step, system.tets, x, d, (4e-5, 2e-5))
    np.testing.assert_allclose(np.log2(np.array(coarse) / fine), 2.0, atol=0.2)
    # The forces at the end are those of the stress that is read from the state after the step.
    after = whole.flowed(x, internal, 0.1)
    held = whole.in_step(after, 0.0)
    out = gradient_of(held, x)
    np.testing.assert_allclose(out, gradient_of(step, x), rtol=1e-9, atol=1e-9 * np.abs(out).max())


def block_scene(pressed, order=1):
    """A block between a base and, while it is pressed, a plate that goes down; without the plate, it is free above."""
    mesh = sp.shapes.box((0.1, 0.1, 0.1), (3, 3, 3))
    other = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2), order=2) if order == 2 else mesh
    clay = sp.J2Plastic(youngs=1e6, poisson=0.2, yield_stress=3e4, hardening=1e4)
    soft = sp.Viscoelastic(material=sp.StableNeoHookean(youngs=1e5, poisson=0.4), prony=[(0.5, 0.2)])
    bodies = [sp.Body("clay", other, clay), sp.Body("soft", mesh, soft, position=(0.3, 0, 0))]
    pins = [sp.Pin(body.name, np.flatnonzero(body.mesh.vertices[:, 1] < -0.05 + 1e-9)) for body in bodies]
    down = lambda t: (0.0, -0.03 * min(t / 0.5, 1.0), 0.0)  # noqa: E731
    if pressed:
        pins += [sp.Pin(b.name, np.flatnonzero(b.mesh.vertices[:, 1] > 0.05 - 1e-9), motion=down) for b in bodies]
    return sp.Scene(bodies, pins=pins)


@pytest.mark.parametrize("order", [1, 2])
def test_a_crushed_block_stays_crushed_and_runs_go_on_with_the_same_bits(order, tmp_path):
    scene, solver = block_scene(True, order), sp.Implicit(contact=None)
    sink = sp.Recorder(tmp_path / "r.vtkhdf", fields=["plastic_strain", "dissipated_energy"])
    frames = list(sp.simulate(scene, solver, dt=0.1, steps=6, sinks=[sink]))
    assert [frame.report.status for frame in frames] == ["converged"] * 6
    *_, again = sp.simulate(scene, solver, dt=0.1, steps=3, start=frames[2])
    np.testing.assert_array_equal(again.state.positions, frames[-1].state.positions)
    np.testing.assert_array_equal(again.state.internal, frames[-1].state.internal)
    with sp.read_recording(sink.path) as recording:
        known = RecordedTrajectory(recording)
        for frame, read in zip(frames, recording[1:], strict=True):
            np.testing.assert_array_equal(read.state.internal, frame.state.internal)
            for name in ("clay", "soft"):
                np.testing.assert_array_equal(read.stress[name], frame.stress[name])
                np.testing.assert_array_equal(read.plastic_strain[name], frame.plastic_strain[name])
            assert known.snapshot(read.number).elastic_energy == pytest.approx(frame.report.elastic_energy, rel=1e-12)
        start = recording[-1].state
    report = sp.check_recording(sink.path)
    assert report.ok, str(report)
    copy = export(sink.path, "vtkhdf", tmp_path / "copy.vtkhdf")
    with sp.read_recording(copy) as recording:
        np.testing.assert_array_equal(recording[-1].state.internal, frames[-1].state.internal)
    # Freed, the clay keeps its form and the rubber goes back.
    *_, freed = sp.simulate(block_scene(False, order), solver, dt=0.05, steps=40, start=start)
    assert np.ptp(freed.positions["clay"][:, 1]) < 0.076
    assert np.ptp(freed.positions["soft"][:, 1]) > 0.095
    run = RunFacts(0, 6, 0.1, "", (0.0, 0.6), "")
    state = frames[-1].state
    path = tmp_path / "c"
    write_checkpoint(path, Checkpoint(run, 6, state, (state,), (), {}))
    np.testing.assert_array_equal(read_checkpoint(path).state.internal, state.internal)


def test_what_cannot_be_is_one_clear_line():
    x = CUBE.vertices
    scene = sp.Scene([sp.Body("cube", CUBE, SLOW)], pins=[sp.Pin("cube", [0, 1, 2])])
    with pytest.raises(SolverError, match="integrator='newmark' cannot simulate Viscoelastic and J2Plastic"):
        next(sp.simulate(scene, sp.Implicit(integrator="newmark", contact=None), dt=0.1, steps=1))
    with pytest.raises(SolverError, match="XPBD: body 'cube' has the material Viscoelastic, which XPBD cannot"):
        next(sp.simulate(scene, sp.XPBD(contact=None), dt=0.1, steps=1))
    wrong = State(0.0, x.copy(), 0.0 * x, internal=at_rest(3))
    with pytest.raises(SceneError, match="the state has 3 rows of internal variables, and the scene 12"):
        next(sp.simulate(scene, STATIC, dt=0.1, steps=1, start=wrong))
    for prony, message in (
        ([(0.6, 1.0), (0.5, 2.0)], "the shares of prony add up to 1.1; it must be below 1"),
        ([(0.5, -1.0)], "a share or a time that is not above zero"),
        ([0.5, 1.0], "prony is not a list of pairs"),
    ):
        with pytest.raises(SceneError, match=message):
            sp.Viscoelastic(material=RUBBER, prony=prony)  # pyright: ignore[reportArgumentType]
    with pytest.raises(SceneError, match="Viscoelastic: material is a J2Plastic; give a hyperelastic one"):
        sp.Viscoelastic(material=METAL, prony=[(0.5, 1.0)])
    with pytest.raises(SceneError, match="J2Plastic: saturation_stress is below yield_stress"):
        sp.J2Plastic(youngs=1e5, poisson=0.3, yield_stress=2e3, saturation_stress=1e3)


def test_a_series_in_nearly_incompressible_quadratic_tets_has_the_energy_of_the_report(tmp_path):
    mesh = sp.shapes.box((0.3, 0.2, 0.2), (3, 2, 2), order=2)
    rubber = sp.MooneyRivlin(c10=8e4, c01=2e4, bulk=1e7)
    x = mesh.vertices[:, 0]
    ends = [(x == x.min()).nonzero()[0], (x == x.max()).nonzero()[0]]
    pins = [sp.Pin("bar", ends[0]), sp.Pin("bar", ends[1], motion=lambda t: (min(t, 0.1), 0, 0))]
    body = sp.Body("bar", mesh, sp.Viscoelastic(material=rubber, prony=[(0.4, 0.1)]))
    sink = sp.Recorder(tmp_path / "r.vtkhdf")
    scene = sp.Scene([body], pins=pins, gravity=(0, 0, 0))
    *_, frame = sp.simulate(scene, STATIC, dt=0.05, steps=4, sinks=[sink])
    assert frame.report.status == "converged"
    with sp.read_recording(sink.path) as recording:
        np.testing.assert_array_equal(recording[-1].stress["bar"], frame.stress["bar"])
        checked = RecordedTrajectory(recording).snapshot(len(recording) - 1).elastic_energy
        assert checked == pytest.approx(frame.report.elastic_energy, rel=1e-12)
