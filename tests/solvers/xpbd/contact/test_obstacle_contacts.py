"""Contact with every kind of obstacle: rest positions, no tunnelling, no gain of energy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.scenes import contact_gap, converged

import supple as sp
from supple.solvers.xpbd.contact.rows import SKIN
from supple.solvers.xpbd.solver import XPBD

SOFT = sp.EdgesAndVolume(edge_compliance=5e-5, volume_compliance=0.0, density=1000, damping=0.01)
JELLY = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000, damping=0.03)
DUST = sp.shapes.box(size=(0.02, 0.02, 0.02), divisions=(1, 1, 1))


def sheet(size, cells=4, height=0.0):
    """An open square sheet facing up."""
    n = cells + 1
    grid = np.linspace(-size / 2, size / 2, n)
    x, z = np.meshgrid(grid, grid, indexing="ij")
    corner = (np.arange(cells)[:, None] * n + np.arange(cells)).ravel()
    quads = np.stack([corner, corner + 1, corner + n + 1, corner + n], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return sp.SurfaceMesh(np.stack([x.ravel(), np.full(n * n, height), z.ravel()], axis=1), triangles)


def ball_of_triangles():
    """A closed ball of triangles below the origin."""
    return sp.obstacles.TriangleObstacle(
        sp.shapes.sphere_surface(radius=1.0, edge_length=0.15).transformed(translation=(0, -1, 0))
    )


def ball(height, velocity=(0, 0, 0), material=SOFT):
    return sp.Body(
        "ball", sp.shapes.sphere(radius=0.1, edge_length=0.07), material, position=(0, height, 0), velocity=velocity
    )


RESTS = {
    "plane": (lambda: sp.HalfSpace(friction=0.5), 0.0),
    "box": (lambda: sp.obstacles.Box(center=(0, -0.5, 0), size=(1, 1, 1), friction=0.5), None),
    "rotated box": (
        lambda: sp.obstacles.Box(
            center=(0, -0.5, 0), size=(1, 1, 1), rotation=Rotation.from_euler("yz", [0.4, np.pi]).as_rotvec()
        ),
        None,
    ),
    "room": (lambda: sp.obstacles.Box(center=(0, 0.5, 0), size=(0.3, 1, 0.3), inside=True, friction=0.5), 0.0),
    "bowl": (lambda: sp.obstacles.Sphere(center=(0, 0.3, 0), radius=0.3, inside=True, friction=0.5), 0.0),
    "open triangles": (lambda: sp.obstacles.TriangleObstacle(sheet(1.0), friction=0.5), None),
}


@pytest.mark.parametrize("kind", RESTS)
def test_a_dropped_ball_comes_to_rest_on_it(kind):
    make, level = RESTS[kind]
    scene = sp.Scene([ball(0.13, material=JELLY)], [make()])
    thickness = contact_gap(scene.bodies[0])
    level = thickness if level is None else level
    lowest, frame = [], None
    for frame in sp.simulate(scene, XPBD(), 1 / 60, 60):
        assert frame.report.status == "converged"
        lowest.append(frame.positions["ball"][:, 1].min())
    assert min(lowest) > level - 0.1 * thickness
    assert lowest[-1] == pytest.approx(level, abs=0.006 if kind == "bowl" else 0.02 * thickness)
    assert frame.report.kinetic_energy < 5e-3  # 5 cm/s
    assert frame.report.details.smallest_gap == pytest.approx(level, abs=1e-4)


@pytest.mark.parametrize("kind", ["ball", "closed triangles"])
def test_a_dropped_ball_lands_on_a_ball_and_rolls_off(kind):
    obstacle = sp.obstacles.Sphere(center=(0, -1, 0), radius=1) if kind == "ball" else ball_of_triangles()
    scene = sp.Scene([ball(0.13)], [obstacle])
    gaps = []
    for frame in sp.simulate(scene, XPBD(substeps=60, accuracy=0.9), 1 / 60, 25):
        assert frame.report.status == "converged"
        gaps.append(np.linalg.norm(frame.positions["ball"] + [0, 1, 0], axis=1).min() - 1)
    # The triangles are up to 4.6 mm inside of the ball.
    assert min(gaps) > (-1e-9 if kind == "ball" else -0.0046)
    assert np.median(gaps) < 0.01  # an elastic ball bounces


def fly(obstacle, position, velocity, time, substeps=20, rotation=(0, 0, 0)):
    """Simulate a soft grain without gravity: its last positions and velocities, and all kinetic energies."""
    grain = sp.Body("dust", DUST, JELLY, position=position, velocity=velocity, rotation=rotation)
    solver = XPBD(substeps=substeps, start="push_out", sleep_after=None)
    frames = list(sp.simulate(sp.Scene([grain], [obstacle], gravity=(0, 0, 0)), solver, 1 / 60, round(60 * time)))
    reports = [frame.report for frame in frames]
    energies = [report.kinetic_energy for report in reports]
    return frames[-1].positions["dust"], frames[-1].velocities["dust"], np.array(energies)


@pytest.mark.parametrize(("speed", "substeps"), [(0.5, 20), (60.0, 1), (60.0, 20)])
@pytest.mark.parametrize(
    "obstacle",
    [
        sp.HalfSpace(),
        sp.obstacles.Box(center=(0, -0.002, 0), size=(1, 0.004, 1)),
        sp.obstacles.Box(center=(0, -0.05, 0), size=(0.1, 1, 1), rotation=(0, 0, np.pi / 2)),
        sp.obstacles.Sphere(center=(0, -0.2, 0), radius=0.2),
        sp.obstacles.Capsule(start=(-1, -0.2, 0), end=(1, -0.2, 0), radius=0.2),
        sp.obstacles.Cylinder(start=(0, -0.004, 0), end=(0, 0, 0), radius=0.5),
        sp.obstacles.TriangleObstacle(sheet(1.0, cells=2)),
        sp.obstacles.TriangleObstacle(sp.shapes.box_surface(size=(1, 0.004, 1), divisions=(4, 1, 4))),
    ],
    ids=["plane", "thin box", "rotated box", "ball", "capsule", "thin cylinder", "sheet", "thin closed triangles"],
)
def test_no_tunnelling_and_no_gain_of_energy(obstacle, speed, substeps):
    start = (0.013, 0.05, 0.017)
    x, _, energies = fly(obstacle, start, (0, -speed, 0), 0.25, substeps)
    above = np.abs(x[:, [0, 2]]).max(axis=1) < 0.2  # they slide off round obstacles to the side
    is_round = isinstance(obstacle, (sp.obstacles.Sphere, sp.obstacles.Capsule))
    assert (x[above, 1] > (-0.2 if is_round else -0.0021)).all()
    assert obstacle.surface_mesh is not None or (obstacle.signed_distance(x)[0] > -1e-9).all()
    assert (energies <= (1.0 + 1e-9) * 500.0 * DUST.volume * speed**2).all()


def test_an_open_sheet_has_two_sides():
    x, _, _ = fly(sp.obstacles.TriangleObstacle(sheet(1.0)), (0.05, -0.05, 0.07), (0, 10, 0), 0.2)
    assert x[:, 1].max() < 0


def test_a_sheet_ends_at_its_edge():
    x, _, _ = fly(sp.obstacles.TriangleObstacle(sheet(1.0)), (0.6, 0.05, 0), (0, -1, 0), 0.5)
    assert x[:, 1].max() < -0.3


@pytest.mark.parametrize("inside", [False, True])
def test_a_particle_that_starts_inside_is_pushed_out_without_speed(inside):
    if inside:
        obstacle, start = sp.obstacles.Box(size=(1, 1, 1), inside=True), (0, 0.53, 0.1)
    else:
        obstacle, start = sp.obstacles.Box(size=(1, 1, 1), rotation=(0, 0.3, 0)), (0.05, 0.47, 0.1)
    x, _, energies = fly(obstacle, start, (0, 0, 0), 1.0)
    assert (x[:, 1] <= 0.5 + 1e-9).all() if inside else (x[:, 1] >= 0.5).all()
    assert energies.max() < 1e-3


def test_box_corners_and_small_balls_support_a_coarse_body():
    """No vertex of the body is near the obstacle: its points must support the body's faces."""
    for obstacle in (
        sp.obstacles.Box(center=(0.03, -0.05, 0.02), size=(0.05, 0.1, 0.05)),
        sp.obstacles.Sphere(center=(0.03, -0.05, 0.02), radius=0.05),
    ):
        body = sp.Body(
            "b", sp.shapes.box((0.4, 0.1, 0.4), (1, 1, 1)), SOFT, position=(0, 0.055, 0), velocity=(0, -1, 0)
        )
        scene = sp.Scene([body], [obstacle], gravity=(0, 0, 0))
        frame = list(sp.simulate(scene, XPBD(substeps=20), 1 / 60, 15))[-1]
        assert frame.positions["b"][:, 1].mean() > 0.03


def test_a_moving_plane_compresses_a_body_and_leaves_a_pinned_vertex():
    lid = sp.HalfSpace(point=(0, 0.3, 0), normal=(0, -1, 0), motion=sp.Keyframes([0, 0.5], [[0, 0, 0], [0, -0.15, 0]]))
    body = ball(0.1)
    lowest = int(body.mesh.vertices[:, 1].argmin())
    scene = sp.Scene([body], [sp.HalfSpace(), lid], [sp.Pin("ball", [lowest])])
    frames = list(sp.simulate(scene, XPBD(substeps=10), 1 / 60, 36))
    y = frames[-1].positions["ball"][:, 1]
    assert y.max() == pytest.approx(0.15 - SKIN * contact_gap(body), abs=1e-9)
    assert np.ptp(y) == pytest.approx(0.15, abs=2e-3)
    assert y[lowest] == scene.bodies[0].place(body.mesh.vertices)[lowest, 1]


def test_a_rotated_room_gives_the_rotated_motion():
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8])
    straight, _, _ = fly(sp.obstacles.Box(size=(0.3, 0.2, 0.4), inside=True, friction=0.3), (0, 0, 0), (3, 1, 2), 0.4)
    room = sp.obstacles.Box(size=(0.3, 0.2, 0.4), inside=True, friction=0.3, rotation=turn.as_rotvec())
    x, _, _ = fly(room, (0, 0, 0), turn.apply([3, 1, 2]), 0.4, rotation=turn.as_rotvec())
    assert np.allclose(turn.inv().apply(x), straight, atol=1e-9)


def test_a_frictionless_floor_corrects_along_its_normal_only():
    floor, body = sp.HalfSpace(), ball(0.1, velocity=(0.3, -1, 0.2))
    scene = sp.Scene([body], [floor])
    frames = list(sp.simulate(scene, XPBD(substeps=20), 1 / 60, 12))
    forces = np.array([frame.report.details.contact_forces["ball"] for frame in frames])
    assert forces[:, 1].max() > 1.0
    assert (forces[:, [0, 2]] == 0.0).all()


@pytest.mark.parametrize("cells", [1, 3])
def test_the_edge_of_a_box_and_a_small_ball_do_not_enter_between_vertices(cells, tmp_path):
    """A cube on the edge of a long box, whose corners are beside it, and on a ball narrower than its face."""
    edge = sp.obstacles.Box(size=(1, 1, 4), rotation=(0, 0, np.pi / 4), friction=0.5)
    ball = sp.obstacles.Sphere(center=(6, 0.2, 0), radius=0.5, friction=0.5)
    cube, rubber = sp.shapes.box((1, 1, 1), (cells,) * 3), sp.StableNeoHookean(youngs=1e5, poisson=0.3)
    bodies = [sp.Body(f"cube {x}", cube, rubber, position=(x, 1.24, 0.03)) for x in (0, 6)]
    recorder = sp.Recorder(tmp_path / "edge.vtkhdf")
    frames = converged(sp.simulate(sp.Scene(bodies, [edge, ball]), sp.XPBD(), 1 / 60, 8, sinks=[recorder]))
    assert min(frame.report.details.contacts for frame in frames[-2:]) > 1
    report = sp.check_recording(tmp_path / "edge.vtkhdf")
    assert report.ok, report
