"""The energy of bodies, and the balance of energy of frames: only energy without a source is found."""

import numpy as np
import pytest

import supple as sp
from supple.model.diagnostics import measure
from supple.model.state import State
from supple.model.system import build_system, initial_state
from supple.runtime.threads import numba_threads
from supple.solvers.xpbd.assessment.elastic_energy import ElasticEnergy
from supple.solvers.xpbd.solver import XPBD

DT = 1.0 / 60.0
JELLY = sp.StableNeoHookean(youngs=1e4, poisson=0.4, density=1000)
CLASSIC = sp.EdgesAndVolume(edge_compliance=1e-3, volume_compliance=1e-7, density=1000)
BOX = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))


def two_bodies():
    return sp.Scene([sp.Body("jelly", BOX, JELLY), sp.Body("classic", BOX, CLASSIC, position=(0.3, 0, 0))])


def test_the_energy_of_each_body_is_that_of_its_material():
    system = build_system(two_bodies())
    start = initial_state(two_bodies())
    x = start.positions + 0.02 * np.random.default_rng(3).normal(size=start.positions.shape)
    bodies = ElasticEnergy(system).of(x)
    assert bodies.sum() == pytest.approx(measure(system, State(0.0, x, start.velocities)).elastic_energy, rel=1e-12)
    assert (bodies > 0.0).all()
    with numba_threads(1):
        np.testing.assert_array_equal(bodies, ElasticEnergy(system).of(x))


def test_the_energy_of_the_elements_at_some_vertices_changes_as_all_energy_does_when_these_move():
    system = build_system(two_bodies())
    x = initial_state(two_bodies()).positions
    chosen = np.zeros(len(x), dtype=bool)
    chosen[[3, 40]] = True
    moved = x.copy()
    moved[chosen] += 0.01
    some, everything = ElasticEnergy(system, chosen), ElasticEnergy(system)
    np.testing.assert_allclose(some.of(moved) - some.of(x), everything.of(moved) - everything.of(x), rtol=1e-9)


def test_a_hard_constraint_gives_out_the_energy_of_its_projection():
    """An edge, hard and too long by C: one projection moves its ends with the velocities that C / h gives."""
    tet = sp.TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    hard = sp.EdgesAndVolume(edge_compliance=0.0, volume_compliance=1.0, density=24.0)
    system = build_system(sp.Scene([sp.Body("tet", tet, hard)]))
    x = np.asarray(tet.vertices, dtype=np.float64).copy()
    x[1, 0] += 1e-3
    energy = ElasticEnergy(system)
    assert energy.has_hard
    h, m = 0.01, system.masses[0]
    lengths = [
        np.linalg.norm(x[i] - x[j]) - rest for (i, j), rest in zip(system.edges, system.rest_lengths, strict=True)
    ]
    expected = sum(0.5 * c**2 / (h**2 * 2.0 / m) for c in lengths)
    given = energy.of(x, h)[0] - energy.of(x)[0]
    assert given == pytest.approx(expected, rel=1e-9)


HELD = {"vertices": np.flatnonzero(BOX.vertices[:, 0] < -0.049)}
TIP = np.flatnonzero(BOX.vertices[:, 0] > 0.049)


@pytest.mark.parametrize("material", [JELLY, CLASSIC], ids=["neo-hookean", "edges+volume"])
@pytest.mark.parametrize("load", ["force", "soft target", "pin", "obstacle", "stitched obstacle"])
def test_the_work_of_loads_pins_and_obstacles_that_move_is_not_from_nowhere(material, load):
    body = sp.Body("box", BOX, material)
    more = {}
    if load == "force":
        more = {"forces": [sp.Force("box", TIP, lambda t: (0.0, 0.5 * np.sin(20 * t), 0.0))]}
    elif load == "soft target":
        shake = sp.Keyframes(times=[0, 0.2, 0.4, 1], displacements=[[0, 0, 0], [0.2, 0, 0], [0, 0.1, 0], [0, 0, 0]])
        more = {"soft_targets": [sp.SoftTarget("box", TIP, stiffness=5.0, motion=shake)]}
    elif load == "obstacle":
        push = sp.Keyframes(times=[0, 0.3, 1], displacements=[[0, 0, 0], [0.05, 0, 0], [-0.1, 0, 0]])
        more = {"obstacles": [sp.HalfSpace(point=(-0.06, 0, 0), normal=(1, 0, 0), motion=push)]}
    elif load == "stitched obstacle":
        pull = sp.Keyframes(times=[0, 0.3, 1], displacements=[[0, 0, 0], [0.05, 0, 0], [-0.1, 0.1, 0]])
        plate = sp.SurfaceMesh([[-0.051, y, z] for y in (-0.05, 0.05) for z in (-0.05, 0.05)], [[0, 1, 2], [3, 2, 1]])
        stitch = sp.VertexVertexStitch("box", "plate", max_distance=0.003, stiffness=100.0)
        more = {"obstacles": [sp.obstacles.TriangleObstacle(plate, name="plate", motion=pull)], "stitches": [stitch]}
    turn = sp.Keyframes(times=[0.0, 0.5, 1.0], angles=[0.0, 1.5, 0.0], axis=(0, 0, 1))
    pins = [sp.Pin("box", motion=turn if load == "pin" else None, **HELD)] if not load.endswith("obstacle") else []
    scene = sp.Scene([body], pins=pins, gravity=(0, -5, 0) if pins else (0, 0, 0), **more)
    assert {str(frame.report.status) for frame in sp.simulate(scene, XPBD(), DT, 40)} == {"converged"}


@pytest.mark.parametrize("material", [JELLY, sp.EdgesAndVolume()], ids=["neo-hookean", "hard"])
def test_pins_lift_what_is_stitched_to_their_body(material):
    """All of the lower box moves up by 0.1 m in a second, and the upper one hangs on it."""
    bodies = [sp.Body("low", BOX, material), sp.Body("high", BOX, JELLY, position=(0, 0.101, 0))]
    stitch = sp.VertexVertexStitch("high", "low", max_distance=0.002, stiffness=200.0)
    rise = sp.Keyframes(times=[0.0, 1.0], displacements=[[0, 0, 0], [0, 0.1, 0]])
    pin = sp.Pin("low", np.arange(len(BOX.vertices)), motion=rise)
    work = 0.0
    for frame in sp.simulate(sp.Scene(bodies, pins=[pin], stitches=[stitch]), XPBD(), DT, 60):
        assert frame.report.status == "converged"
        work += frame.report.work["pins"]
    assert work == pytest.approx(2.0 * 9.81 * 0.1, rel=0.05)


@pytest.mark.parametrize("slides", [False, True])
def test_energy_from_nowhere_is_found_and_named(caplog, slides):
    """A ball that is far too stiff for its substeps leaves the floor faster than it came, also where this moves."""
    ball = sp.Body(
        "ball", sp.shapes.sphere(radius=0.02, edge_length=0.006),
        sp.StableNeoHookean(youngs=5e5, poisson=0.4), position=(0, 0.1, 0),
    )  # fmt: skip
    floor = sp.HalfSpace(motion=(lambda t: (t, 0.0, 0.0)) if slides else None)
    frames = list(sp.simulate(sp.Scene([ball], [floor]), XPBD(substeps=10), DT, 20))
    bad = [frame for frame in frames if frame.report.status == "energy_gained"]
    assert bad
    assert "of the energy has no source, most of it in body 'ball'" in bad[0].report.message
    assert bad[0].report.details.energy_gained > 0.02
    energies = [f.report.kinetic_energy + f.report.elastic_energy + f.report.potential_energy for f in frames]
    assert max(energies) > 1.02 * energies[0]
    assert "20 of 20 frames did not converge; first of each kind: softened" in caplog.text
    assert "energy_gained: " in caplog.text


def test_free_oscillation_and_spin_gain_nothing():
    start = {"jelly": BOX.vertices * [1.3, 0.8, 0.9]}
    body = sp.Body("jelly", BOX, JELLY, angular_velocity=(3, 5, 1))
    for frame in sp.simulate(sp.Scene([body], gravity=(0, 0, 0)), XPBD(), DT, 60, initial_positions=start):
        assert frame.report.status == "converged"
        assert frame.report.details.energy_gained < 0.02
