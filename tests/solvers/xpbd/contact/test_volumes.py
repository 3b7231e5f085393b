"""No tet turns over: the projections of the guard, and whole simulations."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.xpbd.contact.islands import Islands
from supple.solvers.xpbd.contact.tets import ONSET, Tets, measure, project_low
from supple.solvers.xpbd.solver import XPBD

DT = 1.0 / 60.0
JELLY = sp.StableNeoHookean(youngs=5e3, poisson=0.4, density=1000)
CLASSIC = sp.EdgesAndVolume(edge_compliance=0.05, volume_compliance=1e-6, density=1000)
CUBE = sp.shapes.box((0.1, 0.1, 0.1), (3, 3, 3))
MATERIALS = pytest.mark.parametrize("material", [JELLY, CLASSIC], ids=["neo-hookean", "edges+volume"])


def tets_at(system, points):
    """The tets of a system in a substep that begins at these points, its island, and room for bounds."""
    tets = Tets.of(system, len(points))
    measure(points, tets, False, 1.0)
    tets.J[:] = tets.now
    islands = Islands.of(np.zeros(len(points), np.int32), np.zeros(0, np.int32))
    islands.active[:] = True
    return tets, islands, np.zeros(len(tets.J))


def points_of(system, x):
    return np.ascontiguousarray(np.column_stack([x, system.inverse_masses]))


def test_projections_end_a_compression_at_the_bound_and_take_kinetic_energy():
    """A cube is compressed to a tenth in one substep: afterwards no tet is below its bound, and it moves slower."""
    system = build_system(sp.Scene([sp.Body("cube", CUBE, JELLY)]))
    before = points_of(system, system.rest_positions)
    tets, islands, bounds = tets_at(system, before)
    x = before.copy()
    x[:, 1] *= 0.1
    x[:, 0] += 0.02
    m = system.masses
    motion, momentum = x[:, :3] - before[:, :3], m @ x[:, :3]
    for _ in range(200):
        if not measure(x, tets, True, 1.0):
            break
        project_low(x, tets, islands, bounds)
    np.testing.assert_allclose(bounds, 0.5)
    assert tets.now.min() > 0.5 - 1e-12
    np.testing.assert_allclose(m @ x[:, :3], momentum, atol=1e-15)
    assert m @ ((x[:, :3] - before[:, :3]) ** 2).sum(axis=1) < m @ (motion**2).sum(axis=1)


def test_a_tet_below_the_onset_may_not_be_compressed_more_and_is_not_pushed_back():
    system = build_system(sp.Scene([sp.Body("cube", CUBE, JELLY)]))
    flat = system.rest_positions * [1.0, 0.1, 1.0]
    tets, islands, bounds = tets_at(system, points_of(system, flat))
    assert ONSET > 0.1
    x = points_of(system, flat)
    project_low(x, tets, islands, bounds)
    np.testing.assert_allclose(bounds, 0.1, rtol=1e-9)
    np.testing.assert_allclose(x[:, :3], flat, atol=1e-15)


@MATERIALS
@pytest.mark.parametrize(("speed", "substeps"), [(10.0, "auto"), (20.0, 20), (40.0, 2), (3.0, 1)])
def test_a_soft_body_that_hits_the_floor_keeps_every_tet_positive_and_gains_nothing(material, speed, substeps):
    body = sp.Body("cube", CUBE, material, position=(0, 0.07, 0), rotation=(0, 0, 0.3), velocity=(0, -speed, 0))
    start = None
    for frame in sp.simulate(sp.Scene([body], [sp.HalfSpace(friction=0.5)]), XPBD(substeps=substeps), DT, 15):
        report = frame.report
        energy = report.kinetic_energy + report.elastic_energy + report.potential_energy
        start = start or 0.5 * speed**2 * CUBE.volume * 1000 + 0.07 * 9.81 * CUBE.volume * 1000
        assert report.min_det_F > 0.0
        assert report.status != "inverted"
        assert substeps == 1 or energy < 1.02 * start


@MATERIALS
def test_a_body_between_plates_and_under_a_hammer_keeps_every_tet_positive(material):
    blow = sp.Keyframes(times=[0, 0.02, 0.04, 1], displacements=[[0, 0, 0], [0, -0.07, 0], [0, 0, 0], [0, 0, 0]])
    hammer = sp.obstacles.Box(center=(0, 0.16, 0), size=(0.08, 0.1, 0.08), motion=blow)
    scene = sp.Scene([sp.Body("cube", CUBE, material, position=(0, 0.05, 0))], [sp.HalfSpace(), hammer])
    for frame in sp.simulate(scene, XPBD(), DT, 20):
        assert frame.report.min_det_F > 0.0
        assert np.abs(frame.state.velocities).max() < 40.0


def test_a_body_that_starts_inverted_recovers_and_is_guarded_from_then_on():
    """Its frames are not called inverted, as it began so; once it is sound, a blow does not turn it over again."""
    start = CUBE.vertices * [1.0, -0.5, 1.0]
    stiff = sp.StableNeoHookean(youngs=1e5, poisson=0.4, damping=0.005)
    scene = sp.Scene([sp.Body("cube", CUBE, stiff)], gravity=(0, 0, 0))
    frames = list(sp.simulate(scene, XPBD(contact=None), DT, 60, initial_positions={"cube": start}))
    assert start[:, 1].max() == -0.5 * CUBE.vertices[:, 1].min()  # upside down: every J is -0.5
    assert all(frame.report.status != "inverted" for frame in frames)
    assert frames[-1].report.min_det_F > 0.9
    v = 30.0 * np.random.default_rng(2).normal(size=CUBE.vertices.shape)
    state = replace(frames[-1].state, velocities=v)
    for frame in sp.simulate(scene, XPBD(contact=None, substeps=5), DT, 10, start=state):
        assert frame.report.min_det_F > 0.0


def test_pins_that_turn_tets_over_are_reported():
    """The vertices of one whole tet are pinned, and one of them goes through the opposite face."""
    tet = CUBE.tets[0]
    x = CUBE.vertices[tet]
    through = 2.0 * (x[1:].mean(axis=0) - x[0])
    pins = [
        sp.Pin("cube", vertices=[tet[0]], motion=sp.Keyframes(times=[0, 0.05], displacements=[[0, 0, 0], through])),
        sp.Pin("cube", vertices=tet[1:]),
    ]
    frames = list(sp.simulate(sp.Scene([sp.Body("cube", CUBE, JELLY)], pins=pins), XPBD(), DT, 5))
    assert frames[0].report.min_det_F > 0.0
    assert frames[-1].report.status == "inverted"
    assert "of body 'cube' inverted" in frames[-1].report.message


def test_the_guard_does_not_change_motion_that_compresses_nothing():
    system = build_system(sp.Scene([sp.Body("cube", CUBE, JELLY, velocity=(1, 2, 3))]))
    state = initial_state(system.scene)
    after, report = XPBD(substeps=10).step(system, state, DT, XPBD(substeps=10).prepare(system))
    assert report.details.truncated == 0
    gained = after.velocities - state.velocities
    np.testing.assert_allclose(gained, np.broadcast_to([0, -9.81 * DT, 0], gained.shape), atol=1e-13)
