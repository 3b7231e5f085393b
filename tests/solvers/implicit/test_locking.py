"""Quadratic tets of nearly incompressible material do not lock: deflections, orders, pressures, recordings."""

import numpy as np
import pytest

import supple as sp
from supple.materials.elastic_tets.mean_volume import volume_share
from supple.materials.material import Elastic
from supple.model.system import build_system
from supple.scene.forces import Force
from supple.solvers.implicit.energies.elasticity import elasticity_of

STATIC = sp.Implicit(integrator="static", contact=None)


def rubber(poisson, kind: type[Elastic] = sp.StableNeoHookean):
    return kind(youngs=1.0, poisson=poisson)


def equilibrium(scene):
    (frame,) = sp.simulate(scene, STATIC, 1.0, 1)
    assert frame.report.status == "converged", frame.report.message
    return frame


def test_the_share_begins_at_a_third_and_leaves_a_first_parameter_between_mu_and_twice_mu():
    nu = np.array([-0.3, 0.0, 0.25, 1 / 3, 0.334, 0.4, 0.45, 0.49, 0.4999])
    lam = 2 * nu / (1 - 2 * nu)
    share = volume_share(np.ones_like(lam), lam)
    assert (share[:4] == 0.0).all()
    assert (np.diff(share[3:]) > 0.0).all()
    rest = (lam - share)[4:]
    assert ((rest > 1.0) & (rest < 2.01)).all()


@pytest.mark.parametrize("poisson", [0.3, 0.49])
def test_convergence_order(poisson):
    """L2 errors of a smooth field without change of volume: order 3, and with mean volumes 2 or more."""
    errors, sizes = [], (3, 6)
    a, mu = 1e-6, 1.0 / (2 * (1 + poisson))
    for n in sizes:
        unit = sp.shapes.box((1, 1, 1), (n, n, n))
        mesh = sp.TetMesh(unit.vertices + 0.5, unit.tets).to_order(2)
        X = mesh.vertices
        s, c = np.sin(np.pi * X), np.cos(np.pi * X)
        field = a * np.column_stack([s[:, 0] * c[:, 1], -c[:, 0] * s[:, 1], 0 * s[:, 2]])
        # div u = 0, so that -div sigma = -mu lap u = 2 pi^2 mu u; -1/20 and 1/5 are the integrals of straight tets.
        weights = np.bincount(mesh.nodes.ravel(), np.outer(mesh.volumes, [-1 / 20] * 4 + [1 / 5] * 6).ravel())
        force = 2 * np.pi**2 * mu * field * weights[:, None]
        hull = np.unique(mesh.surface.triangles)
        inner = np.setdiff1d(np.arange(len(X)), hull)
        scene = sp.Scene(
            [sp.Body("cube", mesh, rubber(poisson))],
            pins=[sp.Pin("cube", hull, lambda t, move=field[hull]: t * move)],
            forces=[Force("cube", inner, force[inner])],
            gravity=(0, 0, 0),
        )
        error = equilibrium(scene).positions["cube"] - X - field
        shares = np.bincount(mesh.nodes.ravel(), np.repeat(mesh.volumes / 10, 10))
        errors.append(np.sqrt((shares * (error**2).sum(axis=1)).sum()) / a)
    assert np.log2(errors[0] / errors[1]) > (1.9 if poisson > 1 / 3 else 2.7)


class CompressedBlock:
    """A block with irregular cells that is compressed by 30 %, and the pressure in it.

    The vertices of its plates move sideways by a share of their places: 0 where they are bonded.
    """

    def __init__(self, cells, material, sideways=0.0):
        unit = sp.shapes.box((1, 1, 1), (cells, cells, cells))
        inner = np.setdiff1d(np.arange(len(unit.vertices)), np.unique(unit.surface.triangles))
        vertices = unit.vertices.copy()
        vertices[inner] += 0.2 / cells * np.random.default_rng(1).uniform(-1, 1, (len(inner), 3))
        self.mesh = mesh = sp.TetMesh(vertices, unit.tets).to_order(2)
        ends = np.flatnonzero(np.abs(mesh.vertices[:, 1]) > 0.5 - 1e-9)
        move = mesh.vertices[ends] * [sideways, -0.3, sideways]
        pin = sp.Pin("b", ends, lambda t: t * move)
        frame = equilibrium(sp.Scene([sp.Body("b", mesh, material)], pins=[pin], gravity=(0, 0, 0)))
        self.iterations = frame.report.iterations
        self.pressures = -np.trace(frame.stress["b"], axis1=1, axis2=2) / 3.0
        self.centroids = vertices[mesh.tets].mean(axis=1)

    def jump(self, half=0.3):
        """Mean jump of the pressure between neighbours over its mean, for |x|, |y|, |z| < `half`."""
        inside = (np.abs(self.centroids) < half).all(axis=1)
        tet, facet = np.nonzero(self.mesh.adjacency >= 0)
        beside = self.mesh.adjacency[tet, facet]
        jumps = np.abs(self.pressures[tet] - self.pressures[beside])[inside[tet] & inside[beside]]
        return jumps.mean() / abs(np.average(self.pressures[inside], weights=self.mesh.volumes[inside]))


def test_the_pressure_of_a_compressed_block_has_no_checkerboard():
    """At nu = 0.4999. Between smooth plates it is constant; near bonded ones it varies."""
    smooth = CompressedBlock(3, rubber(0.4999), 0.7**-0.5 - 1.0)
    assert smooth.jump() < 1e-3
    bonded = CompressedBlock(4, rubber(0.4999))
    assert bonded.iterations < 30
    assert bonded.jump() < 0.4  # 2.0 with the volumes of four points


def test_a_turned_and_inflated_element_has_the_energy_of_its_volume():
    """Under a rotation and a uniform stretch there is no difference between the mean and the volume at each point."""
    mesh = sp.shapes.box((1, 1, 1), (1, 1, 1), order=2)
    c, s = np.cos(2.5), np.sin(2.5)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    for kind in (sp.StableNeoHookean, sp.NeoHookean, sp.FixedCorotated):
        material = rubber(0.49, kind)
        energy = elasticity_of(build_system(sp.Scene([sp.Body("b", mesh, material)])))
        assert energy.value(mesh.vertices @ turn.T + [3.0, -2.0, 7.0]) == pytest.approx(0.0, abs=1e-12)
        swollen = energy.value(1.2 * mesh.vertices @ turn.T)
        assert swollen == pytest.approx(material.energy_density(1.2 * turn), rel=1e-9)


def test_a_fall_is_recorded_and_checked(tmp_path):
    """A soft block falls on a plane; the check computes the energy of mean volumes on its own."""
    body = sp.Body(
        "block",
        sp.shapes.box((0.2, 0.2, 0.2), (2, 2, 2), order=2),
        sp.StableNeoHookean(youngs=2e4, poisson=0.49, density=1000, damping=0.01),
        position=(0, 0.15, 0),
    )
    scene = sp.Scene([body], obstacles=[sp.HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5)])
    path = tmp_path / "fall.vtkhdf"
    solver = sp.Implicit(integrator="bdf2")
    for frame in sp.simulate(scene, solver, 1 / 60, 16, sinks=[sp.Recorder(path, solver=solver)]):
        assert frame.report.status == "converged"
    report = sp.check_recording(path)
    assert report.ok, report
    assert str(report["records"].verdict) == "pass"
