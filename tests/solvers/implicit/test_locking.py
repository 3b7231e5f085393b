"""Linear tets with patches do not lock: Cook's membrane, torsion, convergence, pressure; what XPBD says of them."""

import numpy as np
import pytest
from scipy.interpolate import LinearNDInterpolator

import supple as sp
from supple.errors import SolverError
from supple.materials.elastic import NeoHookean
from supple.scene.forces import Force
from supple.solvers.implicit.solver import Implicit

STATIC = Implicit(integrator="static", contact=None)
COOK_LOAD = 1e-4


def rubber(poisson, integration="patches", kind=sp.StableNeoHookean, **extra):
    return kind(youngs=1.0, poisson=poisson, integration=integration, **extra)


def equilibrium(scene, steps=1):
    frame = list(sp.simulate(scene, STATIC, 1.0, steps))[-1]
    assert frame.report.status == "converged", frame.report.message
    return frame


def cook_deflection(cells, material):
    """Of the upper right corner of Cook's membrane, 10 thick, per unit of load and thickness, for a tiny load."""
    unit = sp.shapes.box((1, 1, 1), (cells, cells, max(1, round(cells * 10 / 48))))
    X = unit.vertices + 0.5
    mesh = sp.TetMesh(
        np.column_stack([48 * X[:, 0], 44 * X[:, 0] + X[:, 1] * (44 - 28 * X[:, 0]), 10 * X[:, 2]]), unit.tets
    )
    x, triangles = mesh.vertices, mesh.surface.triangles
    end = triangles[(X[triangles][:, :, 0] > 1 - 1e-9).all(axis=1)]
    areas = 0.5 * np.linalg.norm(np.cross(x[end[:, 1]] - x[end[:, 0]], x[end[:, 2]] - x[end[:, 0]]), axis=1)
    share = np.bincount(end.ravel(), weights=np.repeat(areas / 3, 3), minlength=len(x)) / 16
    loaded = np.flatnonzero(share)
    scene = sp.Scene(
        [sp.Body("cook", mesh, material)],
        pins=[sp.Pin("cook", np.flatnonzero(X[:, 0] < 1e-9))],
        forces=[Force("cook", loaded, COOK_LOAD * share[loaded, None] * [0.0, 1.0, 0.0])],
        gravity=(0, 0, 0),
    )
    corner = np.flatnonzero((X[:, 0] > 1 - 1e-9) & (X[:, 1] > 1 - 1e-9))
    moved = equilibrium(scene).positions["cook"] - x
    return moved[corner, 1].mean() / COOK_LOAD


@pytest.mark.parametrize(
    ("poisson", "converged", "error"), [pytest.param(1 / 3, 25.0, 0.03, marks=pytest.mark.slow), (0.499, 24.9, 0.03)]
)
def test_cooks_membrane(poisson, converged, error):
    """`converged` is extrapolated (docs/theory/locking.md)."""
    assert cook_deflection(16, rubber(poisson)) == pytest.approx(converged, rel=error)
    assert cook_deflection(8, rubber(poisson)) > 0.85 * converged
    assert cook_deflection(8, rubber(poisson, "tets")) < 0.7 * converged


def test_torsion_of_a_square_bar():
    """Energy of a small twist with 3 cells across, against 0.0273 (nu = 1/3) of quadratic tets on the same cells."""
    mesh = sp.shapes.box((1, 1, 2), (3, 3, 6))
    x, angle = mesh.vertices, 1e-4
    ends = np.flatnonzero(np.abs(x[:, 2]) > 1 - 1e-9)
    turn = np.where(x[ends, 2] > 0, angle, 0.0)[:, None] * np.column_stack([-x[ends, 1], x[ends, 0], 0 * x[ends, 0]])
    energies = []
    for integration in ("tets", "patches"):
        scene = sp.Scene(
            [sp.Body("bar", mesh, rubber(1 / 3, integration))],
            pins=[sp.Pin("bar", ends, lambda t: t * turn)],
            gravity=(0, 0, 0),
        )
        energies.append(2 * equilibrium(scene).report.elastic_energy / angle**2)
    assert energies[0] > 1.5 * 0.0273
    assert energies[1] == pytest.approx(0.0273, rel=0.08)


def test_affine_patch():
    mesh = sp.shapes.box((1, 1, 1), (3, 3, 3))
    hull = np.unique(mesh.surface.triangles)
    inner = np.setdiff1d(np.arange(len(mesh.vertices)), hull)
    vertices = mesh.vertices.copy()
    vertices[inner] += 0.05 * np.random.default_rng(0).uniform(-1, 1, (len(inner), 3))
    mesh = sp.TetMesh(vertices, mesh.tets)
    A = np.array([[0.2, 0.1, 0.0], [-0.05, -0.1, 0.15], [0.0, 0.1, 0.05]])
    move = mesh.vertices[hull] @ A.T
    for kind in (sp.StableNeoHookean, NeoHookean):
        scene = sp.Scene(
            [sp.Body("patch", mesh, rubber(0.45, kind=kind))],
            pins=[sp.Pin("patch", hull, lambda t: t * move)],
            gravity=(0, 0, 0),
        )
        frame = equilibrium(scene)
        assert np.abs(frame.positions["patch"] - mesh.vertices @ (np.eye(3) + A).T).max() < 1e-8


def test_convergence_order():
    """L2 errors of a smooth field without change of volume, at nu = 0.49: order 2 (docs/theory/locking.md)."""
    errors, sizes = [], (6, 12)
    a, mu = 1e-6, 1.0 / (2 * 1.49)
    for n in sizes:
        unit = sp.shapes.box((1, 1, 1), (n, n, n))
        X = unit.vertices + 0.5
        mesh = sp.TetMesh(X, unit.tets)
        s, c = np.sin(np.pi * X), np.cos(np.pi * X)
        field = a * np.column_stack([s[:, 0] * c[:, 1], -c[:, 0] * s[:, 1], 0 * s[:, 2]])
        # div u = 0, so that -div sigma = -mu lap u = 2 pi^2 mu u.
        lumped = np.bincount(mesh.tets.ravel(), weights=np.repeat(mesh.volumes / 4, 4))
        force = 2 * np.pi**2 * mu * field * lumped[:, None]
        hull = np.unique(mesh.surface.triangles)
        inner = np.setdiff1d(np.arange(len(X)), hull)
        scene = sp.Scene(
            [sp.Body("cube", mesh, rubber(0.49))],
            pins=[sp.Pin("cube", hull, lambda t, move=field[hull]: t * move)],
            forces=[Force("cube", inner, force[inner])],
            gravity=(0, 0, 0),
        )
        error = equilibrium(scene).positions["cube"] - X - field
        errors.append(np.sqrt((lumped * (error**2).sum(axis=1)).sum()) / a)
    assert np.log2(errors[0] / errors[1]) > 1.75


class CompressedBlock:
    """A block with irregular cells that is compressed by 30 %, and the pressure in it.

    The vertices of its plates move sideways by a share of their places: 0 where they are bonded.

    Attributes
    ----------
    pressures : (m,) of the tets; at_vertices : (n,) means over the tets around each vertex
    averaged : (m,) means of the latter over the vertices of each tet
    """

    def __init__(self, cells, material, sideways=0.0):
        unit = sp.shapes.box((1, 1, 1), (cells, cells, cells))
        inner = np.setdiff1d(np.arange(len(unit.vertices)), np.unique(unit.surface.triangles))
        vertices = unit.vertices.copy()
        vertices[inner] += 0.2 / cells * np.random.default_rng(1).uniform(-1, 1, (len(inner), 3))
        self.mesh = mesh = sp.TetMesh(vertices, unit.tets)
        ends = np.flatnonzero(np.abs(vertices[:, 1]) > 0.5 - 1e-9)
        move = vertices[ends] * [sideways, -0.3, sideways]
        pin = sp.Pin("b", ends, lambda t: t * move)
        frame = equilibrium(sp.Scene([sp.Body("b", mesh, material)], pins=[pin], gravity=(0, 0, 0)))
        self.iterations = frame.report.iterations
        self.pressures = -np.trace(frame.stress["b"], axis1=1, axis2=2) / 3.0
        self.at_vertices = -np.trace(frame.stress.at_vertices["b"], axis1=1, axis2=2) / 3.0
        self.averaged = self.at_vertices[mesh.tets].mean(axis=1)
        self.centroids = vertices[mesh.tets].mean(axis=1)

    def jump(self, values, half=0.5):
        """Mean jump of values (m,) between neighbours over the mean pressure, for |x|, |y|, |z| < `half`."""
        inside = (np.abs(self.centroids) < half).all(axis=1)
        tet, facet = np.nonzero(self.mesh.adjacency >= 0)
        beside = self.mesh.adjacency[tet, facet]
        both = inside[tet] & inside[beside]
        jumps = np.abs(values[tet] - values[beside])[both]
        return jumps.mean() / abs(np.average(self.pressures[inside], weights=self.mesh.volumes[inside]))


def test_pressure_of_a_compressed_block_has_no_checkerboard():
    """At nu = 0.4999. Between smooth plates it is constant; near bonded plates it varies (docs/theory/locking.md)."""
    smooth = CompressedBlock(5, rubber(0.4999), 0.7**-0.5 - 1.0)
    assert smooth.jump(smooth.pressures) < 1e-3
    bonded = CompressedBlock(5, rubber(0.4999))
    assert bonded.iterations < 60  # 279 with the whole term of pressure projected tet by tet
    assert bonded.jump(bonded.pressures) < 0.3
    assert bonded.jump(bonded.averaged) < 0.12
    locked = CompressedBlock(5, rubber(0.4999, "tets"))
    assert locked.jump(locked.pressures) > 4.0


@pytest.mark.slow
def test_averaged_pressure_jumps_by_its_gradient_only_and_converges():
    """Between bonded plates, in the inner half: against the field of the finest mesh, on the same cells."""
    sizes = (5, 8, 12)
    blocks = [CompressedBlock(cells, rubber(0.4999)) for cells in sizes]
    field = LinearNDInterpolator(blocks[-1].mesh.vertices, blocks[-1].at_vertices)
    jumps, errors = [], []
    for block in blocks:
        exact = field(block.centroids)
        jumps.append(block.jump(block.averaged, 0.25))
        assert jumps[-1] == pytest.approx(block.jump(exact, 0.25), rel=0.2)
        inside = (np.abs(block.centroids) < 0.25).all(axis=1)
        off = (block.averaged - exact)[inside] / block.averaged[inside].mean()
        errors.append(np.sqrt(np.average(off**2, weights=block.mesh.volumes[inside])))
    # A checkerboard would not fall with the size of the cells; a gradient falls in proportion to it.
    np.testing.assert_allclose(np.multiply(jumps, sizes), np.mean(np.multiply(jumps, sizes)), rtol=0.15)
    assert jumps[-1] < 0.05
    assert errors[1] < 0.5 * errors[0] < 0.05


def test_a_fall_is_recorded_and_checked(tmp_path):
    """A soft block falls on a plane; the check computes the energy of patches on its own."""
    body = sp.Body(
        "block",
        sp.shapes.box((0.2, 0.2, 0.2), (3, 3, 3)),
        sp.StableNeoHookean(youngs=2e4, poisson=0.48, density=1000, damping=0.01, integration="patches"),
        position=(0, 0.15, 0),
    )
    scene = sp.Scene([body], obstacles=[sp.HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5)])
    path = tmp_path / "fall.vtkhdf"
    solver = Implicit()
    for _ in sp.simulate(scene, solver, 1 / 60, 20, sinks=[sp.Recorder(path, solver=solver)]):
        pass
    report = sp.check_recording(path)
    assert report.ok, report
    assert str(report["records"].verdict) == "pass"


def test_xpbd_refuses_patches():
    scene = sp.Scene([sp.Body("cube", sp.shapes.box((1, 1, 1), (1, 1, 1)), rubber(0.4))])
    with pytest.raises(SolverError, match="body 'cube' has integration='patches', which XPBD cannot simulate; give"):
        list(sp.simulate(scene, sp.XPBD(), 0.01, 1))


@pytest.mark.parametrize("integrator", ["backward_euler", "newmark"])
def test_a_free_body_keeps_its_momenta(integrator):
    """A stretched block that flies and turns; the midpoint rule keeps angular momentum, both keep the linear one."""
    mesh = sp.shapes.box((0.3, 0.2, 0.2), (3, 2, 2))
    body = sp.Body("block", mesh, sp.StableNeoHookean(youngs=1e4, poisson=0.48, integration="patches"))
    scene = sp.Scene([body], gravity=(0, 0, 0))
    spin = np.cross([1.0, 2.0, 3.0], mesh.vertices) + np.array([0.5, 0.0, 0.0])
    frames = list(
        sp.simulate(
            scene,
            Implicit(integrator=integrator, contact=None),
            1 / 120,
            20,
            initial_positions={"block": mesh.vertices * [1.1, 0.95, 0.97]},
            initial_velocities={"block": spin},
        )
    )
    first, last = frames[0].report, frames[-1].report
    assert last.status == "converged"
    np.testing.assert_allclose(last.linear_momentum, first.linear_momentum, atol=1e-10)
    if integrator == "newmark":
        size = np.linalg.norm(first.angular_momentum)
        np.testing.assert_allclose(last.angular_momentum, first.angular_momentum, atol=1e-9 * size)
        begin, end = (r.kinetic_energy + r.elastic_energy for r in (first, last))
        assert end == pytest.approx(begin, rel=0.03)
