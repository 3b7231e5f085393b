"""Fields compared with closed forms, and colors compared with fields."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.messages import frame_of
from supple.materials.elastic_tets.laws import TetLaws, joined_materials
from supple.results.view.fields import FIELDS, Limits, Range

J, MISES, ENERGY = FIELDS.values()


@pytest.fixture
def stretched(fake):
    """Body 0 stretched to twice its length in x, body 1 at rest; body 0 made of StVK, body 1 of something unknown."""
    x = fake.snapshot.positions.copy()
    model = frame_of(fake.snapshot).model
    first = model.bodies[0]
    count = first.tets.stop - first.tets.start
    known = sp.StVenantKirchhoff(youngs=1000.0, poisson=0.0).per_tet(count)
    other = sp.EdgesAndVolume().per_tet(len(model.tets) - count)
    volumes = 1.0 / (6.0 * np.linalg.det(model.rest_shape_inverse))
    laws = TetLaws(model.tets, model.rest_shape_inverse, volumes, joined_materials([known, other]))
    x[first.vertices] *= [2.0, 1.0, 1.0]
    frame = frame_of(fake.show(positions=x))
    return replace(frame, laws=laws)


def test_fields_of_a_stretched_body(stretched):
    first, other = (body.tets for body in stretched.model.bodies)
    np.testing.assert_allclose(J.values(stretched)[first], 2.0)
    np.testing.assert_allclose(J.values(stretched)[other], 1.0)
    # E = (F^T F - I) / 2 has 3/2 in x only; with nu = 0, psi = mu |E|^2 with mu = 500, and P = F S = 2 * 2 mu E.
    np.testing.assert_allclose(ENERGY.values(stretched)[first], 500.0 * 1.5**2)
    # sigma = P F^T / J = 2 * 1500 * 2 / 2 in x only: its von Mises stress is itself.
    np.testing.assert_allclose(MISES.values(stretched)[first], 3000.0)
    for unknown in (ENERGY, MISES):
        assert np.isnan(unknown.values(stretched)[other]).all()


def test_values_of_the_simulation_are_used(stretched):
    values = np.arange(float(len(stretched.model.tets)))
    np.testing.assert_array_equal(MISES.values(replace(stretched, tet_values={"von_mises": values})), values)


def test_ends_of_scales_are_round_and_stable():
    limits = Limits(MISES, Range())
    assert limits.follow(np.full(10, 37.0)) == (0.0, 50.0)
    assert limits.follow(np.full(10, 20.0)) == (0.0, 50.0)
    assert limits.follow(np.full(10, 3.0)) == (0.0, 5.0)
    assert limits.follow(np.full(10, 600.0)) == (0.0, 1000.0)
    assert limits.follow(np.full(10, np.nan)) is None
    assert Limits(J, Range()).follow(np.array([0.9, 1.0, 1.07])) == (0.9, 1.1)
    # One value of a hundred is extreme.
    values = np.append(np.full(99, 18.0), 900.0)
    assert Limits(MISES, Range(0.98)).follow(values) == (0.0, 20.0)
    assert Limits(MISES, Range(1.0)).follow(values) == (0.0, 1000.0)
    assert Limits(MISES, Range(fixed=(5.0, 70.0))).follow(values) == (5.0, 70.0)
