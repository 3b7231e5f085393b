"""Steps along a direction, on an energy of one variable that is known."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection
from supple.solvers.implicit.newton.line_search import Jumps, extended, search
from supple.solvers.implicit.newton.objective import Objective
from supple.solvers.implicit.step_limits import StepLimit


@dataclass(frozen=True, eq=False)
class Quartic(Potential):
    """u^4/4 - u^2/2 of the first coordinate u: minima at -1 and 1, a maximum at 0."""

    projection = Projection.RELEASED_FIRST

    def value(self, x):
        u = x[0, 0]
        return u**4 / 4 - u**2 / 2

    def add_gradient(self, x, out):
        out[0, 0] += x[0, 0] ** 3 - x[0, 0]

    def add_hessian(self, x, out: HessianBlocks, project: bool):
        curvature = 3 * x[0, 0] ** 2 - 1
        out.vertices[0, 0, 0] += max(curvature, 0.0) if project else curvature


@dataclass(frozen=True)
class Where:
    """Admits states whose first coordinate passes a test, and steps down to `lowest`."""

    passes: Callable[[float], bool]
    lowest: float = -np.inf

    def allows(self, x):
        return self.passes(x[0, 0])

    def largest_step(self, x, direction):
        return StepLimit(min(1.0, float((self.lowest - x[0, 0]) / direction[0, 0])))


ANYWHERE = Where(lambda u: True)


def take(start: float, direction: float, largest: float = 1.0, states: Where = ANYWHERE, slope: float | None = None):
    objective, hessian = Objective([Quartic()]), HessianBlocks.zeros(0, 1)
    here = objective.model(np.array([[start, 0.0, 0.0]]), hessian)
    vector = np.array([[direction, 0.0, 0.0]])
    along = float((here.gradient * vector).sum()) if slope is None else slope
    before = hessian.vertices.copy()
    end, step, cuts = search(objective, here, vector, along, largest, states, Jumps())
    assert np.array_equal(hessian.vertices, before)  # trials need energies alone
    return end[0, 0], step, cuts


def test_a_good_step_is_taken_whole():
    end, step, cuts = take(0.5, 0.5)
    assert (end, step, cuts) == (1.0, 1.0, 0)


def test_a_step_too_long_is_halved_until_the_energy_falls():
    end, step, cuts = take(0.5, 8.0)
    assert cuts > 0
    assert step == 0.5**cuts
    assert abs(end) ** 4 / 4 - end**2 / 2 < 0.5**4 / 4 - 0.5**2 / 2


def test_the_first_length_is_the_largest_that_is_allowed():
    end, step, cuts = take(0.5, 0.5, largest=0.3)
    assert (end, step, cuts) == (pytest.approx(0.65), 0.3, 0)


def test_a_state_that_the_filter_rejects_is_not_the_end():
    end, step, cuts = take(0.5, 0.5, states=Where(lambda u: u < 0.7))
    assert (end, step, cuts) == (0.625, 0.25, 2)


def test_nothing_is_taken_where_no_state_is_admissible():
    end, step, _ = take(0.5, 0.5, states=Where(lambda u: False))
    assert (end, step) == (0.5, 0.0)


@pytest.mark.parametrize(("largest", "slope"), [(0.0, -1.0), (1.0, 0.0), (1.0, 1.0)])
def test_nothing_is_taken_uphill_or_where_no_length_is_allowed(largest: float, slope: float):
    end, step, cuts = take(0.5, 0.5, largest=largest, slope=slope)
    assert (end, step, cuts) == (0.5, 0.0, 0)


@dataclass(frozen=True, eq=False)
class Cliff(Quartic):
    """The same, and higher by a tenth from u = 0.5 on."""

    def value(self, x):
        return super().value(x) + (0.1 if x[0, 0] > 0.5 else 0.0)


def climb(energy: Potential, times: int) -> list[tuple[float, float, int]]:
    """Ends, lengths and cuts of searches from u = 0.5 on, of one minimization."""
    objective = Objective([energy])
    here = objective.model(np.array([[0.5, 0.0, 0.0]]), None)
    vector = np.array([[0.1, 0.0, 0.0]])
    slope, jumps = float((here.gradient * vector).sum()), Jumps()
    taken = [search(objective, here, vector, slope, 1.0, ANYWHERE, jumps) for _ in range(times)]
    return [(end[0, 0], step, cuts) for end, step, cuts in taken]


def test_a_jump_is_crossed_by_a_short_step_a_few_times():
    taken = climb(Cliff(), 6)
    assert taken[:5] == [(pytest.approx(0.5 + 0.1 / 16), 1 / 16, 4)] * 5
    assert taken[5][1] == 0.0


@dataclass(frozen=True, eq=False)
class Wall(Quartic):
    """The same, and a stiff spring from u = 0.5 on."""

    def value(self, x):
        return super().value(x) + 5e4 * max(x[0, 0] - 0.5, 0.0) ** 2

    def add_gradient(self, x, out):
        super().add_gradient(x, out)
        out[0, 0] += 1e5 * max(x[0, 0] - 0.5, 0.0)


def test_a_stiff_wall_is_no_jump():
    energy = Wall()
    ((end, _, cuts),) = climb(energy, 1)
    assert cuts > 4
    assert energy.value(np.array([[end, 0.0, 0.0]])) < energy.value(np.array([[0.5, 0.0, 0.0]]))


@dataclass(frozen=True, eq=False)
class Quadratic(Potential):
    """u^2 / 2, and higher by a tenth below `ledge`."""

    projection = Projection.UNNEEDED
    ledge: float = -np.inf

    def value(self, x):
        return x[0, 0] ** 2 / 2 + (0.1 if x[0, 0] < self.ledge else 0.0)

    def add_gradient(self, x, out):
        out[0, 0] += x[0, 0]

    def add_hessian(self, x, out: HessianBlocks, project: bool):
        out.vertices[0, 0, 0] += 1.0


def extend(stiffness: float, energy: Quadratic, states: Where = ANYWHERE) -> tuple[float, float]:
    """From u = 1, after a whole step of a model that is so many times as stiff as u^2 / 2."""
    objective = Objective([energy])
    here = objective.model(np.array([[1.0, 0.0, 0.0]]), None)
    vector = np.array([[-1.0 / stiffness, 0.0, 0.0]])
    end, step = extended(objective, here, vector, -1.0 / stiffness, here.positions + vector, states)
    return end[0, 0], step


@pytest.mark.parametrize(("stiffness", "wanted"), [(1.1, 1.0), (2.0, 2.0), (3.5, 3.5), (100.0, 4.0)])
def test_a_whole_step_of_a_model_that_is_too_stiff_is_made_longer(stiffness: float, wanted: float):
    end, step = extend(stiffness, Quadratic())
    assert step == pytest.approx(wanted, rel=1e-12)
    assert end == pytest.approx(1.0 - wanted / stiffness, abs=1e-12)


def test_longer_steps_keep_to_the_limits_and_lower_the_energy():
    assert extend(2.5, Quadratic(), Where(lambda u: True, lowest=0.3)) == pytest.approx((0.3, 1.75))
    assert extend(2.5, Quadratic(), Where(lambda u: u > 0.5)) == (0.6, 1.0)
    assert extend(1.5, Quadratic(ledge=0.3)) == pytest.approx((1.0 / 3.0, 1.0))
