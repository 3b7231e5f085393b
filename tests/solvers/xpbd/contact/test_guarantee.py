"""The guarantee of rows with all pushes switched off: exact tests of surfaces and of J after every substep."""

from collections.abc import Callable

import numpy as np
import pytest

import supple as sp
from supple.mesh import shapes
from supple.solvers.xpbd.frame import volumes
from supple.solvers.xpbd.frame.substep import SubstepRunner
from supple.solvers.xpbd.record import CUTS
from supple.solvers.xpbd.workspace import XPBDWorkspace

FLOOR = sp.HalfSpace(name="floor", friction=0.5)


def material(youngs: float = 3e4, damping: float = 0.0) -> sp.StableNeoHookean:
    return sp.StableNeoHookean(youngs=youngs, poisson=0.45, density=1000.0, damping=damping)


def head_on(speed: float) -> sp.Scene:
    ball = shapes.sphere(0.05, 0.02)
    bodies = [
        sp.Body(name, ball, material(), position=(side * 0.07, 0.3 * side * 0.05, 0.0), velocity=(-side * speed, 0, 0))
        for name, side in (("left", -1.0), ("right", 1.0))
    ]
    return sp.Scene(bodies=bodies, gravity=(0, 0, 0))


def folding() -> sp.Scene:
    bar = shapes.box((0.03, 0.5, 0.03), (2, 24, 2))
    body = sp.Body(
        "bar", bar, material(2e4, 0.01), position=(0, 0.27, 0), rotation=(0.02, 0, 0.05), velocity=(0, -2, 0)
    )
    return sp.Scene(bodies=[body], obstacles=[FLOOR])


def heap() -> sp.Scene:
    ball, generator = shapes.sphere(0.04, 0.025), np.random.default_rng(3)
    bodies = []
    for k in range(8):
        at = np.array([0.0, 0.06, 0.0]) + 0.085 * np.array([k % 2 - 0.5, k // 4, k // 2 % 2 - 0.5])
        at += generator.normal(scale=0.001, size=3)
        bodies.append(sp.Body(f"ball{k}", ball, material(1e5), position=at, velocity=(0, -1.0, 0)))
    return sp.Scene(
        bodies=bodies, obstacles=[sp.obstacles.Sphere(name="bowl", center=(0, 0.3, 0), radius=0.3, inside=True)]
    )


def flat_faces() -> sp.Scene:
    """Rigid boxes of several triangles a face, and a soft one, which fly at each other turned at random."""
    rigid, generator, bodies = shapes.box_surface((0.06, 0.06, 0.06), (2, 2, 2)), np.random.default_rng(0), []
    for k in range(8):
        side = np.array([k % 2 - 0.5, k // 4 - 0.5, k // 2 % 2 - 0.5])
        way = {"position": 0.13 * side, "velocity": -8.0 * side, "rotation": generator.normal(size=3)}
        bodies.append(sp.RigidBody(f"box{k}", rigid, density=500.0, **way))
    bodies.append(sp.Body("soft", shapes.box((0.04, 0.04, 0.04), (2, 2, 2)), material()))
    return sp.Scene(bodies=bodies, gravity=(0, 0, 0))


def on_triangles() -> sp.Scene:
    """A box falls onto the edge of a wedge."""
    points = np.array([[-0.2, 0, -0.2], [0.2, 0, -0.2], [0.2, 0, 0.2], [-0.2, 0, 0.2], [0, 0.1, -0.2], [0, 0.1, 0.2]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [0, 5, 4], [1, 4, 5], [1, 5, 2], [0, 4, 1], [3, 2, 5]])
    wedge = sp.obstacles.TriangleObstacle(name="wedge", surface=sp.SurfaceMesh(points, faces), friction=0.3)
    box = shapes.box((0.1, 0.1, 0.1), (3, 3, 3))
    return sp.Scene(
        bodies=[sp.Body("box", box, material(), position=(0.01, 0.16, 0), velocity=(0, -3, 0))], obstacles=[wedge]
    )


def pushed() -> sp.Scene:
    """A box obstacle drives into a ball at 2 m/s."""
    pusher = sp.obstacles.Box(
        name="pusher", center=(-0.12, 0, 0), size=(0.1, 0.1, 0.1), motion=lambda t: ((2.0 * t, 0, 0))
    )
    ball = sp.Body("ball", shapes.sphere(0.05, 0.02), material())
    return sp.Scene(bodies=[ball], obstacles=[pusher], gravity=(0, 0, 0))


def pinned() -> sp.Scene:
    """Two bars; the end of one moves down through the place of the other."""
    bar = shapes.box((0.3, 0.04, 0.04), (10, 2, 2))
    end = np.flatnonzero(bar.vertices[:, 0] < -0.149)
    upper = sp.Body("upper", bar, material(), position=(0, 0.06, 0))
    lower = sp.Body("lower", bar, material(), rotation=(0, 1.2, 0))
    pins = [sp.Pin("upper", vertices=end, motion=lambda t: (0, -0.5 * t, 0))]
    return sp.Scene(bodies=[upper, lower], pins=pins, gravity=(0, 0, 0))


def squeezed() -> sp.Scene:
    """Two obstacles meet where a ball is."""
    walls = [
        sp.obstacles.Box(
            name=name, center=(side * 0.11, 0, 0), size=(0.1, 0.2, 0.2), motion=lambda t, s=side: (-s * 2.0 * t, 0, 0)
        )
        for name, side in (("left", -1.0), ("right", 1.0))
    ]
    return sp.Scene(
        bodies=[sp.Body("ball", shapes.sphere(0.05, 0.025), material())], obstacles=walls, gravity=(0, 0, 0)
    )


class Watch:
    """Exact tests of surfaces, and J, after every substep."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.crossing: list[int] = []
        self.least: list[float] = []
        self.cut = self.crushed = 0
        run = SubstepRunner.run

        def checked(substeps: SubstepRunner, k: int) -> bool:
            known, ws = run(substeps, k), substeps.ws
            asleep = np.zeros(len(ws.system.bodies), dtype=np.bool_)
            found = ws.assessment.surfaces.find(np.ascontiguousarray(ws.points[:, :3] + ws.origins), ws.time, asleep)
            self.crossing.append(sum(item.pairs for item in found))
            edges = ws.points[ws.system.tets[:, 1:], :3] - ws.points[ws.system.tets[:, :1], :3]
            self.least.append(float((np.linalg.det(edges) / (6.0 * ws.system.rest_volumes)).min()))
            self.cut, self.crushed = max(self.cut, int(ws.counts[CUTS])), max(self.crushed, ws.contact.crushed)
            return known

        monkeypatch.setattr(SubstepRunner, "run", checked)


@pytest.mark.parametrize(
    ("make", "frames"),
    [
        (lambda: head_on(2.0), 8),
        (lambda: head_on(10.0), 6),
        (folding, 20),
        (heap, 12),
        (flat_faces, 10),
        (on_triangles, 10),
        (pinned, 12),
    ],
    ids=["head_on_2", "head_on_10", "folding", "heap", "flat_faces", "on_triangles", "pinned"],
)
def test_nothing_crosses_and_no_tet_turns_over_without_any_push(
    monkeypatch: pytest.MonkeyPatch, make: Callable[[], sp.Scene], frames: int
) -> None:
    stages = XPBDWorkspace.stages
    monkeypatch.setattr(XPBDWorkspace, "stages", lambda ws: stages(ws)._replace(solve_rows=lambda *_: None))
    monkeypatch.setattr(volumes, "MOST_PROJECTIONS", 0)
    watch = Watch(monkeypatch)
    for _ in sp.simulate(make(), sp.XPBD(substeps=12), dt=1 / 60, steps=frames):
        pass
    assert len(watch.crossing) == 12 * frames
    assert not any(watch.crossing), f"first in substep {np.flatnonzero(watch.crossing)[0]}"
    assert min(watch.least) > 0.0
    assert watch.cut > 0  # the guarantee had to act
    assert watch.crushed == 0


@pytest.mark.parametrize("make", [pushed, pinned], ids=["obstacle", "pin"])
def test_what_moves_on_script_pushes_a_body_before_it(
    monkeypatch: pytest.MonkeyPatch, make: Callable[[], sp.Scene]
) -> None:
    watch = Watch(monkeypatch)
    frames = list(sp.simulate(make(), sp.XPBD(substeps=20), dt=1 / 60, steps=10))
    assert not any(watch.crossing)
    assert min(watch.least) > 0.0
    assert watch.crushed == 0
    moved = max(float(np.abs(frames[-1].velocities[name]).max()) for name in frames[-1].velocities)
    assert moved > 0.1


def test_a_body_that_obstacles_crush_has_a_named_status() -> None:
    reports = [frame.report for frame in sp.simulate(squeezed(), sp.XPBD(substeps=12), dt=1 / 60, steps=4)]
    assert {str(report.status) for report in reports} & {"inverted", "intersecting", "truncated"}
    worst = next(report for report in reports if str(report.status) in ("inverted", "intersecting", "truncated"))
    assert "ball" in worst.message
