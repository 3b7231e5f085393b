"""Rods in `Implicit`: closed forms of beams and rings, and contact at their radius."""

import numpy as np
import pytest
from tests.derivatives import hessian_product
from tests.ropes import line, rope

import supple as sp
from supple.solvers.implicit.energies.rods import RodEnergy

STATIC = sp.Implicit(integrator="static", contact=None)
NO_TETS = np.zeros((0, 4), dtype=np.int32)


def at_rest(rod, force, solver=STATIC):
    """Where the last point of the line is, with its first edge clamped and a force on it."""
    last = len(np.asarray(rod.centerline)) - 1
    scene = sp.Scene(
        [rod], gravity=(0, 0, 0), pins=[sp.Pin("rod", [0, 1])], forces=[sp.Force("rod", [last], force=force)]
    )
    *_, frame = sp.simulate(scene, solver, dt=1.0, steps=1)
    assert frame.report.status == "converged"
    return frame.positions["rod"][last]


@pytest.mark.parametrize(
    ("load", "down", "along", "share"), [(0.01, 0.01 / 3.0, 1.0, 0.002), (10.0, 0.8106, 0.4450, 0.002)]
)
@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_cantilever_bends_as_euler_and_the_elastica_whatever_the_place_of_its_material_points(
    load, down, along, share, turn
):
    # Bisshop, Drucker, "Large deflection of cantilever beams" (1945): P L^2 / (E I) = 10.
    x = np.concatenate([[-1.0 / 20], np.linspace(0.0, 1.0, 21)])
    material = sp.RodMaterial(youngs=1e7, poisson=0.3, radius=0.005)
    rod = sp.Rod("rod", np.column_stack([x, 0 * x, 0 * x]), material)
    P = load * material.bending_stiffness
    tip = at_rest(rod, (0.0, -P * np.cos(turn), P * np.sin(turn)))
    assert -tip[1] * np.cos(turn) + tip[2] * np.sin(turn) == pytest.approx(down, rel=0.005)
    assert tip[0] == pytest.approx(along, abs=share)


def test_arc_of_45_degrees_bends_and_twists_as_that_of_bathe():
    # Bathe, Bolourchi (1979): radius 100 in, a square of 1 in, E = 1e7 psi, nu = 0, 600 lb across; their tip moves by
    # 13.4, 23.5 and 53.4 in.
    angles = np.concatenate([[-np.pi / 64], np.linspace(0.0, np.pi / 4, 17)])
    points = 100.0 * np.column_stack([np.sin(angles), 1.0 - np.cos(angles), 0.0 * angles])
    material = sp.RodMaterial(youngs=1e7, poisson=0.0, radius=1.0 / np.sqrt(np.pi), bending=1e7 / 12.0)
    moved = at_rest(sp.Rod("rod", points, material), (0.0, 0.0, 600.0)) - points[-1]
    np.testing.assert_allclose(moved, [-23.5, -13.4, 53.4], rtol=0.02)


@pytest.mark.parametrize(("share", "stable"), [(0.99, True), (1.01, False)])
def test_a_twisted_ring_is_stable_up_to_the_twist_of_michell(share, stable):
    # Michell (1889): a straight rod that is bent to a ring buckles at a twist of 2 pi sqrt(3) B/C.
    count, nu = 30, 0.3
    angles = 2.0 * np.pi * np.arange(count) / count
    edges = np.column_stack([np.arange(count), (np.arange(count) + 1) % count])
    length, twist = 2.0 * count * np.sin(np.pi / count), share * 2.0 * np.pi * np.sqrt(3.0) * (1.0 + nu)
    material = sp.RodMaterial(youngs=1e7, poisson=nu, radius=0.005)
    points = np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    rod = sp.Rod("ring", points, material, edges=edges, rest="straight", twist=twist / length)
    x, energy = rod.points, RodEnergy(rod.elements(np.zeros(count, dtype=bool)))
    units = np.eye(x.size).reshape(-1, *x.shape)
    hessian = np.array([hessian_product(energy, NO_TETS, x, unit).ravel() for unit in units])
    lowest = np.linalg.eigvalsh(hessian)[0] / material.bending_stiffness
    assert (lowest > -1e-6) == stable


def run(scene, path, steps=25, **more):
    for frame in sp.simulate(scene, sp.Implicit(**more), dt=1 / 60, steps=steps, sinks=[sp.Recorder(path)]):
        assert frame.report.status == "converged"
    report = sp.check_recording(path)
    assert report.ok, str(report)
    return frame


def test_rods_lie_on_a_floor_and_on_each_other_at_their_radius(tmp_path):
    bodies = [
        rope("below", line(10, 0.2), position=(0, 0.006, 0)),
        rope("above", line(10, 0.2, 2), position=(0, 0.017, 0)),
    ]
    scene = sp.Scene(bodies, obstacles=[sp.obstacles.HalfSpace(friction=0.5)])
    frame = run(scene, tmp_path / "rods.h5")
    low, high = (frame.positions[name][:11] for name in ("below", "above"))
    assert low[:, 1].min() == pytest.approx(0.005, abs=4e-4)
    assert high[5, 1] - low[5, 1] == pytest.approx(0.01, abs=4e-4)


def test_a_fast_rod_does_not_pass_another_and_the_check_sees_where_one_does(tmp_path):
    bodies = [
        rope("held", line(10, 0.2)),
        rope("fast", line(11, 0.2, 2), position=(0.003, 0.1, 0), velocity=(0, -20.0, 0)),
    ]
    pins = [sp.Pin("held", [0, 1, 9, 10])]
    frame = run(sp.Scene(bodies, pins=pins), tmp_path / "rods.h5", steps=6)
    at = frame.positions
    assert at["fast"][:12][np.abs(at["fast"][:12, 0]) < 0.05][:, 1].max() > at["held"][4:7, 1].min() - 0.02
    for _ in sp.simulate(
        sp.Scene(bodies, pins=pins), sp.Implicit(contact=None), 1 / 60, 3, sinks=[sp.Recorder(tmp_path / "through.h5")]
    ):
        pass
    assert [one.name for one in sp.check_recording(tmp_path / "through.h5").failures] == ["tunnelling"]


def test_momentum_and_spin_of_a_free_rod_are_kept(tmp_path):
    rod = rope("rod", line(8, 0.2), angular_velocity=(3.0, 5.0, 2.0), velocity=(1.0, 0.0, 0.0))
    scene = sp.Scene([rod], gravity=(0, 0, 0))
    path = tmp_path / "rod.h5"
    run(scene, path, 30, integrator="bdf2")
    for name, share in (("linear_momentum", 1e-9), ("angular_momentum", 0.02)):  # BDF2 begins with backward Euler
        series = sp.read_recording(path).series(name)
        np.testing.assert_allclose(series[-1], series[0], atol=share * np.linalg.norm(series[0]))


def overhand(radius=0.004, count=40):
    """An open knot, as points at equal distances, and the direction from its begin to its end."""
    s = 2.0 * np.linspace(-1.12, 1.12, 400)
    x = np.column_stack([s**3 - 3 * s, s**4 - 4 * s**2, s**5 / 5 - 2 * s]) * [0.05, 0.03, 0.03]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
    places = np.linspace(0.0, along[-1], count + 1)
    points = np.column_stack([np.interp(places, along, column) for column in x.T])
    return points, (points[-1] - points[0]) / np.linalg.norm(points[-1] - points[0])


def test_a_knot_that_is_pulled_tightens_and_does_not_pass_through_itself(tmp_path):
    points, way = overhand()
    n, length = len(points) - 1, float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    pull = 0.5 * (0.92 * length - (points[-1] - points[0]) @ way)
    material = sp.RodMaterial(youngs=1e6, poisson=0.4, radius=0.004, density=1100.0, damping=0.01)
    pins = [
        sp.Pin("rope", rows, motion=sp.Keyframes([0, 1], [[0, 0, 0], list(sign * pull * way)]))
        for rows, sign in (([0, 1], -1.0), ([n - 1, n], 1.0))
    ]
    scene = sp.Scene([sp.Rod("rope", points, material, friction=0.2)], gravity=(0, 0, 0), pins=pins)
    frame = run(scene, tmp_path / "knot.h5", steps=60)
    x = frame.positions["rope"][: n + 1]
    widths = [np.linalg.norm(y - y[0] - np.outer((y - y[0]) @ way, way), axis=1).max() for y in (points, x)]
    assert widths[0] > 0.2
    assert 0.008 < widths[1] < 0.1  # a rope that had passed through itself would be straight
    assert frame.report.min_distance is not None
