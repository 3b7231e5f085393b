"""Capsules and cylinders under bodies, in both solvers."""

import numpy as np
import pytest

import supple as sp

JELLY = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000.0, damping=0.03)
BALL = sp.shapes.sphere(radius=0.1, edge_length=0.07)
SOLVERS = {"xpbd": sp.XPBD(substeps=10), "implicit": sp.Implicit()}


def rails(kind, tilt=0.0, **obstacle):
    """Two parallel bars along z, tilted downwards along z."""
    along = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    sides = [np.array([x, 0.0, 0.0]) for x in (-0.52, 0.52)]
    return [kind(start=side - 2 * along, end=side + 2 * along, radius=0.5, **obstacle) for side in sides]


HEIGHT = np.sqrt(0.6**2 - 0.52**2)  # of a ball's center that lies between the bars
SUPPORTS = {
    "capsules": (rails(sp.obstacles.Capsule), HEIGHT),
    "cylinders": (rails(sp.obstacles.Cylinder), HEIGHT),
    "end of a cylinder": ([sp.obstacles.Cylinder(start=(0, -1, 0), end=(0, 0, 0), radius=0.5)], 0.1),
    "room of a cylinder": ([sp.obstacles.Cylinder(start=(0, 0, 0), end=(0, 1, 0), radius=0.4, inside=True)], 0.1),
    "room of a capsule": ([sp.obstacles.Capsule(start=(0, 0.5, -1), end=(0, 0.5, 1), radius=0.5, inside=True)], 0.1),
}


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("support", SUPPORTS)
def test_a_ball_comes_to_rest(support, solver):
    obstacles, height = SUPPORTS[support]
    scene = sp.Scene([sp.Body("ball", BALL, JELLY, position=(0, height + 0.004, 0))], obstacles)
    distances = []
    # With ten substeps, XPBD reports the ball as softened.
    used = sp.XPBD() if solver == "xpbd" else SOLVERS[solver]
    for frame in sp.simulate(scene, used, 1 / 60, 40):
        assert frame.report.status == "converged"
        distances.append([one.signed_distance(frame.positions["ball"])[0].min() for one in obstacles])
    assert np.min(distances) > -1e-4 if solver == "xpbd" else np.min(distances) > 0.0
    np.testing.assert_allclose(distances[-1], 0.0, atol=2e-3)
    # The ball is a polyhedron, which lies lower on its faces than a round ball.
    assert 0.75 * height < frame.positions["ball"].mean(axis=0)[1] < height
    assert frame.report.kinetic_energy < 1e-2  # 7 cm/s


@pytest.mark.parametrize(("kind", "solver"), [(sp.obstacles.Cylinder, "implicit"), (sp.obstacles.Capsule, "xpbd")])
def test_a_ball_slides_along_bars_without_friction(kind, solver):
    tilt, steps = 0.2, 30
    normal, along = np.array([0, np.cos(tilt), np.sin(tilt)]), np.array([0, -np.sin(tilt), np.cos(tilt)])
    # The ball starts near its rest position between the bars.
    body = sp.Body("ball", BALL, JELLY, position=normal * (HEIGHT + 5e-4))
    scene = sp.Scene([body], rails(kind, tilt))
    way = [frame.positions["ball"].mean(axis=0) for frame in sp.simulate(scene, SOLVERS[solver], 1 / 60, steps)]
    fallen = (way[-1] - way[0]) @ along
    t0, t1 = 1 / 60, steps / 60
    # Backward Euler moves by g h^2 k (k + 1) / 2 in k steps; XPBD with its substeps nearly by g t^2 / 2.
    exact = 0.5 * 9.81 * np.sin(tilt) * (t1**2 - t0**2)
    assert fallen == pytest.approx(exact, rel=0.05)
    assert abs(way[-1][0]) < 1e-3


@pytest.mark.parametrize(("kind", "solver"), [(sp.obstacles.Capsule, "implicit"), (sp.obstacles.Cylinder, "xpbd")])
def test_a_ball_rolls_along_bars_with_friction(kind, solver):
    """Rolling without slipping: a ball of radius R on contacts at height h = R HEIGHT / .6 below its center turns at
    v / h and has the acceleration g sin(tilt) / (1 + 2/5 (R / h)^2)."""
    tilt, steps = 0.7, 30  # steep enough for a polyhedron to roll over its edges
    normal, along = np.array([0, np.cos(tilt), np.sin(tilt)]), np.array([0, -np.sin(tilt), np.cos(tilt)])
    stiff = sp.StableNeoHookean(youngs=3e5, poisson=0.3, density=1000.0, damping=0.002)
    fine = sp.shapes.sphere(radius=0.1, edge_length=0.05)
    body = sp.Body("ball", fine, stiff, position=normal * (HEIGHT + 5e-4))
    scene = sp.Scene([body], rails(kind, tilt, friction=1.0))
    # With ten substeps, XPBD reports the ball as softened.
    used = sp.XPBD() if solver == "xpbd" else SOLVERS[solver]
    frames = list(sp.simulate(scene, used, 1 / 60, steps))
    last = frames[-10:]  # the ball is a polyhedron, which hops over its edges
    spins, speeds = [], []
    for frame in last:
        x, v = frame.positions["ball"], frame.velocities["ball"]
        r, u = x - x.mean(axis=0), v - v.mean(axis=0)
        inertia = np.einsum("ij,ij->", r, r) * np.eye(3) - r.T @ r
        spins.append(np.linalg.solve(inertia, np.cross(r, u).sum(axis=0))[0])
        speeds.append(v.mean(axis=0) @ along)
    speed, height = np.mean(speeds), 0.1 * HEIGHT / 0.6
    sliding = 9.81 * np.sin(tilt) * np.mean([frame.time for frame in last])
    rolling = sliding / (1.0 + 0.4 * (0.1 / height) ** 2)
    assert 0.6 * rolling < speed < 0.8 * sliding
    assert np.mean(spins) * height == pytest.approx(speed, rel=0.35)  # pressed flat where it is held


@pytest.mark.parametrize("solver", SOLVERS)
def test_turning_rollers_carry_a_plate(solver):
    """Friction carries a plate at the surface speed of the rollers below it."""
    rollers = [
        sp.obstacles.Cylinder(
            start=(x, -0.2, -1),
            end=(x, -0.2, 1),
            radius=0.2,
            friction=0.6,
            motion=sp.Keyframes([0, 10], angles=[0, 20.0], axis=(0, 0, -1), pivot=(x, -0.2, 0)),
        )
        for x in (-0.15, 0.15)
    ]
    plate = sp.shapes.box((0.8, 0.05, 0.2), (16, 1, 4))
    scene = sp.Scene([sp.Body("plate", plate, JELLY, position=(0, 0.026, 0))], rollers)
    speeds = [f.velocities["plate"][:, 0].mean() for f in sp.simulate(scene, SOLVERS[solver], 1 / 100, 25)]
    assert max(speeds) == pytest.approx(0.4, rel=0.1)  # later it bends, and touches the rollers beside their tops
    assert min(speeds[8:]) > 0.28


def test_thin_bars_support_a_coarse_body_in_xpbd():
    """No vertex of the body is near the bar: points of its axis support the faces."""
    soft = sp.EdgesAndVolume(edge_compliance=5e-5, volume_compliance=0.0, density=1000, damping=0.01)
    for kind in (sp.obstacles.Capsule, sp.obstacles.Cylinder):
        bar = kind(start=(-1, -0.03, 0.02), end=(1, -0.03, 0.02), radius=0.03)
        body = sp.Body(
            "b", sp.shapes.box((0.4, 0.1, 0.4), (1, 1, 1)), soft, position=(0, 0.055, 0), velocity=(0, -1, 0)
        )
        frame = list(sp.simulate(sp.Scene([body], [bar], gravity=(0, 0, 0)), sp.XPBD(), 1 / 60, 15))[-1]
        assert frame.positions["b"][:, 1].mean() > 0.03
