"""The test for intersections after a step: for every status that allows a next step, and beside seams that touch."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.model.state import Status
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.contact.model import contact_model
from supple.solvers.implicit.energies.elasticity import elasticity_of
from supple.solvers.implicit.newton.minimize import Outcome
from supple.solvers.implicit.newton.objective import Model
from supple.solvers.implicit.stepping.contact_step import ContactStep

SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)
CUBE = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))


def model_of(stitched):
    """Two cubes above each other, stitched face to face or 5 cm apart, and a third one beside them."""
    gap = 0.0 if stitched else 0.05
    bodies = [
        sp.Body("low", CUBE, SOFT),
        sp.Body("high", CUBE, SOFT, position=(0, 0.1 + gap, 0)),
        sp.Body("beside", CUBE, SOFT, position=(0.2, 0, 0)),
    ]
    seams = [sp.SoftVertexTriangleStitch("high", "low", max_distance=1e-6, youngs=1e5, poisson=0.3)] if stitched else []
    scene = sp.Scene(bodies, stitches=seams)
    system = build_system(scene)
    model = contact_model(system, sp.IPCContact(), elasticity_of(system).material.mu)
    return model, initial_state(scene).positions, system


def moved(x, system, body, by):
    part = next(part for part in system.bodies if part.name == body)
    x = x.copy()
    x[part.vertices] += by
    return x


@pytest.mark.parametrize("stitched", [False, True])
@pytest.mark.parametrize("status", [Status.CONVERGED, Status.ITERATION_LIMIT])
def test_a_step_that_ends_with_an_intersection_fails(stitched, status):
    model, x, system = model_of(stitched)
    step = ContactStep(model, x, (0.0, 0.01), 1.0)

    def verified(end):
        return step.verified(Outcome(status, Model(end, 0.0, 0.0, np.zeros_like(end))))

    assert verified(x).status is status
    through = verified(moved(x, system, "beside", (-0.15, 0.01, 0.02)))
    assert through.status is Status.LINE_SEARCH_FAILED
    assert "intersect" in through.message


def test_a_seam_may_touch_and_cross_but_what_is_stitched_may_not_cross_elsewhere():
    model, x, system = model_of(True)
    assert not model.collisions.intersect(moved(x, system, "high", (0.0, -1e-3, 0.0)))
    assert not model.collisions.intersect(moved(x, system, "high", (0.0, 2e-3, 0.0)))
    assert model.collisions.intersect(moved(x, system, "high", (0.0, -0.07, 0.0)))


def test_a_step_without_contact_is_not_tested():
    _, x, _ = model_of(False)
    outcome = Outcome(Status.ITERATION_LIMIT, Model(x, 0.0, 0.0, np.zeros_like(x)))
    step = ContactStep(None, x, (0.0, 0.01), 1.0)
    assert replace(step).verified(outcome) is outcome
