"""Bounds of the checks where nothing moves: what is left is round-off, and what tolerances leave. It is no failure."""

import numpy as np
import pytest

import supple as sp

from .conftest import V

CARD = sp.shapes.box((0.1, 0.002, 0.14), (3, 1, 4))
BALL = sp.shapes.sphere(radius=0.05, edge_length=0.04)
STEEL = sp.StableNeoHookean(youngs=1e9, poisson=0.3, density=7800.0)
RUBBER = sp.StableNeoHookean(youngs=1e7, poisson=0.3, density=1000.0)
SOLVERS = {
    "implicit": sp.Implicit(),
    "bdf2": sp.Implicit(integrator="bdf2"),
    "newmark": sp.Implicit(integrator="newmark"),
    "xpbd": sp.XPBD(substeps=40, sleep_after=None),
}


def scaled(mesh, factor):
    return sp.TetMesh(mesh.vertices * factor, mesh.tets)


def board(name, *position):
    return sp.RigidBody(name, sp.shapes.box_surface((0.1, 0.02, 0.3), (1, 1, 1)), mass=1.0, position=position)


def recorded(path, scene, solver, steps):
    for _ in sp.simulate(scene, solver, 1 / 60, steps, sinks=[sp.Recorder(path)]):
        pass
    return path


AT_REST = {
    "cards": [sp.Body(f"card {k}", CARD, RUBBER, position=(0, 0.0021 * k, 0)) for k in range(2)],
    "millimetres": [sp.Body("ball", scaled(BALL, 0.02), RUBBER, position=(0.003, 0.002, 0.001))],
    "steel": [sp.Body("ball", BALL, STEEL, position=(0.3, 0.2, 0.1))],
    "far": [sp.Body("ball", BALL, RUBBER, position=(100, 30, -70), rotation=(0.3, 0.2, 0.1))],
    "far millimetres of steel": [sp.Body("ball", scaled(BALL, 0.02), STEEL, position=(100, 30, -70))],
}


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("name", AT_REST)
def test_bodies_at_rest_without_gravity(name, solver, tmp_path):
    path = recorded(tmp_path / "rest.vtkhdf", sp.Scene(AT_REST[name], gravity=(0, 0, 0)), SOLVERS[solver], steps=8)
    report = sp.check_recording(path, skip=["status"] if solver == "xpbd" else [])  # 40 substeps are few for steel
    assert report.ok, str(report)


@pytest.mark.parametrize("solver", ["implicit", "xpbd"])
@pytest.mark.parametrize(("place", "weld"), [((0, 0, 0), False), ((100, 30, -70), True)])
def test_what_is_held_and_rests(place, weld, solver, tmp_path):
    """A board that hangs from a held one by a joint, or with a ball that is welded to it; with gravity."""
    x, y, z = place
    ball = [sp.Body("ball", BALL, RUBBER, position=(x, y - 0.06, z))] if weld else []
    scene = sp.Scene(
        [board("high", x, y + 0.1, z), board("low", *place), *ball],
        pins=[sp.Pin("high")],
        joints=[sp.FixedJoint("low", "high")],
        welds=[sp.Weld("ball", "low", max_distance=0.01)] if weld else [],
    )
    path = recorded(tmp_path / "held.vtkhdf", scene, SOLVERS[solver], steps=20)
    report = sp.check_recording(path, skip=["status"] if solver == "xpbd" else [])
    assert report.ok, str(report)


@pytest.mark.parametrize("solver", ["implicit", "xpbd"])
@pytest.mark.parametrize("steps", [60, pytest.param(300, marks=pytest.mark.slow)])
def test_boards_that_lie_on_a_floor_for_long(solver, steps, tmp_path):
    boards = [board("low", 0, 0.0105, 0), board("high", 0.01, 0.0315, 0.02)]
    scene = sp.Scene(boards, [sp.HalfSpace(friction=0.5)])
    path = recorded(tmp_path / "boards.vtkhdf", scene, SOLVERS[solver], steps=steps)
    report = sp.check_recording(path, skip=["intersection", "containment", "distance"])
    assert report.ok, str(report)


def test_faults_that_are_small_but_seen(tmp_path, corrupted):
    """Energy from nothing in a body at rest: a velocity of a hundredth of its size per second."""
    path = recorded(tmp_path / "rest.vtkhdf", sp.Scene(AT_REST["steel"], gravity=(0, 0, 0)), sp.Implicit(), steps=4)

    def drift(file, n):
        file[V][3 * n : 4 * n] += np.array([1e-3, 0, 0])

    report = sp.check_recording(corrupted(path, drift))
    assert {"momentum", "energy"} <= {result.name for result in report.failures}, str(report)


def test_the_verdict_names_what_was_skipped(tmp_path):
    path = recorded(tmp_path / "rest.vtkhdf", sp.Scene(AT_REST["far"], gravity=(0, 0, 0)), sp.Implicit(), steps=2)
    report = sp.check_recording(path, only=["finite", "welds", "joints"])
    assert report.verdict.endswith("all 3 frames checked, 1 checks passed; skipped: welds, joints")
