"""Contacts that keep their weights are those that a new evaluation with these weights finds."""

import numpy as np
import pytest

import supple as sp
from supple.contact.mesh.obstacles import obstacle_positions
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.contact.collisions import Collisions
from supple.solvers.implicit.contact.model import contact_model

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000.0)


@pytest.mark.parametrize("seed", range(12))
def test_contacts_are_those_of_the_weights_that_they_keep(seed):
    rng = np.random.default_rng(seed)
    cube = sp.shapes.box((1, 1, 1), (2, 2, 2))
    turned = rng.normal(size=3) * (seed % 3)  # seeds 0, 3, ...: faces on each other
    shift = 0.5 * rng.normal(size=2)
    bodies = [
        sp.Body("lower", cube, RUBBER, position=(0, 0.6, 0)),
        sp.Body("upper", cube, RUBBER, position=(shift[0], 2.3, shift[1]), rotation=tuple(turned)),
    ]
    scene = sp.Scene(bodies, [sp.HalfSpace()])
    model = contact_model(build_system(scene), sp.IPCContact(), np.full(96, 1e5))
    x = np.concatenate([initial_state(scene).positions, obstacle_positions(model.obstacles, 0.0)])
    upper = model.system.bodies[1].vertices
    x[upper, 1] -= x[upper, 1].min() - 1.2
    for _ in range(3):
        collisions = Collisions(model.mesh, model.obstacles, 0.25)
        for place in (x, x + 0.02 * rng.normal(size=(len(x), 1)), x - [0, 0.03, 0]):
            collisions.keep_weights(place)
            kept, again = collisions.at(place), collisions.at(place.copy())
            assert len(kept.kinds)
            for one, other in zip(kept, again, strict=True):
                np.testing.assert_array_equal(one, other)
        x = x + 0.01 * rng.normal(size=x.shape)
