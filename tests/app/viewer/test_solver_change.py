"""A change from XPBD to the implicit solver during a run, with vertices moved out of obstacles."""

import dataclasses

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.describe import describe, measures
from supple.app.viewer.engine.scene.changes import change
from supple.app.viewer.engine.scene.clearance import moved_out, signed_distance
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.protocol.commands import SetSolver
from supple.errors import SuppleError

from .conftest import run, small_source


class TestSolverChange:
    """XPBD allows contact at distance zero and small overlaps, the implicit solver does not."""

    def test_a_body_at_rest_on_the_floor_continues(self):
        live = LiveScene(small_source())
        for _ in range(90):
            run(live, 1)
            live.state = dataclasses.replace(live.state, velocities=0.9 * live.state.velocities)
        assert measures(live).min_distance < 1e-4
        before = live.body_positions("cube").copy()
        change(SetSolver("implicit"), live)
        assert np.abs(live.body_positions("cube") - before).max() < 1e-3
        run(live, 2)
        assert measures(live).min_distance > 0.0
        assert measures(live).contacts > 0
        change(SetSolver("xpbd"), live)
        run(live, 2)

    @pytest.mark.parametrize("kind", ["xpbd", "implicit"])
    def test_both_solvers_report_the_number_of_contacts(self, kind):
        live = LiveScene(small_source())
        change(SetSolver(kind), live)
        run(live, 2)
        assert measures(live).contacts == 0
        for _ in range(60):
            run(live, 1)
            if measures(live).contacts:
                break
        assert measures(live).contacts >= 4  # the corners of the cube, on the floor
        if kind == "implicit":
            assert measures(live).contacts == len(live.report.contacts())

    def test_intersecting_bodies_are_refused_and_the_old_solver_continues(self):
        live = LiveScene(small_source(pins=[]))
        cube, block = (part.vertices for part in live.system.bodies)
        x = live.state.positions.copy()
        x[block] += x[cube].mean(axis=0) - x[block].mean(axis=0)
        live.state = dataclasses.replace(live.state, positions=x)
        with pytest.raises(SuppleError, match=r"'cube'.*'block'|'block'.*'cube'"):
            change(SetSolver("implicit"), live)
        assert describe(live).solver == "xpbd"
        assert np.array_equal(live.state.positions, x)
        live.step()
        assert live.frame == 1


@pytest.mark.parametrize(
    ("obstacle", "point"),
    [
        (sp.HalfSpace(), (0.3, -0.2, 0.1)),
        (sp.obstacles.Sphere(radius=0.5), (0.1, 0.2, 0.0)),
        (sp.obstacles.Sphere(radius=0.5, inside=True), (0.9, 0.2, 0.0)),
        (sp.obstacles.Box(size=(1, 1, 1)), (0.45, 0.1, 0.0)),
        (sp.obstacles.Box(size=(1, 1, 1), rotation=(0, 0, 0.5)), (0.3, 0.3, 0.3)),
        (sp.obstacles.Box(size=(1, 1, 1), inside=True), (0.6, 0.7, 0.0)),
    ],
)
def test_points_in_an_obstacle_are_moved_out_along_the_normal(obstacle, point):
    before = np.array([point, (0.0, 9.0, 0.0) if not getattr(obstacle, "inside", False) else (0.0, 0.0, 0.0)])
    depth = -signed_distance(obstacle, before, 0.0)[0][0]
    assert depth > 0.0
    after = moved_out(obstacle, before, 0.0, 0.01)
    assert signed_distance(obstacle, after, 0.0)[0][0] == pytest.approx(0.01, rel=0.02)
    if not (isinstance(obstacle, sp.obstacles.Box) and obstacle.inside):  # from a corner, points move along two faces
        assert np.linalg.norm(after[0] - before[0]) == pytest.approx(depth + 0.01, rel=0.02)
    assert np.array_equal(after[1], before[1])
