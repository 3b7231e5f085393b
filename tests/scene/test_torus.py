"""The torus: bodies fall through its hole and rest on it, in both solvers, and the check knows its triangles."""

import h5py
import pytest
from tests.scenes import converged

import supple as sp

RUBBER = sp.StableNeoHookean(youngs=5e4, poisson=0.3, density=1000.0, damping=0.02)
SOLVERS = {"xpbd": sp.XPBD(substeps=15), "implicit": sp.Implicit()}
BOTH = pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS)
RING = sp.obstacles.Torus(radius=0.3, tube_radius=0.1, friction=0.3, name="ring")


def ball(radius, height):
    return sp.Body("ball", sp.shapes.sphere(radius, radius / 2.0), RUBBER, position=(0, height, 0))


@BOTH
def test_a_small_ball_falls_through_the_hole(solver):
    """It touches nothing: a convex solid of the same size would stop it."""
    frames = converged(sp.simulate(sp.Scene([ball(0.15, 0.3)], [RING]), solver, 1 / 60, 30))
    for frame in frames:
        center = frame.positions["ball"][:, 1].mean()
        assert center == pytest.approx(0.3 - 0.5 * 9.81 * frame.time**2, abs=0.09)
    assert center < -0.5


@BOTH
def test_a_large_ball_rests_in_it_and_the_check_agrees(solver, tmp_path):
    path = tmp_path / "ring.vtkhdf"
    frames = converged(sp.simulate(sp.Scene([ball(0.3, 0.28)], [RING]), solver, 1 / 60, 31, sinks=[sp.Recorder(path)]))
    last = frames[-1].positions["ball"]
    distances, _ = RING.signed_distance(last)
    assert -1e-9 < distances.min() < 3e-3
    assert last[:, 1].mean() > 0.05
    # It still swings in the ring.
    assert frames[-1].report.kinetic_energy < 1e-4 * frames[-1].report.potential_energy
    report = sp.check_recording(path, only=["intersection", "containment", "distance"])
    assert report.ok, report.failures
    with sp.read_recording(path) as recording:
        assert recording.obstacles[0].tube_radius == 0.1
    with h5py.File(path, "r+") as file:
        n = int(file["VTKHDF/NumberOfPoints"][0])
        file["VTKHDF/Points"][5 * n : 6 * n] -= [0.0, 0.15, 0.0]
    found = sp.check_recording(path, only=["intersection"])["intersection"]
    assert found.first_failure == 5
    assert "obstacle ring" in found.where
