"""Scenes with stitches: good recordings pass, energy that stitches could not give is found."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import supple as sp
from supple.solvers.implicit.stepping.integrators import Newmark

from .conftest import JELLY, X, failures, recorded, verdicts

CUBE = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))


def stitched(gap):
    """Two free cubes above each other, joined by all kinds of stitches; at gap 0 the stitch tets start loaded."""
    reach = gap + 1e-6
    stitches = [
        sp.SoftVertexTriangleStitch("a", "b", max_distance=reach, mu=1e4, lam=2e4, min_separate_distance=1e-3),
        sp.VertexEdgeStitch("b", "a", max_distance=reach, stiffness=20.0, rest_length=0.03),
        sp.VertexVertexStitch("a", "b", pairs=[[0, 3]], stiffness=5.0),
    ]
    above = sp.Body("a", CUBE, JELLY, position=(0, 0.1 + gap, 0), velocity=(0, 0.2, 0), angular_velocity=(0, 2, 1))
    return sp.Scene([above, sp.Body("b", CUBE, JELLY)], stitches=stitches)


@pytest.fixture(scope="session")
def seam(folder):
    return recorded(folder / "seam.vtkhdf", stitched(0.05), sp.XPBD(substeps=20))


SOLVERS = [sp.XPBD(substeps=20), *(sp.Implicit(integrator=name) for name in ("backward_euler", "bdf2", "newmark"))]


@pytest.mark.parametrize("solver", SOLVERS, ids=["xpbd", "backward_euler", "bdf2", "newmark"])
@pytest.mark.parametrize("gap", [0.0, 0.05])
def test_good_recordings_pass(tmp_path, solver, gap):
    path = recorded(tmp_path / "r.vtkhdf", stitched(gap), solver)
    assert set(verdicts(path, skip=["cells", "obstacles", "rigidity", "welds", "joints", "works"]).values()) == {"pass"}


def test_energy_of_stitches_to_an_obstacle_is_counted(tmp_path):
    sheet = sp.obstacles.TriangleObstacle(
        name="sheet", surface=sp.SurfaceMesh([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])
    )
    seam = sp.SoftVertexTriangleStitch("a", "sheet", max_distance=0.021, youngs=1e4, poisson=0.3)
    body = sp.Body("a", CUBE, JELLY, position=(0, -0.07, 0), velocity=(0.3, -0.5, 0))
    path = recorded(tmp_path / "r.vtkhdf", sp.Scene([body], [sheet], stitches=[seam]), sp.XPBD(substeps=20))
    report = sp.check_recording(path)
    assert report.ok
    assert str(report["energy"].verdict) == "pass"
    assert 0.0 <= (report["records"].worst or 0.0) < 1e-9


def test_bodies_that_meet_beside_their_seam(tmp_path, corrupted):
    path = recorded(tmp_path / "r.vtkhdf", stitched(0.0), sp.XPBD(substeps=20))

    def push_in(file, n):
        file[X][4 * n : 4 * n + n // 2] -= np.array([0, 0.06, 0])

    assert failures(corrupted(path, push_in), only=["intersection"]) == {"intersection": 4}


def test_energy_that_only_the_stitches_have(seam, corrupted):
    def pull_apart(file, n):
        file[X][4 * n : 4 * n + n // 2] += np.array([0, 0.05, 0])

    assert failures(corrupted(seam, pull_apart), only=["energy", "records"]) == {"energy": 4, "records": 4}


@dataclass(frozen=True)
class Gaining(Newmark):
    """An integrator that makes energy."""

    def finish(self, plan, before, end, residual, at):
        end = super().finish(plan, before, end, residual, at)
        return replace(end, velocities=1.1 * end.velocities)


@pytest.mark.parametrize("gap", [0.0, 0.05])
def test_energy_that_an_integrator_makes(tmp_path, gap):
    path = recorded(tmp_path / "r.vtkhdf", stitched(gap), sp.Implicit(integrator=Gaining()))
    with sp.read_recording(path) as recording:
        assert (recording.series("stitch_energy") > 0.0).any()
    assert "energy" in failures(path)


def test_a_stitch_energy_that_was_changed(seam, corrupted):
    def change(file, n):
        file["supple/frames/stitch_energy"][2] *= 1.0 + 1e-5

    assert failures(corrupted(seam, change)) == {"records": 2}


@pytest.fixture(scope="session")
def torn(folder):
    """Two cubes that fly apart; the springs between them break in frame `first`."""
    a, b = sp.Body("a", CUBE, JELLY, velocity=(-0.5, 0, 0)), sp.Body("b", CUBE, JELLY, position=(0.12, 0, 0))
    seam = sp.VertexVertexStitch("b", "a", max_distance=0.021, stiffness=5.0, strength=0.05)
    path = recorded(folder / "torn.vtkhdf", sp.Scene([a, b], stitches=[seam]), sp.XPBD(substeps=20))
    with sp.read_recording(path) as recording:
        first = next(k for k in range(len(recording)) if recording.broken_stitches(k).any())
        assert sp.check_recording(path, skip=["status"]).ok
        assert 0 < first < len(recording) - 1
    return path, first


def test_a_broken_stitch_that_holds_again_is_found(torn, corrupted):
    path, first = torn

    def heal(file, n):
        file["supple/frames/broken_stitches"][first + 1 :] = 0

    assert {"records", "balance"} <= set(failures(corrupted(path, heal)))


def test_a_wrong_energy_of_breaking_is_found(torn, corrupted):
    path, first = torn
    with sp.read_recording(path) as recording:
        keys = next(field.keys for field in recording.details.fields if field.name == "work")
    assert keys is not None
    column, other = keys.index("breaking"), keys.index("numerical")

    def change(file, n):
        works = file["supple/frames/details/work"]
        lost = works[first, column]
        assert lost < 0.0
        works[first, column] = 0.5 * lost
        works[first, other] += 0.5 * lost

    found = failures(corrupted(path, change))
    assert found["balance"] == first
