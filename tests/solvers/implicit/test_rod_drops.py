"""Random drops of rods, shells, soft and rigid bodies on floors, a ball and each other: nothing crosses."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import supple as sp

# Verdicts on what goes through what, whether steps converge or not.
CROSSINGS = {"intersection", "tunnelling", "distance", "containment"}


def line_of(rng, size, r):
    """The points and edges of a straight, closed, coiled or wandering line, or of a net."""
    kind, n = rng.integers(5), int(rng.integers(1, 14))
    if kind == 1:
        n = max(n, 3)
        angles = 2.0 * np.pi * np.arange(n) / n
        ring = size * np.column_stack([np.cos(angles), 0.0 * angles, np.sin(angles)])
        return ring, np.column_stack([np.arange(n), (np.arange(n) + 1) % n])
    if kind == 2:
        k = int(rng.integers(3, 6))
        grid = np.arange(k * k).reshape(k, k)
        x, z = np.meshgrid(*2 * [np.linspace(-size, size, k)], indexing="ij")
        along, across = (
            np.column_stack([grid[:-1].ravel(), grid[1:].ravel()]),
            np.column_stack([grid[:, :-1].ravel(), grid[:, 1:].ravel()]),
        )
        return np.column_stack([x.ravel(), 0.0 * x.ravel(), z.ravel()]), np.concatenate([along, across])
    if kind == 3:
        angles = np.linspace(0.0, 5.0 * np.pi, 40)
        pitch = max(3.5 * r, 0.2 * size)
        return np.column_stack(
            [0.6 * size * np.cos(angles), pitch * angles / (2 * np.pi), 0.6 * size * np.sin(angles)]
        ), None
    steps = np.cumsum(0.3 * rng.normal(size=(n, 3)), axis=0) * (kind == 4) + [1.5, 0.0, 0.0]
    steps *= 2.0 * size / n / np.linalg.norm(steps, axis=1)[:, None]
    return np.concatenate([[[0.0, 0.0, 0.0]], np.cumsum(steps, axis=0)]) - steps.sum(axis=0) / 2.0, None


def rod(rng, name, size, place):
    r = float(np.clip(size * 10 ** rng.uniform(-2.3, -0.9), 1e-4, 2e-2))
    points, edges = line_of(rng, size, r)
    material = sp.RodMaterial(
        youngs=10 ** rng.uniform(3, 9),
        poisson=rng.uniform(0, 0.5),
        radius=r,
        density=rng.uniform(200, 3000),
        damping=0.0 if rng.random() < 0.3 else 10 ** rng.uniform(-4, -1.5),
    )
    rest = "straight" if rng.random() < 0.3 else "given"
    return sp.Rod(name, points, material, edges=edges, rest=rest, **place)


def shell(rng, name, size, place):
    thickness = size * 10 ** rng.uniform(-2.3, -1)
    material = sp.ShellMaterial(
        youngs=10 ** rng.uniform(4, 8), poisson=0.3, thickness=thickness, density=rng.uniform(200, 2000), damping=0.002
    )
    return sp.Shell(name, sp.shapes.sheet(2 * size, 2 * size, size / rng.integers(1, 4)), material, **place)


def soft(rng, name, size, place):
    mesh = sp.shapes.sphere(0.7 * size, 0.5 * size) if rng.random() < 0.5 else sp.shapes.box(3 * (size,), (2, 2, 2))
    material = sp.StableNeoHookean(youngs=10 ** rng.uniform(4, 7), poisson=rng.uniform(0.1, 0.45), damping=0.002)
    return sp.Body(name, mesh, material, **place)


def rigid(rng, name, size, place):
    return sp.RigidBody(
        name, sp.shapes.box((size, 0.5 * size, size), (1, 1, 1)), density=rng.uniform(500, 5e3), **place
    )


def drop(seed):
    rng = np.random.default_rng(seed)
    size, things, y = 10 ** rng.uniform(-2.3, -0.3), [], 0.0
    obstacles = [sp.HalfSpace(friction=rng.uniform(0, 1))]
    if rng.random() < 0.4:
        obstacles.append(sp.obstacles.Sphere(name="ball", center=(0, 1.2 * size, 0), radius=size, friction=0.3))
        y = 2.3 * size
    for k in range(int(rng.integers(2, 5))):
        kind = [rod, rod, rod, shell, soft, rigid][int(rng.integers(6))] if k else rod
        own = size * rng.uniform(0.5, 1.2)
        y += 2.5 * own
        place = {
            "position": [rng.uniform(-0.3, 0.3) * size, y, rng.uniform(-0.3, 0.3) * size],
            "rotation": Rotation.from_quat(np.random.default_rng(rng.integers(1 << 30)).normal(size=4)).as_rotvec(),
            "velocity": (0.0, -float(rng.choice([0.0, 1.0, 5.0, 20.0])), 0.0),
            "friction": rng.uniform(0, 1),
        }
        things.append(kind(rng, f"{kind.__name__}{k}", own, place))
        y += 2.5 * own
    return sp.Scene(things, obstacles=obstacles)


def crossings(seed, path, steps):
    """The verdicts of the check on what goes through what, and whether every step converged."""
    statuses = {
        str(frame.report.status)
        for frame in sp.simulate(drop(seed), sp.Implicit(), 1 / 60, steps, sinks=[sp.Recorder(path)])
    }
    failures = {one.name: one.message for one in sp.check_recording(path).failures}
    return {name: text for name, text in failures.items() if name in CROSSINGS}, statuses


@pytest.mark.parametrize("seed", [5, 10, 14])
def test_what_falls_does_not_cross_anything(seed, tmp_path):
    assert crossings(seed, tmp_path / "drop.h5", 6) == ({}, {"converged"})


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::supple.errors.SuppleWarning")
@pytest.mark.parametrize("seed", range(30))
def test_30_random_drops_do_not_cross_anything(seed, tmp_path):
    assert crossings(seed, tmp_path / "drop.h5", 8)[0] == {}
