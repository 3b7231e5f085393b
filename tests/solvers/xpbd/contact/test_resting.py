"""What rests: it keeps a distance, friction holds it, and light bodies carry heavy ones."""

import numpy as np
import pytest

import supple as sp
from supple.solvers.xpbd.solver import XPBD

STUFF = sp.StableNeoHookean(youngs=2e5, poisson=0.4, density=1000, damping=0.01)


def box(name, size, divisions, position, material=STUFF, **more):
    return sp.Body(name, sp.shapes.box(size, divisions), material, position=position, friction=0.6, **more)


def floors():
    sheet = sp.SurfaceMesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])
    yield "plane", sp.HalfSpace(friction=0.6)
    yield "box", sp.obstacles.Box(center=(0, -0.5, 0), size=(1, 1, 1), friction=0.6)
    yield "room", sp.obstacles.Box(center=(0, 0.5, 0), size=(0.4, 1, 0.4), inside=True, friction=0.6)
    yield "bowl", sp.obstacles.Sphere(center=(0, 0.4, 0), radius=0.4, inside=True, friction=0.6)
    yield "sheet", sp.obstacles.TriangleObstacle(sheet, friction=0.6)


@pytest.mark.parametrize(("name", "floor"), list(floors()), ids=[name for name, _ in floors()])
def test_resting_contact_passes_the_checks_of_contact(tmp_path, name, floor):
    """A turned box on a box on a floor: faces on faces, crossing edges, corners and planes."""
    low = box("low", (0.2, 0.06, 0.2), (3, 1, 3), (0, 0.1 if name == "bowl" else 0.035, 0))
    above = 0.185 if name == "bowl" else 0.105
    high = box("high", (0.12, 0.06, 0.12), (2, 1, 2), (0.01, above, 0), rotation=(0, 0.5, 0))
    path = tmp_path / "rest.vtkhdf"
    scene = sp.Scene([low, high], [floor])
    solver = XPBD(substeps=20)
    *_, frame = sp.simulate(scene, solver, 1 / 60, 16, sinks=[sp.Recorder(path, solver=solver)])
    report = sp.check_recording(path, only=["intersection", "containment", "distance"])
    assert {result.name: result.verdict for result in report.results if result.verdict == "fail"} == {}
    assert frame.positions["high"][:, 1].mean() > frame.positions["low"][:, 1].mean() + 0.055


def test_friction_holds_a_stack_on_a_slope():
    """Five flat boxes at 20 degrees: they settle elastically, and then nothing slips."""
    slope = np.radians(20.0)
    normal = np.array([np.sin(slope), np.cos(slope), 0.0])
    down = np.array([np.cos(slope), -np.sin(slope), 0.0])
    stuff = sp.StableNeoHookean(youngs=1e6, poisson=0.3, density=1000, damping=0.02)
    turn = (0, 0, -slope)
    bodies = [
        sp.Body(f"b{k}", sp.shapes.box((0.3, 0.04, 0.3), (2, 1, 2)), stuff, position=(0.02 + 0.048 * k) * normal,
                rotation=turn, friction=1.0)
        for k in range(5)
    ]  # fmt: skip
    scene = sp.Scene(bodies, [sp.HalfSpace(normal=normal, friction=1.0)])
    frames = sp.simulate(scene, XPBD(substeps=20), 1 / 60, 120)
    travel = np.array([[frame.positions[body.name].mean(axis=0) @ down for body in bodies] for frame in frames])
    assert np.ptp(travel[-60:], axis=0).max() < 1e-4
    assert np.abs(travel[-1] - travel[0]).max() < 0.02


@pytest.mark.parametrize(("ratio", "substeps"), [(200, 200), pytest.param(1000, 400, marks=pytest.mark.slow)])
def test_a_light_box_carries_a_heavy_one_without_a_gain_of_energy(ratio, substeps):
    heavy = sp.StableNeoHookean(youngs=1e6 * max(1.0, ratio / 200), poisson=0.4, density=1000.0 * ratio)
    light = sp.StableNeoHookean(youngs=1e6 * max(1.0, ratio / 200), poisson=0.4, density=1000.0)
    scene = sp.Scene(
        [
            box("light", (0.1, 0.1, 0.1), (3, 3, 3), (0, 0.051, 0), light),
            box("heavy", (0.1, 0.1, 0.1), (3, 3, 3), (0.003, 0.163, 0.002), heavy, rotation=(0, 0.1, 0)),
        ],
        [sp.HalfSpace(friction=0.5)],
    )
    energies = []
    for frame in sp.simulate(scene, XPBD(substeps=substeps), 1 / 60, 30):
        r = frame.report
        energies.append(r.kinetic_energy + r.elastic_energy + r.potential_energy)
        assert frame.positions["heavy"][:, 1].min() > frame.positions["light"][:, 1].min() + 0.01
        assert r.min_det_F > 0.3
    fall = ratio * 9.81 * 0.01
    assert max(energies) - energies[0] < 0.02 * fall


@pytest.mark.slow
def test_ten_boxes_stand_on_each_other():
    """Each is shorter by its mean pressure over the modulus, and keeps the gap that it began with."""
    stuff = sp.StableNeoHookean(youngs=1e6, poisson=0.3, density=1000.0, damping=0.005)
    starts = 0.0503 + 0.1005 * np.arange(10)
    bodies = [box(f"{k}", (0.1, 0.1, 0.1), (2, 2, 2), (0, y, 0), stuff) for k, y in enumerate(starts)]
    *_, last = sp.simulate(sp.Scene(bodies, [sp.HalfSpace(friction=0.5)]), XPBD(substeps=60), 1 / 60, 40)
    centers = np.array([last.positions[body.name].mean(axis=0) for body in bodies])
    strains = 9.81e-4 * (9.5 - np.arange(10))
    np.testing.assert_allclose(centers[:, 1], starts - 0.1 * (np.cumsum(strains) - 0.5 * strains), atol=8e-4)
    assert np.abs(centers[:, [0, 2]]).max() < 0.006
