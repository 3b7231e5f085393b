"""How fast the material around a vertex responds to its displacement, and which share of a contact's force is kept.

The force of a contact in one substep predicts that of the next one where the elastic constraints resolve the motion
of single vertices: where kappa = h^2 k / m is well below one, with k the stiffness that a vertex feels. There, all of
it is kept, and contact transmits the loads that the material carries. Where kappa is large, the elastic constraints
respond with less than the true force, a kept force follows the motion with a delay of kappa substeps, and a delayed
spring gains energy. So the share that is kept is 1 / (1 + kappa), which bounds the delay to a quarter of a substep.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System


def response_rates(system: System) -> NDArray[np.float64]:
    """(n,) k / m of every vertex [1/s^2], with k = sum (lam + 2 mu) V |b|^2 over its tets, triangles
    of shells with the modulus of plane stress, and edges of rods; inf without an energy.

    Those of rigid bodies are zero: nothing yields between their points and their masses.
    """
    b = np.concatenate([-system.rest_shape_inverse.sum(axis=1, keepdims=True), system.rest_shape_inverse], axis=1)
    stiffness = np.zeros(len(system.tets))
    for part in system.bodies:
        if part.rigid or not len(system.tets[part.tets]):
            continue
        material = part.body.material.per_tet(part.tets.stop - part.tets.start)
        modulus = material.lam + 2.0 * material.mu
        stiffness[part.tets] = np.where(modulus > 0.0, modulus, np.inf)
    each = (stiffness * system.rest_volumes)[:, None] * np.einsum("tnj,tnj->tn", b, b)
    sums = np.bincount(system.tets.ravel(), weights=each.ravel(), minlength=len(system.masses))
    if system.shells is not None:
        shells = system.shells
        sums = sums + np.bincount(shells.triangles.ravel(), weights=shells.stiffness.ravel(), minlength=len(sums))
    if system.rods is not None:
        each = np.repeat(system.rods.section, 4)
        sums = sums + np.bincount(system.rods.nodes.ravel(), weights=each, minlength=len(sums))
    return np.where(system.inverse_masses > 0.0, sums, 0.0) * system.inverse_masses
