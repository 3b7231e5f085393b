"""When a minimization is done, on given norms."""

import pytest

from supple.solvers.implicit.newton.convergence import Convergence

DONE = Convergence(step=1e-6, force=1e-4)


def test_a_long_direction_is_not_the_last():
    assert not DONE.is_short(1.1e-6)
    assert not DONE.is_reached(1.1e-6, extent=1.0, residual=0.0, contact=None)


def test_without_contact_a_short_direction_is_enough():
    assert DONE.is_short(1e-6)
    assert DONE.is_reached(1e-6, extent=1.0, residual=1e9, contact=None)


@pytest.mark.parametrize(("residual", "reached"), [(0.9e-3, True), (1.1e-3, False)])
def test_with_contact_the_forces_have_to_balance(residual: float, reached: bool):
    assert DONE.is_reached(1e-7, extent=1.0, residual=residual, contact=10.0) is reached


def test_with_contact_a_direction_lost_in_rounding_is_enough():
    assert DONE.is_reached(1e-14, extent=2.0, residual=1.0, contact=1.0)
    assert not DONE.is_reached(1e-14, extent=0.5, residual=1.0, contact=1.0)
