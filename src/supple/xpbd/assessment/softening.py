"""How much softer than its material a body is at a length of the substep, estimated ahead of the simulation.

A tet starts its projection from positions that its neighbours have already changed in the same sweep. The error of the
stiffness is of the order of h^2 w^2, with w the frequency at which a tet alone oscillates. For its shear, w^2 is
2 mu V k, with k the largest eigenvalue of sum w_i b_i b_i^T (w_i the inverse masses of its vertices, b_i its shape
gradients); the first Lamé parameter adds to it. Over beams of 2 to 6 cells across, nu = 0.3 to 0.49, the static sag
exceeds the converged one by at most

    FACTOR h^2 <2 V k (lam_L + mu / 2)>

with the mean over the volume; it is within 15 % of this for the coarsest beams at nu = 0.45 and 0.49, and several times
smaller for fine meshes at nu = 0.3 (docs/xpbd.md). For `EdgesAndVolume`, the mean of (w_1 + w_2) / compliance over the
edges stands for the bracket; hard constraints and rigid bodies have no
stiffness that could be compared.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.material import Elastic
from supple.system import BodyRange, System

FACTOR = 0.14


class Softening:
    """The estimates for every body of a system.

    Attributes
    ----------
    names : of the bodies; rates : (b,) the error of a body's stiffness is its rate times h^2 [1/s^2]
    """

    def __init__(self, system: System) -> None:
        self.names = [part.name for part in system.bodies]
        self.rates = FACTOR * np.array([_mean_square_frequency(system, part) for part in system.bodies])

    def shares(self, h: float) -> NDArray[np.float64]:
        """(b,) the share of its stiffness that each body lacks at substeps of h [s]."""
        error = self.rates * h**2
        return error / (1.0 + error)

    def by_body(self, h: float) -> dict[str, float]:
        """The shares by the names of the bodies."""
        return dict(zip(self.names, self.shares(h).tolist(), strict=True))

    def substeps(self, dt: float, accuracy: float) -> tuple[int, str]:
        """How many substeps keep every body's stiffness within `accuracy`, and which body needs them."""
        worst = int(self.rates.argmax())
        share = accuracy / (1.0 - accuracy)
        return max(1, math.ceil(dt * math.sqrt(float(self.rates[worst]) / share) - 1e-9)), self.names[worst]


def _mean_square_frequency(system: System, part: BodyRange) -> float:
    material, w = part.body.material, system.inverse_masses
    if isinstance(material, EdgesAndVolume):
        if material.edge_compliance == 0.0:
            return 0.0
        return float(w[system.edges[part.edges]].sum(axis=1).mean()) / material.edge_compliance
    if part.rigid or not isinstance(material, Elastic):
        return 0.0
    volumes, Dm_inv = system.rest_volumes[part.tets], system.rest_shape_inverse[part.tets]
    b = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
    curvatures = np.linalg.eigvalsh(np.einsum("tn,tni,tnj->tij", w[system.tets[part.tets]], b, b))[:, 2]
    each = material.per_tet(len(volumes))
    # lam of the stable Neo-Hookean energy is lam_L + mu.
    squares = 2.0 * volumes * np.maximum(curvatures, 0.0) * (each.lam - 0.5 * each.mu)
    return float(squares @ volumes) / float(volumes.sum())
