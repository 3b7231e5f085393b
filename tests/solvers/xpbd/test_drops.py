"""Random drops with defaults: nothing turns over or gains energy, and what is in the floor is reported."""

import numpy as np
import pytest

import supple as sp
from supple.model.crushed import CRUSHED
from supple.solvers.xpbd.solver import XPBD

DT = 1.0 / 60.0


def shape(generator, size, coarse=False):
    kind, edge_length = generator.integers(3), size / (4 if coarse else 5)
    if kind == 0:
        return sp.shapes.box((size, size * generator.uniform(0.4, 1.0), size), (2, 2, 2) if coarse else (3, 3, 3))
    if kind == 1:
        return sp.shapes.sphere(radius=size / 2, edge_length=edge_length)
    return sp.shapes.cylinder(radius=size / 2, height=size, edge_length=edge_length)


def drop(seed, smallest=6e-3, stiffest=2e6):
    """One to three bodies of E = 5e3 to 2e6 Pa and 6 mm to 30 cm, thrown at the floor with up to 12 m/s."""
    generator = np.random.default_rng(seed)
    size = 10 ** generator.uniform(np.log10(smallest), np.log10(0.3))
    speed, bodies, height = generator.uniform(0.0, 12.0), [], 0.0
    for k in range(generator.integers(1, 4)):
        youngs = 10 ** generator.uniform(np.log10(5e3), np.log10(stiffest))
        material = sp.StableNeoHookean(
            youngs=youngs, poisson=generator.uniform(0.0, 0.47), density=10 ** generator.uniform(2.3, 3.7)
        )
        height += size * generator.uniform(1.5, 2.0)
        axis = generator.normal(size=3)
        bodies.append(
            sp.Body(
                f"body {k}",
                shape(generator, size),
                material,
                position=(0, height, 0),
                rotation=axis / np.linalg.norm(axis),
                velocity=(0, -speed, 0),
            )
        )
    return sp.Scene(bodies, [sp.HalfSpace(friction=0.5)])


def is_as_told(report):
    """A blow may crush a tet, sooner of a body too soft for its weight, which is told; nothing else may happen."""
    J = report.min_det_F
    return (report.status == "converged" and J >= CRUSHED) or (report.status == "crushed" and J < 5 * CRUSHED)


def check(scene, steps, most=0.02):
    start = first_energy(scene)
    for frame in sp.simulate(scene, XPBD(), DT, steps):
        report = frame.report
        assert report.min_det_F > 0.0
        assert is_as_told(report), report.message
        energy = report.kinetic_energy + report.elastic_energy + report.potential_energy
        assert energy < (1.0 + most) * start
        assert min(x[:, 1].min() for x in frame.positions.values()) > -1e-3 * np.ptp(frame.state.positions)


def first_energy(scene):
    total = 0.0
    for body in scene.bodies:
        mass = body.mesh.volume * float(body.material.density)
        total += mass * (0.5 * float(np.dot(body.velocity, body.velocity)) + 9.81 * float(body.position[1]))
    return total


def pile(seed):
    """Two to five bodies of E = 1e3 to 1e9 Pa, 1 mm to 1 m and densities up to 200:1, at up to 20 m/s.

    Materials that cannot carry their own weight, or stop from this speed, are stiffened.
    """
    generator = np.random.default_rng(seed)
    size = 10 ** generator.uniform(-3.0, 0.0)
    speed = generator.uniform(0.0, 20.0) if generator.uniform() < 0.7 else 0.0
    stiffness, light = 10 ** generator.uniform(3.0, 9.0), 10 ** generator.uniform(1.7, 2.7)
    bodies, height = [], 0.0
    for k in range(generator.integers(2, 6)):
        density = light * 200 ** generator.uniform(0.0, 1.0)
        youngs = np.clip(stiffness * 10 ** generator.uniform(-0.7, 0.7), 1e3, 1e9)
        material = sp.StableNeoHookean(
            youngs=max(youngs, density * (speed**2 + 20 * 9.81 * size)),
            poisson=generator.uniform(0.0, 0.47),
            density=density,
            damping=generator.choice([0.0, 0.01]),
        )
        height += size * (generator.uniform(1.5, 1.9) if k else 0.9)
        axis = generator.normal(size=3)
        sideways = size * 0.15 * generator.normal(size=2)
        bodies.append(
            sp.Body(
                f"body {k}",
                shape(generator, size, coarse=True),
                material,
                position=(sideways[0], height, sideways[1]),
                rotation=axis / np.linalg.norm(axis) * generator.uniform(0.0, 2.0),
                velocity=speed * np.array([0.2 * generator.normal(), -1.0, 0.2 * generator.normal()]),
                friction=generator.uniform(0.0, 1.0),
            )
        )
    return sp.Scene(bodies, [sp.HalfSpace(friction=generator.uniform(0.0, 1.0))])


def check_recorded(scene, path, steps, any_status=False):
    """What a frame claims is true: an independent check passes where all frames are converged. Returns the statuses."""
    statuses, start = set(), first_energy(scene)
    for frame in sp.simulate(scene, XPBD(), DT, steps, sinks=[sp.Recorder(path)]):
        report = frame.report
        statuses.add(str(report.status))
        assert any_status or is_as_told(report), report.message
        assert report.min_det_F > 0.0
        energy = report.kinetic_energy + report.elastic_energy + report.potential_energy
        # Impacts of stiff small bodies at the cap of the substeps may gain energy.
        assert energy < 1.05 * start or report.status == "energy_gained"
        heights = [x[:, 1].mean() for x in frame.positions.values()]
        assert min(heights) > 0.0
    assert sp.check_recording(path).ok or statuses != {"converged"}
    return statuses


@pytest.mark.parametrize(
    "seed", [0, 1, 3, pytest.param(2, marks=pytest.mark.slow), pytest.param(6, marks=pytest.mark.slow)]
)
def test_random_drops(seed):
    check(drop(seed, smallest=0.04, stiffest=2e5), 25)


@pytest.mark.parametrize(
    "seed", [1, 4, 5, 10, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (6, 8, 13, 15))]
)
def test_random_piles_converge_and_pass_the_check(seed, tmp_path):
    assert check_recorded(pile(seed), tmp_path / "pile.vtkhdf", 12) == {"converged"}


@pytest.mark.parametrize("seed", [104, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (23, 70, 131))])
def test_bodies_between_others_and_a_floor_are_not_pushed_through_either(seed, tmp_path):
    """Contact with other bodies moved them into the floor, contact with the floor or the last resort through bodies."""
    check_recorded(pile(seed), tmp_path / "pile.vtkhdf", 8)


# Their materials need 3 to 206 times as many substeps as `max_substeps`. Whether energy then grows without bound, which
# the status says, depends on the last bits of the start.
HOPELESS = pytest.mark.xfail(reason="needs more substeps than max_substeps", strict=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=HOPELESS if seed in (230, 285) else ()) for seed in range(100, 300)]
)
def test_many_random_piles_are_what_their_statuses_say(seed, tmp_path):
    statuses = check_recorded(pile(seed), tmp_path / "pile.vtkhdf", 20, any_status=True)
    assert not statuses & {"inverted", "not_finite"}


def test_a_small_soft_ball_dropped_ten_centimetres():
    mesh = sp.shapes.sphere(radius=0.02, edge_length=0.006)
    ball = sp.Body("ball", mesh, sp.StableNeoHookean(youngs=3e4, poisson=0.4), position=(0, 0.12, 0))
    check(sp.Scene([ball], [sp.HalfSpace(friction=0.5)]), 30)


@pytest.mark.parametrize("side", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_small_soft_balls_in_a_heap(side):
    mesh = sp.shapes.sphere(radius=0.02, edge_length=0.01)
    jelly = sp.StableNeoHookean(youngs=3e4, poisson=0.4)
    places = [(0.042 * i, 0.03 + 0.042 * j, 0.042 * k) for i in range(side) for j in range(side) for k in range(side)]
    bodies = [sp.Body(f"ball {n}", mesh, jelly, position=place, friction=0.3) for n, place in enumerate(places)]
    check(sp.Scene(bodies, [sp.HalfSpace(friction=0.3)]), 30)
