"""What contact by rows does: momentum, energy, friction, stacks, heavy on light."""

from __future__ import annotations

import numpy as np
import pytest

import supple as sp
from supple.mesh import shapes
from supple.solvers.xpbd.assessment.surfaces import SurfaceCheck, crossings
from supple.solvers.xpbd.contact.search.surface import mean_edge_length

pytestmark = pytest.mark.slow  # of a trial beside the package
SLOPE = np.arctan(0.5)


def material(youngs: float = 1e6, density: float = 1000.0, damping: float = 0.005) -> sp.StableNeoHookean:
    return sp.StableNeoHookean(youngs=youngs, poisson=0.3, density=density, damping=damping)


def crossing(frame: sp.Frame, scene: sp.Scene) -> int:
    system = frame.system
    check = SurfaceCheck(system, sp.XPBD().contact, mean_edge_length(system))
    return crossings(check.find(np.ascontiguousarray(frame.state.positions), frame.time))


@pytest.mark.parametrize(("speed", "substeps"), [(2.0, 40), (10.0, 60)])
def test_an_impact_keeps_linear_momentum_and_gains_no_energy(speed: float, substeps: int) -> None:
    ball = shapes.sphere(0.05, 0.02)
    soft = sp.StableNeoHookean(youngs=3e4, poisson=0.45, density=1000.0)
    scene = sp.Scene(
        bodies=[
            sp.Body("left", ball, soft, position=(-0.07, 0, 0), velocity=(speed, 0, 0), friction=0.6),
            sp.Body("right", ball, soft, position=(0.07, 0.03, 0.01), velocity=(-speed, 0, 0), friction=0.6),
        ],
        gravity=(0, 0, 0),
    )
    frames = list(sp.simulate(scene, sp.XPBD(substeps=substeps), dt=1 / 60, steps=12))
    momenta = np.array([frame.report.linear_momentum for frame in frames])
    spins = np.array([frame.report.angular_momentum for frame in frames])
    mass = float(frames[0].system.masses.sum())
    energies = [frame.report.kinetic_energy + frame.report.elastic_energy for frame in frames]
    assert np.abs(momenta - momenta[0]).max() <= 1e-11 * mass * speed
    # Positions that are cut change the arms of the momenta, which is of second order in the substep.
    assert np.abs(spins - spins[0]).max() <= 0.05 * np.abs(spins[0]).max()
    assert np.diff(energies).max() <= 1e-6 * energies[0]
    assert energies[-1] > 0.02 * energies[0]
    assert not any(crossing(frame, scene) for frame in frames)


@pytest.mark.parametrize("mu", [0.4, 0.52])
def test_a_block_slides_on_a_slope_as_coulomb_says(mu: float) -> None:
    n = np.array([-np.sin(SLOPE), np.cos(SLOPE), 0.0])
    block = sp.Body(
        "block", shapes.box((0.2, 0.1, 0.2), (6, 3, 6)), material(), position=0.0502 * n, rotation=(0, 0, SLOPE)
    )
    scene = sp.Scene(bodies=[block], obstacles=[sp.HalfSpace(name="slope", normal=tuple(n), friction=mu)])
    frames = list(sp.simulate(scene, sp.XPBD(substeps=40), dt=1 / 60, steps=30))
    down = -np.array([np.cos(SLOPE), np.sin(SLOPE), 0.0])
    way = np.array([frame.positions["block"].mean(axis=0) @ down for frame in frames])
    times = np.array([frame.time for frame in frames])
    acceleration = 2.0 * np.polyfit(times[10:], way[10:], 2)[0]
    expected = max(0.0, 9.81 * (np.sin(SLOPE) - mu * np.cos(SLOPE)))
    assert acceleration == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize(
    ("ratio", "youngs", "substeps"), [(1.0, 1e6, 40), (150.0, 1e7, 200)], ids=["equal", "150_to_1"]
)
def test_a_stack_stands(ratio: float, youngs: float, substeps: int) -> None:
    box = shapes.box((0.1, 0.1, 0.1), (3, 3, 3))
    bodies = [
        sp.Body("light", box, material(youngs), position=(0, 0.0503, 0), friction=0.5),
        sp.Body("heavy", box, material(youngs, 1000.0 * ratio), position=(0, 0.1507, 0), rotation=(0, 0.3, 0)),
    ]
    scene = sp.Scene(bodies=bodies, obstacles=[sp.HalfSpace(name="floor", friction=0.5)])
    *_, last = sp.simulate(scene, sp.XPBD(substeps=substeps), dt=1 / 60, steps=30)
    heights = [float(last.positions[name][:, 1].mean()) for name in ("light", "heavy")]
    # Pressure of the heavy box over the modulus: 15 mm of 0.1 m at most.
    assert heights == pytest.approx([0.05, 0.15], abs=0.004)
    assert np.abs(last.velocities["heavy"]).max() < 0.05
    assert not crossing(last, scene)
    assert last.report.min_det_F > 0.5
    assert 0.0 < last.report.details.contact_residual < 0.02


def test_ten_boxes_stand_on_each_other() -> None:
    box = shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
    bodies = [
        sp.Body(f"box{k}", box, material(), position=(0, 0.0503 + 0.1005 * k, 0), friction=0.5) for k in range(10)
    ]
    scene = sp.Scene(bodies=bodies, obstacles=[sp.HalfSpace(name="floor", friction=0.5)])
    *_, last = sp.simulate(scene, sp.XPBD(substeps=60), dt=1 / 60, steps=40)
    centers = np.array([last.positions[f"box{k}"].mean(axis=0) for k in range(10)])
    # Each box is shorter by its mean pressure over the modulus, and keeps the gap that it began with.
    strains = 9.81e-4 * (9.5 - np.arange(10))
    expected = 0.0503 + 0.1005 * np.arange(10) - 0.1 * (np.cumsum(strains) - 0.5 * strains)
    np.testing.assert_allclose(centers[:, 1], expected, atol=8e-4)
    assert np.abs(centers[:, [0, 2]]).max() < 0.006
    assert not crossing(last, scene)


def test_a_box_rides_on_an_obstacle_that_moves() -> None:
    lift = sp.obstacles.Box(
        name="lift",
        center=(0, -0.05, 0),
        size=(0.4, 0.1, 0.4),
        friction=0.6,
        motion=lambda t: (0.05 * np.sin(4.0 * t), 0.1 * t, 0.0),
    )
    body = sp.Body("box", shapes.box((0.1, 0.1, 0.1), (3, 3, 3)), material(1e5), position=(0, 0.0505, 0), friction=0.6)
    scene = sp.Scene(bodies=[body], obstacles=[lift])
    *_, last = sp.simulate(scene, sp.XPBD(substeps=40), dt=1 / 60, steps=40)
    center = last.positions["box"].mean(axis=0)
    assert center[0] == pytest.approx(0.05 * np.sin(4.0 * last.time), abs=0.003)
    assert center[1] == pytest.approx(0.05 + 0.1 * last.time, abs=0.003)
    assert not crossing(last, scene)


def test_random_piles_never_cross() -> None:
    generator = np.random.default_rng(11)
    for _ in range(3):
        size = float(np.exp(generator.uniform(np.log(0.02), np.log(0.2))))
        bodies = []
        for k in range(3):
            mesh = (shapes.box((size, size, size), (2, 2, 2)), shapes.sphere(0.5 * size, 0.4 * size))[k % 2]
            bodies.append(
                sp.Body(
                    f"body{k}",
                    mesh,
                    sp.StableNeoHookean(youngs=float(generator.uniform(3e4, 3e5)), poisson=0.4, density=1000.0),
                    position=(*generator.uniform(-0.1, 0.1, 2) * size, 0) @ np.eye(3)[[0, 2, 1]]
                    + np.array([0.0, size * (1.0 + 1.8 * k), 0.0]),
                    rotation=generator.normal(scale=1.0, size=3),
                    velocity=(0, -generator.uniform(0.5, 3.0), 0),
                    friction=0.4,
                )
            )
        scene = sp.Scene(bodies=bodies, obstacles=[sp.HalfSpace(name="floor", friction=0.4)])
        for frame in sp.simulate(scene, sp.XPBD(accuracy=0.1), dt=1 / 60, steps=15):
            assert not crossing(frame, scene)
            assert frame.report.min_det_F > 0.0


def test_rigid_boxes_stand_and_slide():
    tower = [
        sp.RigidBody(
            f"box{k}",
            shapes.box_surface((0.1, 0.1, 0.1), (2, 2, 2)),
            density=1000.0,
            position=(0.002 * k, 0.051 + 0.102 * k, 0),
            friction=0.5,
        )
        for k in range(4)
    ]
    *_, last = sp.simulate(sp.Scene(tower, obstacles=[sp.HalfSpace(friction=0.5)]), sp.XPBD(substeps=20), 1 / 60, 40)
    assert last.report.kinetic_energy < 1e-4
    centers = np.array([last.positions[body.name].mean(axis=0) for body in tower])
    assert np.abs(centers[:, [0, 2]] - [[0.002 * k, 0.0] for k in range(4)]).max() < 3e-4
    normal = np.array([-np.sin(0.4), np.cos(0.4), 0.0])
    slope = sp.HalfSpace(point=(0, 0, 0), normal=normal, friction=0.3)
    box = sp.RigidBody(
        "box",
        shapes.box_surface((0.1, 0.1, 0.1), (2, 2, 2)),
        density=1000.0,
        position=0.0501 * normal,
        rotation=(0, 0, 0.4),
        friction=0.3,
    )
    *_, last = sp.simulate(sp.Scene([box], obstacles=[slope]), sp.XPBD(substeps=20), 1 / 60, 60)
    way = np.linalg.norm(last.positions["box"].mean(axis=0) - 0.05 * normal)
    assert way == pytest.approx(0.5 * 9.81 * (np.sin(0.4) - 0.3 * np.cos(0.4)), rel=0.02)
