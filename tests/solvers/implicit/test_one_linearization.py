"""`Implicit(max_iterations=1)`: one linearization a step, for real time."""

import numpy as np
import pytest

import supple as sp
from supple.mesh import shapes
from supple.model.state import State
from supple.runtime.threads import numba_threads
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.xpbd.assessment.surfaces import SurfaceCheck, crossings
from supple.solvers.xpbd.contact.search.surface import mean_edge_length

FLOOR = [sp.HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5)]


def details_of(frame: sp.Frame) -> ImplicitDetails:
    assert isinstance(frame.report.details, ImplicitDetails)
    return frame.report.details


def crossing(frame: sp.Frame) -> int:
    """How many triangles cross, by the exact test of the other solver."""
    check = SurfaceCheck(frame.system, sp.XPBD().contact, mean_edge_length(frame.system))
    return crossings(check.find(np.ascontiguousarray(frame.state.positions), frame.time))


def rubber(youngs: float = 1e5) -> sp.StableNeoHookean:
    return sp.StableNeoHookean(youngs=youngs, poisson=0.4, density=1000.0)


def cantilever() -> sp.Scene:
    mesh = shapes.box((1.0, 0.1, 0.1), (24, 2, 2))
    wall = np.flatnonzero(mesh.vertices[:, 0] < mesh.vertices[:, 0].min() + 1e-9)
    return sp.Scene([sp.Body("beam", mesh, rubber(1e6))], pins=[sp.Pin("beam", wall)])


def tower() -> sp.Scene:
    """Four balls above each other, off center."""
    ball = shapes.sphere(radius=0.03, edge_length=0.02)
    places = [(0.004, 0.04, -0.003), (-0.006, 0.115, 0.004), (0.005, 0.19, 0.006), (0.0, 0.265, -0.005)]
    return sp.Scene([sp.Body(f"ball {k}", ball, rubber(2e4), position=at) for k, at in enumerate(places)], FLOOR)


def head_on() -> sp.Scene:
    box = shapes.box((0.06, 0.06, 0.06), (3, 3, 3))
    left = sp.Body("left", box, rubber(), position=(-0.05, 0, 0), velocity=(8, 0, 0))
    right = sp.Body("right", box, rubber(), position=(0.05, 0.01, 0.005), velocity=(-8, 0, 0))
    return sp.Scene([left, right], gravity=(0, 0, 0))


def thrown_ring() -> sp.Scene:
    ring = shapes.torus(radius=0.018, tube_radius=0.007, edge_length=0.006)
    start = {"position": (0, 0.06, 0), "rotation": (1.2, 0, 0.3), "velocity": (0, -10, 0)}
    return sp.Scene([sp.Body("ring", ring, rubber(5e4), **start)], FLOOR)


def last(scene: sp.Scene, most: int, steps: int) -> sp.Frame:
    return list(sp.simulate(scene, sp.Implicit(max_iterations=most), 1 / 60, steps))[-1]


def test_a_beam_swings_as_with_the_whole_method():
    tips = []
    for most in (120, 1):
        frames = list(sp.simulate(cantilever(), sp.Implicit(max_iterations=most), 1 / 60, 30))
        assert all(details_of(frame).substeps == 1 for frame in frames)
        tips.append(np.array([frame.positions["beam"][:, 1].min() for frame in frames]))
    report = frames[5].report
    assert report.status == "linearized"
    assert report.status.can_go_on
    assert report.iterations == 1
    assert f"{details_of(frames[5]).unbalanced_force:.2e} N" in report.message
    assert np.abs(tips[1] - tips[0]).max() < 5e-3 * np.abs(tips[0]).max()


def test_a_spinning_bar_turns_as_with_the_whole_method():
    bar = sp.Body(
        "bar", shapes.box((0.2, 0.05, 0.05), (4, 1, 1)), rubber(), velocity=(1, 0, 0), angular_velocity=(0, 5, 0)
    )
    spins = []
    for most in (120, 1):
        frame = last(sp.Scene([bar], gravity=(0, 0, 0)), most, 30)
        spins.append(frame.report.angular_momentum[1])
        assert np.allclose(frame.report.linear_momentum, [0.5, 0, 0], atol=1e-12)
    assert spins[1] == pytest.approx(spins[0], rel=0.02)


@pytest.mark.parametrize("most", [1, 2])
@pytest.mark.parametrize("scene", [tower, head_on, thrown_ring])
def test_nothing_inverts_and_nothing_crosses(scene, most):
    scene, touched = scene(), False
    for frame in sp.simulate(scene, sp.Implicit(max_iterations=most), 1 / 60, 20):
        expected = ("crushed",) if frame.report.min_det_F < 0.05 else ("converged", "linearized")
        assert frame.report.status in expected, frame.report.message
        assert frame.report.min_det_F > 0.0
        assert frame.report.min_distance is None or frame.report.min_distance > 0.0
        assert crossing(frame) == 0
        if not scene.obstacles and (frame.report.details.contacts or not touched):  # each has 1.7 kg m/s at the start
            touched |= frame.report.details.contacts > 0
            assert np.abs(frame.report.linear_momentum).max() < 0.01
    if not scene.obstacles:
        assert touched
        # Bodies that do not touch are shortened on their own: a step longer by a thousandth leaves up to 0.18.
        assert np.abs(frame.report.linear_momentum).max() < 0.2


def test_a_tower_falls_to_the_floor_and_does_not_hang_at_its_first_contact():
    frames = list(sp.simulate(tower(), sp.Implicit(max_iterations=1), 1 / 60, 50))
    meeting = frames[4]  # the lowest balls are in contact, and the highest one still flies
    assert meeting.report.details.contacts > 0
    assert meeting.positions["ball 3"][:, 1].mean() == pytest.approx(0.265 - 9.81 / 3600 * 15, abs=1e-4)
    assert max(x[:, 1].mean() for x in frames[-1].positions.values()) < 0.1


@pytest.mark.parametrize("most", [1, 2, 3])
@pytest.mark.parametrize("friction", [0.6, 0.3])
def test_a_box_on_a_slope_follows_coulombs_law(friction, most):
    """On a slope of 26.565 degrees, after it has landed."""
    angle = np.arctan(0.5)
    normal, down = np.array([np.sin(angle), np.cos(angle), 0]), np.array([np.cos(angle), -np.sin(angle), 0])
    mesh = shapes.box((0.1, 0.05, 0.1), (3, 2, 3))
    box = sp.Body("box", mesh, rubber(1e6), position=tuple(0.026 * normal), rotation=(0, 0, -angle))
    scene = sp.Scene([box], [sp.HalfSpace(point=(0, 0, 0), normal=tuple(normal), friction=friction)])
    frames = list(sp.simulate(scene, sp.Implicit(max_iterations=most), 1 / 60, 50))
    speeds = np.array([frame.velocities["box"].mean(axis=0) @ down for frame in frames])
    if friction > np.tan(angle):
        assert abs(speeds[-1]) < 2e-3
    else:
        expected = 9.81 * (np.sin(angle) - friction * np.cos(angle)) / 3
        assert speeds[-1] - speeds[-21] == pytest.approx(expected, rel=0.02)
        way = np.linalg.norm(frames[-1].positions["box"].mean(axis=0) - frames[-21].positions["box"].mean(axis=0))
        work = sum(frame.report.details.work["friction"] for frame in frames[-20:])
        assert work == pytest.approx(-friction * 0.5 * 9.81 * np.cos(angle) * way, rel=0.02)


def test_a_step_searches_twice_at_most_and_solves_three_systems():
    """Four times after an impact: also along what collisions change, and where things may have passed each other."""
    details = [details_of(frame) for frame in sp.simulate(tower(), sp.Implicit(max_iterations=1), 1 / 60, 30)][1:]
    searches, systems = [each.searches for each in details], [each.linear_solves for each in details]
    assert max(searches) <= 4
    assert np.mean(searches) < 2.5
    assert 1 in systems[:3]  # in free fall
    assert 2 <= max(systems) <= 3


def test_a_body_at_rest_needs_no_search_and_one_system():
    box = sp.Body("box", shapes.box((0.06, 0.06, 0.06), (3, 3, 3)), rubber(), position=(0, 0.0301, 0))
    frames = list(sp.simulate(sp.Scene([box], FLOOR), sp.Implicit(max_iterations=1), 1 / 60, 40))
    assert all(details_of(frame).searches == 0 for frame in frames[-10:])
    assert all(details_of(frame).linear_solves <= 3 for frame in frames[-10:])


def test_a_drop_comes_to_rest_at_the_height_of_the_whole_method():
    box = sp.Body("box", shapes.box((0.06, 0.06, 0.06), (3, 3, 3)), rubber(), position=(0, 0.035, 0))
    ends = [last(sp.Scene([box], FLOOR), most, 60) for most in (120, 1)]
    assert ends[1].report.kinetic_energy < 1e-6
    assert ends[1].positions["box"][:, 1].mean() == pytest.approx(ends[0].positions["box"][:, 1].mean(), abs=2e-5)


def test_threads_and_a_start_from_a_state_do_not_change_a_bit():
    def states(steps: int, threads: int | None, start: State | None = None) -> list[State]:
        with numba_threads(threads):
            solver = sp.Implicit(max_iterations=1)
            return [frame.state for frame in sp.simulate(tower(), solver, 1 / 60, steps, start=start)]

    alone, together = states(16, 1), states(16, None)
    continued = states(8, 1, alone[7])
    for other in (together[-1], continued[-1]):
        np.testing.assert_array_equal(other.positions, alone[-1].positions)
        np.testing.assert_array_equal(other.velocities, alone[-1].velocities)
