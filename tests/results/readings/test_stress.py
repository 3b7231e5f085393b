"""Stresses, stretches and energies of a frame, compared with closed forms and with the elastic forces."""

import numpy as np
import pytest

import supple as sp
from supple.model.state import State
from supple.simulate import first_frame

E, NU = 1e5, 0.4
RUBBER = {"youngs": E, "poisson": NU}
MESH = sp.shapes.box((1.0, 0.8, 0.6), (2, 2, 2))
CELLS = len(MESH.tets)
MATERIALS = {
    "stable Neo-Hookean": sp.StableNeoHookean(**RUBBER),
    "Neo-Hookean": sp.NeoHookean(**RUBBER),
    "fixed corotated": sp.FixedCorotated(**RUBBER),
    "ARAP": sp.ARAP(**RUBBER),
    "Saint Venant-Kirchhoff": sp.StVenantKirchhoff(**RUBBER),
    "per tet": sp.StableNeoHookean(youngs=np.linspace(1e4, 1e5, CELLS), poisson=NU),
    "regions": sp.Regions(
        materials=[sp.StableNeoHookean(**RUBBER), sp.NeoHookean(youngs=1e6, poisson=0.2)], index=np.arange(CELLS) % 2
    ),
    "edges and volumes": sp.EdgesAndVolume(edge_compliance=1e-3, volume_compliance=1e-7),
}


def frame_of(bodies, x, **parts):
    return first_frame(sp.Scene(bodies, **parts), State(0.0, x, np.zeros_like(x)))


def deformed(material, gradient):
    x = MESH.vertices @ np.asarray(gradient).T
    return frame_of([sp.Body("block", MESH, material)], np.ascontiguousarray(x))


def rough(material, size=0.03):
    x = MESH.vertices + size * np.random.default_rng(1).normal(size=MESH.vertices.shape)
    return frame_of([sp.Body("block", MESH, material)], x)


@pytest.mark.parametrize(
    ("stretch", "stress", "lateral"), [(1.001, 99.914386, 0.99960022), (1.5, 36640.21164, 0.843274043)]
)
def test_uniaxial_stretch(stretch, stress, lateral):
    frame = deformed(sp.StableNeoHookean(**RUBBER), np.diag([stretch, lateral, lateral]))
    expected = np.zeros((3, 3))
    expected[0, 0] = stress
    # The table has nine digits of the lateral stretch, so that the lateral stress is zero up to 1e-9 E.
    np.testing.assert_allclose(frame.first_piola["block"], np.tile(expected, (CELLS, 1, 1)), rtol=1e-6, atol=3e-9 * E)
    cauchy = stress / lateral**2
    np.testing.assert_allclose(frame.stress["block"][:, 0, 0], cauchy, rtol=1e-6)
    np.testing.assert_allclose(frame.von_mises["block"], cauchy, rtol=1e-6)
    stretches = np.tile([stretch, lateral, lateral], (CELLS, 1))
    np.testing.assert_allclose(frame.principal_stretches["block"], stretches, rtol=1e-12)
    np.testing.assert_allclose(frame.von_mises.at_vertices["block"], cauchy, rtol=1e-6)
    assert frame.stress.at_vertices["block"].shape == (len(MESH.vertices), 3, 3)


def test_simple_shear():
    k, mu, lam = 0.3, E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    frame = deformed(sp.NeoHookean(**RUBBER), [[1, k, 0], [0, 1, 0], [0, 0, 1]])
    # J = 1: sigma = mu (B - I) with B = F F^T.
    expected = mu * np.array([[k * k, k, 0], [k, 0, 0], [0, 0, 0]])
    np.testing.assert_allclose(frame.stress["block"], np.tile(expected, (CELLS, 1, 1)), atol=1e-9 * mu)
    np.testing.assert_allclose(frame.energy_density["block"], 0.5 * mu * k * k, rtol=1e-12)
    mises = mu * np.sqrt(k**4 + 3 * k * k)
    np.testing.assert_allclose(frame.von_mises["block"], mises, rtol=1e-12)
    swollen = deformed(sp.NeoHookean(**RUBBER), 1.1 * np.eye(3))
    pressure = (mu * (1.1**2 - 1) + lam * np.log(1.1**3)) / 1.1**3
    np.testing.assert_allclose(swollen.stress["block"], np.tile(pressure * np.eye(3), (CELLS, 1, 1)), atol=1e-8 * mu)


def nodal_forces(frame):
    """Minus the sum of V P Dm^-T over all tets."""
    laws, forces = frame.system.laws, np.zeros_like(frame.state.positions)
    H = -laws.volumes[:, None, None] * frame.first_piola["block"] @ np.swapaxes(laws.Dm_inv, 1, 2)
    for k in range(3):
        np.add.at(forces, laws.tets[:, k + 1], H[:, :, k])
        np.add.at(forces, laws.tets[:, 0], -H[:, :, k])
    return forces


@pytest.mark.parametrize("name", MATERIALS)
def test_the_nodal_forces_of_the_stress_are_minus_the_gradient_of_the_energy(name):
    frame = rough(MATERIALS[name])
    x, direction = frame.state.positions, np.random.default_rng(2).normal(size=MESH.vertices.shape)
    body = [sp.Body("block", MESH, MATERIALS[name])]
    power, errors = float((nodal_forces(frame) * direction).sum()), []
    for h in (1e-4, 5e-5):
        rise = [frame_of(body, x + s * h * direction).report.elastic_energy for s in (1, -1)]
        errors.append(abs((rise[0] - rise[1]) / (2 * h) + power) / abs(power))
    assert errors[1] < 1e-6
    assert errors[1] < 0.3 * errors[0] or errors[1] < 1e-9


@pytest.mark.parametrize("name", MATERIALS)
def test_energy_densities_add_up_to_the_energy_of_the_report(name):
    frame = rough(MATERIALS[name])
    total = frame.energy_density["block"] @ MESH.volumes
    assert total == pytest.approx(frame.report.elastic_energy, rel=1e-12)
    # Each tet gives a quarter of its volume to each vertex.
    shares = np.bincount(MESH.tets.ravel(), np.repeat(MESH.volumes / 4, 4))
    assert frame.energy_density.at_vertices["block"] @ shares == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize("name", MATERIALS)
def test_stress_rotates_with_the_body(name):
    frame = rough(MATERIALS[name])
    c, s = np.cos(0.7), np.sin(0.7)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    turned = frame_of([sp.Body("block", MESH, MATERIALS[name])], frame.state.positions @ R.T)
    scale = np.abs(frame.stress["block"]).max()
    np.testing.assert_allclose(turned.stress["block"], R @ frame.stress["block"] @ R.T, atol=1e-10 * scale)
    np.testing.assert_allclose(turned.stress["block"], np.swapaxes(turned.stress["block"], 1, 2), atol=1e-10 * scale)
    np.testing.assert_allclose(turned.von_mises["block"], frame.von_mises["block"], atol=1e-10 * scale)


def test_fields_are_read_by_the_name_of_a_body():
    small = sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1))
    bodies = [
        sp.Body("block", MESH, MATERIALS["stable Neo-Hookean"]),
        sp.Body("cube", small, sp.ARAP(**RUBBER), position=(2, 0, 0)),
        sp.Body("net", small, sp.EdgesAndVolume(volume_compliance=1e-6), position=(3, 0, 0)),
    ]
    x = np.concatenate([1.1 * body.place(body.mesh.vertices) for body in bodies])
    frame = frame_of(bodies, x)
    assert frame.stress["cube"].shape == (len(small.tets), 3, 3)
    assert list(frame.stress) == ["block", "cube"]
    assert list(frame.principal_stretches) == list(frame.energy_density) == ["block", "cube", "net"]
    assert "net" not in frame.von_mises
    with pytest.raises(sp.SceneError, match="body 'net' has rigid edges or volumes, whose forces do not follow"):
        frame.von_mises["net"]
    with pytest.raises(sp.SceneError, match="body 'cub' does not exist; did you mean 'cube'"):
        frame.stress["cub"]
    # Edges are rigid, so that the energy is that of the volumes.
    V = small.volumes
    np.testing.assert_allclose(frame.energy_density["net"], 0.5 * (1.1**3 - 1) ** 2 * V / 1e-6, rtol=1e-9)


def test_a_recorded_frame_has_the_fields_of_the_simulated_one(tmp_path):
    bodies = [
        sp.Body(name, MESH, MATERIALS[name], position=(2 * k, 0, 0))
        for k, name in enumerate(("regions", "edges and volumes", "Neo-Hookean"))
    ]
    scene = sp.Scene(bodies)
    x = np.concatenate([body.place(body.mesh.vertices) for body in bodies])
    x += 0.02 * np.random.default_rng(1).normal(size=x.shape)
    frame = frame_of(bodies, x)
    recorder = sp.Recorder(tmp_path / "run.vtkhdf")
    recorder.begin(frame, 0.1, 0)
    recorder.end()
    with sp.read_recording(tmp_path / "run.vtkhdf") as recording:
        for field in ("stress", "first_piola", "von_mises", "principal_stretches", "energy_density"):
            for name in (body.name for body in scene.bodies):
                simulated, recorded = getattr(frame, field)[name], getattr(recording[0], field)[name]
                np.testing.assert_allclose(recorded, simulated, rtol=1e-9, atol=1e-9 * np.abs(simulated).max())
