"""Friction of contacts whose normal forces, normals and closest points are those of an earlier state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.contact.barrier.friction_energy import Slips
from supple.contact.features.contacts import Contacts
from supple.contact.features.pair_geometry import EDGE_EDGE


def lagged_slips(
    contacts: Contacts,
    forces: NDArray[np.float64],
    start: NDArray[np.float64],
    owner: NDArray[np.int32],
    coefficients: NDArray[np.float64],
) -> Slips:
    """Of the contacts that have friction.

    Parameters
    ----------
    forces : (k,) normal forces [N]; start : (s, 3) where the step began [m]
    owner : (s,) of the points; coefficients : (p, p) of friction between owners
    """
    first, second = sides(contacts)
    mu = coefficients[owner[first], owner[second]]
    rough = np.flatnonzero(mu * forces > 0.0)
    c, points = contacts.coefficients[rough], contacts.points[rough]
    return Slips(
        contacts.kinds[rough],
        points,
        c,
        contacts.vectors[rough] / contacts.distances[rough, None],
        np.einsum("ki,kij->kj", c, start[points]),  # points that a kind does not have have the coefficient 0
        mu[rough] * forces[rough],
    )


def sides(contacts: Contacts) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """A point (k,) on the first side of each contact, and one on the second."""
    return contacts.points[:, 0], np.where(contacts.kinds == EDGE_EDGE, contacts.points[:, 2], contacts.points[:, 1])
