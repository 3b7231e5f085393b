"""No tet turns over: the projections of the guard, its last resort, and whole simulations."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.model.system import build_system, initial_state
from supple.numerics.noninverting_step import volume_signs
from supple.runtime.threads import numba_threads
from supple.solvers.xpbd.constraints.volume_guard import ONSET, VolumeGuard
from supple.solvers.xpbd.rigid_fallback import RigidFallback, united
from supple.solvers.xpbd.solver import XPBD

DT = 1.0 / 60.0
JELLY = sp.StableNeoHookean(youngs=5e3, poisson=0.4, density=1000)
CLASSIC = sp.EdgesAndVolume(edge_compliance=0.05, volume_compliance=1e-6, density=1000)
CUBE = sp.shapes.box((0.1, 0.1, 0.1), (3, 3, 3))
MATERIALS = pytest.mark.parametrize("material", [JELLY, CLASSIC], ids=["neo-hookean", "edges+volume"])


def guarded(system, points):
    guard = VolumeGuard(system)
    guard.measure(points)
    guard.guarded[:] = True
    guard.accept()
    return guard


def points_of(system, x):
    return np.ascontiguousarray(np.column_stack([x, system.inverse_masses]))


def test_projections_end_a_compression_at_the_bound_and_take_kinetic_energy():
    """A cube is compressed to a tenth in one substep: afterwards no tet is below its bound, and it moves slower."""
    system = build_system(sp.Scene([sp.Body("cube", CUBE, JELLY)]))
    before = points_of(system, system.rest_positions)
    guard = guarded(system, before)
    np.testing.assert_allclose(guard.bounds, 0.5)
    x = before.copy()
    x[:, 1] *= 0.1
    x[:, 0] += 0.02
    m = system.masses
    motion, momentum = x[:, :3] - before[:, :3], m @ x[:, :3]
    for _ in range(200):
        if not guard.measure(x):
            break
        guard.project(x)
    assert guard.J.min() > 0.5 - 1e-12
    assert not guard.failures().any()
    np.testing.assert_allclose(m @ x[:, :3], momentum, atol=1e-15)
    assert m @ ((x[:, :3] - before[:, :3]) ** 2).sum(axis=1) < m @ (motion**2).sum(axis=1)


def test_a_tet_below_the_onset_may_not_be_compressed_more_and_is_not_pushed_back():
    system = build_system(sp.Scene([sp.Body("cube", CUBE, JELLY)]))
    flat = system.rest_positions * [1.0, 0.1, 1.0]
    guard = guarded(system, points_of(system, flat))
    assert ONSET > 0.1
    np.testing.assert_allclose(guard.bounds, 0.1, rtol=1e-9)
    x = points_of(system, flat)
    guard.project(x)
    np.testing.assert_allclose(x[:, :3], flat, atol=1e-15)


def test_the_numbers_do_not_depend_on_threads_and_nan_fails():
    system = build_system(sp.Scene([sp.Body("cube", sp.shapes.box((1, 1, 1), (8, 8, 8)), JELLY)]))
    x = points_of(
        system, system.rest_positions + 0.02 * np.random.default_rng(1).normal(size=system.rest_positions.shape)
    )
    with numba_threads(1):
        guard = guarded(system, x)
    one = guard.J.copy()
    guard.measure(x)
    np.testing.assert_array_equal(guard.J, one)
    x[5] = np.nan
    guard.measure(x)
    assert guard.failures().any()


@pytest.mark.parametrize("pinned", [False, True])
def test_the_last_resort_leaves_every_tet_positive_from_any_motion(pinned):
    pins = [sp.Pin("cube", vertices=[0, 1, 2])] if pinned else []
    system = build_system(sp.Scene([sp.Body("cube", CUBE, JELLY)], pins=pins))
    generator, rest = np.random.default_rng(5), system.rest_positions
    for size in (0.01, 1.0, 1e3):
        motion = size * generator.normal(size=system.rest_positions.shape) + [size, 0, 0]
        motion[system.pinned_vertices] = 0.0
        points, velocities = points_of(system, system.rest_positions + motion), motion / 1e-3
        momenta = momenta_of(system, rest, velocities)
        bounds = np.full(len(system.tets), 0.5)
        RigidFallback(system, 0.0).apply(
            points, velocities, rest.copy(), rest, np.zeros_like(rest), 1e-3, bounds, 1e-3, [[0]]
        )
        assert (volume_signs(np.ascontiguousarray(points[:, :3]), system.tets) > 0.0).all()
        if not pinned:
            np.testing.assert_allclose(momenta_of(system, rest, velocities), momenta, atol=1e-9 * abs(momenta).max())


def test_bodies_that_are_stopped_together_keep_both_momenta_and_the_third_moves_on():
    material = sp.StableNeoHookean(youngs=1e4, poisson=0.4)
    places = [(0, 0, 0), (0.06, 0.01, 0), (1, 0, 0)]
    bodies = [sp.Body(f"cube {k}", CUBE, material, position=place) for k, place in enumerate(places)]
    system = build_system(sp.Scene(bodies))
    fallback, rest = RigidFallback(system, 0.0), system.rest_positions
    velocities = np.repeat([[3.0, 1, 0], [-2, 0, 1], [0, 5, 0]], len(CUBE.vertices), axis=0)
    velocities += np.random.default_rng(3).normal(size=rest.shape)
    origins = np.round(rest)  # another one for the third body
    begun, h = rest - origins, 1e-3
    old, points = velocities.copy(), points_of(system, begun + h * velocities)
    labels = [fallback.labels[part.vertices.start] for part in system.bodies]
    bounds = np.full(len(system.tets), -np.inf)
    fallback.apply(points, velocities, begun.copy(), begun, origins, h, bounds, h, [labels[:2]], 0.0)
    two = slice(0, 2 * len(CUBE.vertices))
    now, before = momenta_of(system, rest, velocities), momenta_of(system, rest, old)
    np.testing.assert_allclose(now, before, atol=1e-12 * abs(before).max())
    np.testing.assert_array_equal(velocities[two.stop :], old[two.stop :])
    # One rigid motion: what is in touch must remain as near as it is, to round-off.
    x, x0 = points[two, :3], begun[two]
    lengths = np.linalg.norm(x[:, None] - x, axis=2) - np.linalg.norm(x0[:, None] - x0, axis=2)
    assert abs(lengths).max() < 1e-15
    np.testing.assert_allclose(x, x0 + h * velocities[two], atol=1e-2 * h * abs(velocities).max())
    assert np.sum(system.masses[:, None] * velocities**2) < np.sum(system.masses[:, None] * old**2)


def momenta_of(system, x, v):
    m = system.masses[:, None]
    return np.concatenate([(m * v).sum(axis=0), (m * np.cross(x, v)).sum(axis=0)])


def test_groups_that_share_a_member_become_one():
    assert united([{1, 2}, {5}], [[2, 3], [7, 8]]) == [{1, 2, 3}, {5}, {7, 8}]
    assert united([{1, 2}, {3}], [[2, 3], [-1, 9]]) == [{-1, 9}, {1, 2, 3}]


@MATERIALS
@pytest.mark.parametrize(("speed", "substeps"), [(6.0, 20), (10.0, "auto"), (20.0, 20), (40.0, 2), (3.0, 1)])
def test_a_soft_body_that_hits_the_floor_keeps_every_tet_positive_and_gains_nothing(material, speed, substeps):
    body = sp.Body("cube", CUBE, material, position=(0, 0.07, 0), rotation=(0, 0, 0.3), velocity=(0, -speed, 0))
    start = None
    for frame in sp.simulate(sp.Scene([body], [sp.HalfSpace(friction=0.5)]), XPBD(substeps=substeps), DT, 30):
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
    assert report.details.held_back == 0
    gained = after.velocities - state.velocities
    np.testing.assert_allclose(gained, np.broadcast_to([0, -9.81 * DT, 0], gained.shape), atol=1e-13)
