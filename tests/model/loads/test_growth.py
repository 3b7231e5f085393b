"""Growth: no stress where it is free, the stress of closed forms where it is not, derivatives, recordings, errors."""

from typing import Any

import h5py
import numpy as np
import pytest
from tests.derivatives import differences, gradient_of
from tests.recordings import set_in_scene

import supple as sp
from supple.errors import OutputError, SceneError
from supple.model.system import build_system
from supple.results.recording.reader import read_recording
from supple.scene.loads.over_time import script_of
from supple.solvers.implicit.energies.elasticity import elasticity_of

E, NU = 1e5, 0.3
RUBBER = sp.StableNeoHookean(youngs=E, poisson=NU, damping=0.02)
BAR = sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1))
STILL: dict[str, Any] = {"gravity": (0.0, 0.0, 0.0)}
SOLVERS = {"implicit": sp.Implicit(contact=None), "xpbd": sp.XPBD(substeps=20, contact=None)}
SWELLING = sp.Curve([0.0, 0.2], [1.0, 1.2])


def last_of(scene, solver, steps=40, **options):
    *_, frame = sp.simulate(scene, solver, 1 / 60, steps, **options)
    return frame


@pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS)
def test_free_growth_has_no_stress(solver):
    """Everywhere by 1.2, and in addition along an oblique direction by 0.9."""
    along = np.array([1.0, 2.0, 0.5])
    loads = [sp.Growth("bar", SWELLING), sp.Growth("bar", sp.Curve([0.0, 0.2], [1.0, 0.9]), along)]
    frames = list(sp.simulate(sp.Scene([sp.Body("bar", BAR, RUBBER)], loads=loads, **STILL), solver, 1 / 60, 40))
    frame = frames[-1]
    assert np.abs(frame.stress["bar"]).max() < 0.005 * E
    np.testing.assert_allclose(frame.principal_stretches["bar"], [[1.2, 1.2, 1.08]] * len(BAR.tets), atol=5e-3)
    assert frame.report.min_det_F == pytest.approx(0.9 * 1.2**3, rel=5e-3)
    work = {name: sum(item.report.work[name] for item in frames) for name in frame.report.work}
    assert work["growth"] > 0.0
    assert work["damping"] < 0.0
    assert abs(sum(work.values())) < 0.01 * work["growth"]


def isotropic_stress(s):
    """Cauchy stress of Stable Neo-Hookean material that is held while it grows by s: F_e = 1 / s."""
    material = RUBBER.per_tet(1)
    mu, lam, J = material.mu[0], material.lam[0], s**-3
    return (mu / s**2 - mu * J + lam * (J - 1.0) * J) / J


@pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS)
def test_a_held_body_has_the_stress_of_the_closed_form(solver, tmp_path):
    """Also what a recording gives, what check finds, and the reactions of pins."""
    path = tmp_path / "run.vtkhdf"
    right = np.flatnonzero(BAR.vertices[:, 0] > 0.19)
    others = np.setdiff1d(np.arange(len(BAR.vertices)), right)
    pins = [sp.Pin("bar", right, name="right"), sp.Pin("bar", others, name="others")]
    scene = sp.Scene([sp.Body("bar", BAR, RUBBER)], pins=pins, loads=[sp.Growth("bar", SWELLING)], **STILL)
    frame = last_of(scene, solver, 15, sinks=[sp.Recorder(path)])
    expected = isotropic_stress(1.2)
    assert expected < -0.3 * E
    np.testing.assert_allclose(frame.stress["bar"], [expected * np.eye(3)] * len(BAR.tets), rtol=1e-9, atol=1e-9 * E)
    push = next(value for label, value in frame.reactions.items() if "right" in label)
    assert push[0] == pytest.approx(expected * 0.01, rel=1e-9)
    with read_recording(path) as recording:
        (growth,) = recording.scene.loads
        assert script_of(growth, "stretch")(recording[-1].time) == 1.2
        np.testing.assert_array_equal(recording[-1].stress["bar"], frame.stress["bar"])
    report = sp.check_recording(path)
    assert {str(report[name].verdict) for name in ("energy", "balance", "records", "volume")} == {"pass"}
    work = frame.report.work
    assert set(work) == {"pins", "growth", "contact", "friction", "damping", "numerical"}


def test_heat_in_a_bar_between_walls_gives_its_thermal_stress():
    """E alpha T with alpha T = 1e-3; the ends are held, and far from them stress is uniaxial."""
    bar = sp.shapes.box((0.8, 0.1, 0.1), (16, 2, 2))
    ends = [sp.Pin("bar", sp.InBox((x - 0.01, -1, -1), (x + 0.01, 1, 1))) for x in (-0.4, 0.4)]
    law = sp.StableNeoHookean(youngs=E, poisson=0.1)
    heat = sp.Growth("bar", 1.0 + 1e-3, (1, 0, 0))
    scene = sp.Scene([sp.Body("bar", bar, law)], pins=ends, loads=[heat], **STILL)
    frame = last_of(scene, sp.Implicit(integrator="static", contact=None), 1)
    middle = np.abs(bar.vertices[bar.tets].mean(axis=1)[:, 0]) < 0.15
    stress = np.average(frame.stress["bar"][middle], axis=0, weights=bar.volumes[middle])
    assert stress[0, 0] == pytest.approx(-1e-3 * E, rel=0.005)
    assert abs(stress[1, 1]) < 0.01 * abs(stress[0, 0])


YEOH = sp.Yeoh(c10=2e4, c20=1e3, bulk=2e5)


@pytest.mark.parametrize(
    ("mesh", "law"),
    [(BAR.to_order(2), RUBBER), (BAR.to_order(2), YEOH), (BAR, YEOH)],
    ids=["quadratic", "quadratic yeoh", "yeoh"],
)
def test_every_kind_of_tet_grows(mesh, law):
    pins = [sp.Pin("bar", [0])]
    scene = sp.Scene([sp.Body("bar", mesh, law)], pins=pins, loads=[sp.Growth("bar", 1.1)], **STILL)
    frame = last_of(scene, sp.Implicit(integrator="static", contact=None), 1)
    assert frame.report.min_det_F == pytest.approx(1.1**3, rel=1e-6)
    assert np.abs(frame.stress["bar"]).max() < 1e-5 * E
    assert frame.report.elastic_energy == pytest.approx(0.0, abs=1e-9)


def test_gradient_and_hessian_have_slope_two():
    loads = [sp.Growth("bar", 1.3, tets=range(10)), sp.Growth("bar", 0.8, (1, 1, 0))]
    scene = sp.Scene([sp.Body("first", BAR, RUBBER, position=(0, 1, 0)), sp.Body("bar", BAR, RUBBER)], loads=loads)
    system = build_system(scene)
    solver = sp.Implicit(contact=None)
    potential = solver.prepare(system).elasticity_at(0.0)
    rng = np.random.default_rng(1)
    x = 1.1 * system.start_states[0].positions + 0.004 * rng.normal(size=system.rest_positions.shape)
    d = rng.normal(size=x.shape)
    assert potential.value(x) != pytest.approx(elasticity_of(system).value(x), rel=0.1)

    errors = []
    for h in (2e-4, 1e-4):
        errors.append(abs(differences(potential, x, d, h)[0] - np.vdot(gradient_of(potential, x), d)))
    assert errors[1] < 0.3 * errors[0]


@pytest.mark.parametrize(
    ("described", "message"),
    [("melting", "stretch is not an array of numbers|stretch is 'melting'"), (-3.0, "stretch is -3; it must be from")],
)
def test_recordings_of_what_is_not_known_are_refused(tmp_path, described, message):
    path = tmp_path / "run.vtkhdf"
    scene = sp.Scene([sp.Body("bar", BAR, RUBBER)], loads=[sp.Growth("bar", 1.1)], **STILL)
    last_of(scene, sp.XPBD(substeps=1, contact=None), 1, sinks=[sp.Recorder(path)])
    with h5py.File(path, "r+") as file:
        set_in_scene(file, "scene/loads/0/stretch", described)
    with pytest.raises(OutputError, match=message):
        read_recording(path)


def test_what_is_refused():
    net = sp.EdgesAndVolume(edge_compliance=1e-4, volume_compliance=1e-6)
    for load, body, message in (
        (lambda: sp.Growth("bar", 0.0), None, "stretch"),
        (lambda: sp.Growth("bar", np.nan), None, "stretch"),
        (lambda: sp.Growth("bar", 1e308), None, r"stretch is 1e\+308; it must be from 0.001 to 1000"),
        (lambda: sp.Growth("bar", sp.Curve([0, 1], [1, 1e-9])), None, "stretch is 1e-09; it must be from"),
        (lambda: sp.Growth("bar", 1.1, (0, 0, 0)), None, "direction is zero"),
        (lambda: sp.Growth("bar", 1.1, tets=[99]), None, "tet 99 does not exist"),
        (lambda: sp.Growth("bar", 1.1, tets=[1, 1]), None, "names a tet twice"),
        (lambda: sp.Growth("bar", 1.1), sp.Body("bar", BAR, net), "EdgesAndVolume has no deformation gradient"),
        (lambda: sp.Growth("rug", 1.1), None, "body 'rug' does not exist"),
    ):
        with pytest.raises(SceneError, match=message):
            sp.Scene([body or sp.Body("bar", BAR, RUBBER)], loads=[load()])
