"""Which terms are modelled convex, from iteration to iteration."""

import pytest

from supple.implicit.newton.hessian_projection import Convexity, ConvexityChoice


def after(*notes: tuple[bool, bool]) -> ConvexityChoice:
    choice = ConvexityChoice()
    for slow, touching in notes:
        choice.note(slow, touching)
    return choice


def test_fast_convergence_keeps_the_convex_model():
    assert after((False, True), (False, True)).now is Convexity.ALL


@pytest.mark.parametrize(("touching", "first"), [(True, Convexity.CONTACT), (False, Convexity.NONE)])
def test_slow_convergence_gives_up_convexity_step_by_step(touching: bool, first: Convexity):
    assert after((True, touching)).now is first
    assert after((True, touching), (True, touching)).now is Convexity.NONE


def test_what_is_indefinite_is_tried_again_after_four_iterations_at_most():
    choice = ConvexityChoice()
    waits = []
    for _ in range(5):
        count = 0
        while choice.now is Convexity.ALL:
            choice.note(slow=True, touching=False)
            count += 1
        waits.append(count)
        choice.refuse(touching=False)
    assert waits == [1, 2, 4, 4, 4]


def test_with_contact_the_model_in_between_comes_back_first():
    choice = after((True, True), (True, True))
    choice.refuse(touching=True)
    assert choice.now is Convexity.CONTACT
    choice.refuse(touching=True)
    assert choice.now is Convexity.ALL


def test_terms_are_projected_by_their_label():
    labels = ("contact", "elasticity")
    assert [[kind.projects(label) for label in labels] for kind in Convexity] == [
        [True, True],
        [True, False],
        [False, False],
    ]
