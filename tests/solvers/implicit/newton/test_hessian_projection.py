"""Which terms' Hessians are projected, from iteration to iteration."""

import pytest

from supple.solvers.implicit.energies.potential import Projection
from supple.solvers.implicit.newton.hessian_projection import ProjectedTerms, ProjectionPolicy


def after(*notes: tuple[bool, bool]) -> ProjectionPolicy:
    policy = ProjectionPolicy()
    for slow, touching in notes:
        policy.note(slow, touching)
    return policy


def test_fast_convergence_keeps_the_projection():
    assert after((False, True), (False, True)).now is ProjectedTerms.ALL


@pytest.mark.parametrize(("touching", "first"), [(True, ProjectedTerms.RELEASED_LAST), (False, ProjectedTerms.NONE)])
def test_slow_convergence_releases_the_terms_step_by_step(touching: bool, first: ProjectedTerms):
    assert after((True, touching)).now is first
    assert after((True, touching), (True, touching)).now is ProjectedTerms.NONE


def test_an_indefinite_hessian_is_tried_again_after_four_iterations_at_most():
    policy = ProjectionPolicy()
    waits = []
    for _ in range(5):
        count = 0
        while policy.now is ProjectedTerms.ALL:
            policy.note(slow=True, touching=False)
            count += 1
        waits.append(count)
        policy.step_back(touching=False)
    assert waits == [1, 2, 4, 4, 4]


def test_with_contact_the_terms_are_projected_again_step_by_step():
    policy = after((True, True), (True, True))
    policy.step_back(touching=True)
    assert policy.now is ProjectedTerms.RELEASED_LAST
    policy.step_back(touching=True)
    assert policy.now is ProjectedTerms.ALL


def test_terms_are_projected_by_their_declared_property():
    declared = (Projection.RELEASED_LAST, Projection.RELEASED_FIRST, Projection.UNNEEDED)
    assert [[terms.includes(projection) for projection in declared] for terms in ProjectedTerms] == [
        [True, True, False],
        [True, False, False],
        [False, False, False],
    ]
