"""Recordings to check, copies of them that are corrupted on purpose, and the results of checks."""

import shutil

import h5py
import numpy as np
import pytest

import supple as sp

FRAMES = 7
X, V = "VTKHDF/Points", "VTKHDF/PointData/velocities"
JELLY = sp.StableNeoHookean(youngs=1e4, poisson=0.45, density=1000.0)


def octahedron(center, radius):
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]) * radius + center
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return sp.SurfaceMesh(vertices, faces)


def recorded(path, scene, solver, **options):
    for _ in sp.simulate(scene, solver, 1 / 60, FRAMES - 1, sinks=[sp.Recorder(path, solver=solver)], **options):
        pass
    return path


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("checked")


@pytest.fixture(scope="session")
def free(folder):
    """Two blocks that fall past each other without touching; one spins, one wobbles."""
    block = sp.shapes.box((1.0, 0.5, 0.5), (2, 2, 2))
    bodies = [
        sp.Body("left", block, JELLY, angular_velocity=(1, 0, 0)),
        sp.Body("right", block, JELLY, position=(1.5, 0, 0)),
    ]
    start = {"right": block.vertices * [0.9, 1.0, 1.0] + [1.5, 0, 0]}
    return recorded(folder / "free.vtkhdf", sp.Scene(bodies), sp.XPBD(substeps=5), initial_positions=start)


@pytest.fixture(scope="session")
def around(folder):
    """A cube in a room, over a floor, with every kind of obstacle near it, two of them moving."""
    away = sp.Keyframes(times=[0.0, 1.0], displacements=[[0, 0, 0], [-0.5, 0, 0]])
    obstacles = [
        sp.HalfSpace(name="floor"),
        sp.HalfSpace(name="slope", point=(3, 0, 0), normal=(-1, 1, 0.3)),
        sp.HalfSpace(name="door", point=(-2, 0, 0), normal=(1, 0, 0), motion=away),
        sp.obstacles.Box(name="room", center=(0, 0, 5), size=(20, 20, 20), rotation=(0.1, 0.2, 0.3), inside=True),
        sp.obstacles.Sphere(name="bowl", radius=9, inside=True),
        sp.obstacles.Sphere(name="ball", center=(0, 1, 2), radius=0.4),
        sp.obstacles.Box(name="crate", center=(0, 1, -2), size=(0.5, 0.5, 0.5), rotation=(0, 0.4, 0), motion=away),
        sp.obstacles.Capsule(name="log", start=(-3, 1, 4), end=(3, 1.5, 4), radius=0.4, motion=away),
        sp.obstacles.Cylinder(name="drum", start=(0, 3, 3), end=(0.5, 4, 3), radius=0.5),
        sp.obstacles.Cylinder(name="tank", start=(0, -12, 0), end=(0, 12, 0), radius=6, inside=True),
        sp.obstacles.TriangleObstacle(name="rock", surface=octahedron((0.3, 3.0, 0.2), 0.4)),
    ]
    scene = sp.Scene([sp.Body("cube", sp.shapes.box((1, 1, 1), (2, 2, 2)), JELLY, position=(0, 1, 0))], obstacles)
    return recorded(folder / "around.vtkhdf", scene, sp.XPBD(substeps=5))


@pytest.fixture
def corrupted(tmp_path):
    """corrupted(path, change): a copy, changed by change(file, n), n being the number of vertices."""

    def corrupt(path, change):
        copy = tmp_path / "corrupted.vtkhdf"
        shutil.copy(path, copy)
        with h5py.File(copy, "r+") as file:
            change(file, int(file["VTKHDF/NumberOfPoints"][0]))
        return copy

    return corrupt


def failures(path, **settings):
    """Which checks fail, and in which frame first."""
    report = sp.check_recording(path, **settings)
    assert report.ok == (not report.failures)
    return {result.name: result.first_failure for result in report.failures}


def verdicts(path, **settings):
    return {result.name: str(result.verdict) for result in sp.check_recording(path, **settings).results}


def nan_position(file, n):
    file[X][3 * n + 4, 1] = np.nan
