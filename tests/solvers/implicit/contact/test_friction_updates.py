"""When friction takes the normal forces anew: later ones may differ little from those of a state out of balance."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from supple.solvers.implicit.stepping.contact_step import ContactStep


class Push:
    """A barrier whose gradient is x itself."""

    def add_gradient(self, x, out):
        out += x


def outdated(now, taken_at, unbalanced, wanted=None):
    """Whether forces that are `now` times those of the last update are too far away from them."""
    scales = SimpleNamespace(stiffness=1.0, dhat=1.0)
    collisions = SimpleNamespace(forget_weights=lambda: None)
    model = SimpleNamespace(
        coefficients=np.ones((1, 1)), friction_iterations=wanted, scales=scales, collisions=collisions
    )
    x = np.ones((1, 3))
    step: Any = ContactStep(model, x, (0.0, 1.0), 1.0)  # pyright: ignore[reportArgumentType]
    step.barrier, step.normal_gradient, step.unbalanced = Push(), x, taken_at
    return step.friction_is_outdated(now * x, unbalanced)


@pytest.mark.parametrize(
    ("change", "taken_at", "unbalanced", "expected"),
    [
        (1.05, 0.0, 0.0, False),
        (1.2, 0.0, 0.0, True),
        (1.05, 0.05, 0.05, False),
        (1.2, 0.05, 0.05, True),
        (1.05, 0.05, 1e-3, True),
        (1.005, 0.05, 1e-3, False),
    ],
)
def test_forces_of_a_state_out_of_balance_are_taken_anew_where_they_differ_little(
    change, taken_at, unbalanced, expected
):
    assert outdated(change, taken_at, unbalanced) is expected


def test_a_number_of_updates_counts_only_states_in_balance():
    assert not outdated(2.0, 0.0, 0.05, wanted=3)
    assert outdated(1.0, 0.0, 1e-3, wanted=3)
    assert not outdated(2.0, 0.0, 1e-3, wanted=1)
