"""Holzapfel-Gasser-Ogden: closed forms, finite differences, convexity, and a body whose fibres turn it."""

import numpy as np
import pytest

import supple as sp
from supple.errors import SceneError

C10, BULK, K1, K2 = 3e3, 3e5, 5e4, 3.0


def tissue(directions, kappa=0.0):
    return sp.HolzapfelGasserOgden(c10=C10, bulk=BULK, k1=K1, k2=K2, kappa=kappa, directions=directions)


@pytest.mark.parametrize("kappa", [0.0, 0.1, 1 / 3])
def test_curves_are_the_closed_forms(kappa):
    material = tissue([[2.0, 0.0, 0.0]], kappa)
    for stretch in (0.8, 1.01, 1.2, 1.5):
        s = np.array([stretch, stretch**-0.5, stretch**-0.5])
        P = np.diag(material.first_piola(np.diag(s)))
        E = kappa * ((s**2).sum() - 3) + (1 - 3 * kappa) * (stretch**2 - 1)
        slope = K1 * E * np.exp(K2 * E**2) if E > 0 else 0.0
        weights = np.array([1 - 2 * kappa, kappa, kappa])
        fibres = 2 * slope * weights * s
        ground = 2 * C10 * (stretch - stretch**-2)
        assert P[0] - P[1] * s[1] / s[0] == pytest.approx(ground + fibres[0] - fibres[1] * s[1] / s[0], rel=1e-6)
    # Two families at 45 degrees to the direction of biaxial tension: each is stretched alike.
    two = tissue([[1, 1, 0], [1, -1, 0]], kappa)
    F = np.diag([1.2, 1.2, 1.2**-2])
    E = kappa * (np.trace(F @ F) - 3) + (1 - 3 * kappa) * (1.44 - 1)
    exact = 2 * C10 * (1.2 - 1.2**-5) + 2 * (2 * K1 * E * np.exp(K2 * E**2)) * (
        (kappa + (1 - 3 * kappa) / 2) * 1.2 - kappa * 1.2**-5
    )
    P = two.first_piola(F)
    assert P[0, 0] - P[2, 2] * 1.2**-3 == pytest.approx(exact, rel=1e-6)
    ground = sp.MooneyRivlin(c10=C10, bulk=BULK)
    squeezed = np.diag([0.9, 1.0, 1.1])
    np.testing.assert_allclose(tissue([[1, 0, 0]]).first_piola(squeezed), ground.first_piola(squeezed), rtol=1e-12)


def test_derivatives_have_slope_two_and_the_fibres_are_convex():
    rng = np.random.default_rng(1)
    for kappa in (0.0, 0.2):
        material = tissue(rng.normal(size=(2, 3)), kappa)
        ground = sp.MooneyRivlin(c10=C10, bulk=BULK)
        for _ in range(5):
            F = np.eye(3) * 1.2 + 0.15 * rng.normal(size=(3, 3))
            dF = rng.normal(size=(3, 3))
            P, H = material.first_piola(F), material.hessian(F)
            np.testing.assert_array_equal(H, H.T)
            values, stresses = [], []
            for h in (2e-3, 1e-3):
                plus, minus = F + h * dF, F - h * dF
                slope = (material.energy_density(plus) - material.energy_density(minus)) / (2 * h)
                values.append(abs(slope - (P * dF).sum()))
                change = (material.first_piola(plus) - material.first_piola(minus)).ravel() / (2 * h)
                stresses.append(np.abs(change - H @ dF.ravel()).max())
            assert np.log2(values[0] / values[1]) == pytest.approx(2.0, abs=0.1)
            assert np.log2(stresses[0] / stresses[1]) == pytest.approx(2.0, abs=0.1)
            assert np.linalg.eigvalsh(H - ground.hessian(F)).min() > -1e-10 * np.abs(H).max()
            assert np.linalg.eigvalsh(material.hessian(F, project=True)).min() > -1e-10 * np.abs(H).max()


def test_a_strip_twists_with_the_helix_of_its_fibres(tmp_path):
    mesh = sp.shapes.box((0.4, 0.1, 0.1), (8, 2, 2))
    centers = mesh.vertices[mesh.tets].mean(axis=1)
    ends = [(mesh.vertices[:, 0] == end).nonzero()[0] for end in (mesh.vertices[:, 0].min(), mesh.vertices[:, 0].max())]

    def turn(sign):
        around = np.cross([1.0, 0.0, 0.0], centers)
        around /= np.linalg.norm(around, axis=1)[:, None]
        directions = np.array([1.0, 0.0, 0.0]) + sign * around
        pulled = sp.Force("strip", ends[1], (20.0, 0.0, 0.0))
        body = sp.Body("strip", mesh, tissue(directions[:, None, :]))
        scene = sp.Scene([body], pins=[sp.Pin("strip", ends[0])], forces=[pulled], gravity=(0, 0, 0))
        sink = sp.Recorder(tmp_path / "r.vtkhdf")
        solver = sp.Implicit(integrator="static", contact=None)
        (frame,) = sp.simulate(scene, solver, dt=1.0, steps=1, sinks=[sink])
        assert frame.report.status == "converged"
        with sp.read_recording(sink.path) as recording:
            np.testing.assert_array_equal(recording[-1].stress["strip"], frame.stress["strip"])
        rest, now = mesh.vertices[ends[1]][:, 1:], frame.positions["strip"][ends[1]][:, 1:]
        now = now - now.mean(axis=0)
        return (rest[:, 0] * now[:, 1] - rest[:, 1] * now[:, 0]).sum() / (rest**2).sum()

    right, left = turn(1.0), turn(-1.0)
    assert abs(right) > 0.02
    assert right * left < 0.0


def test_bad_parameters_are_one_clear_line():
    with pytest.raises(SceneError, match=r"HolzapfelGasserOgden: kappa is 0.5; it must be from 0 to 0.333333"):
        tissue([[1, 0, 0]], 0.5)
    with pytest.raises(SceneError, match=r"HolzapfelGasserOgden: directions has shape \(3,\); give \(families, 3\)"):
        tissue([1, 0, 0])
    with pytest.raises(SceneError, match="a direction is zero or not finite"):
        tissue([[0, 0, 0]])
    with pytest.raises(SceneError, match="directions has 2 rows for 5 tets; give one per tet"):
        tissue(np.ones((2, 1, 3))).per_tet(5)
