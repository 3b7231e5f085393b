"""The part of the energy of quadratic tets that depends on their mean change of volume.

At the four points of a quadratic tet, nearly incompressible material makes four conditions of volume, and a mesh has
about as many of them as coordinates: it is too stiff. The energy of a tet is therefore

    sum_q V_q psi'(F_q) + V l U(J_m),    J_m = sum_q V_q J_q / V,

with psi' the energy density with its first Lamé parameter lam_L lowered by l, and l U the rest of its volume term. For
an affine motion this is the energy without a mean. With p = l U'(J_m), first derivatives are those of
sum_q V_q (psi'(F_q) + p J_q); second derivatives have, besides, l U'' / V times the product of the gradient of
sum_q V_q J_q with itself.

    l = (lam_L - 2 mu) (lam_L + mu) / lam_L    where lam_L > 2 mu (Poisson's ratio above 1/3), else 0,

lowers lam_L to a value between mu and 2 mu. In the limit of incompressible material there is one pressure in each tet
(P2/P0), a stable pair.

Sources: Nagtegaal, Parks, Rice, "On numerically accurate finite element solutions in the fully plastic range" (1974)
for the mean; Boffi, Brezzi, Fortin, "Mixed Finite Element Methods and Applications" (2013), section 8.4, for the pair.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.materials.isotropic import rest_lame_parameters, volume_term
from supple.materials.kinds import STRETCH_ENERGIES, has_volume_term
from supple.materials.per_tet import BY_LAW, TetMaterial
from supple.materials.stretch_energies import stable_neo_hookean
from supple.runtime.kernel_cache import njit

_SQUARED = STRETCH_ENERGIES.index(stable_neo_hookean.FUNCTIONS)  # U of laws with a bulk modulus


@dataclass(frozen=True, eq=False)
class MeanVolumes:
    """The terms V l U(J_m) of k tets.

    Attributes
    ----------
    kind : (k,) of U; share : (k,) l [Pa]; volumes : (k, s) of the points of each [m^3]
    """

    kind: NDArray[np.int32]
    share: NDArray[np.float64]
    volumes: NDArray[np.float64]

    def states(self, J: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """(k,) energies [J], pressures p [Pa] and l U'' / V [Pa/m^3], of determinants J (k, s) at the points."""
        energies, pressures, stiffness = (np.empty(len(self.share)) for _ in range(3))
        _states(np.ascontiguousarray(J), self.volumes, self.kind, self.share, energies, pressures, stiffness)
        return energies, pressures, stiffness


def mean_volumes(
    material: TetMaterial, rows: NDArray[np.int64], volumes: NDArray[np.float64]
) -> tuple[MeanVolumes | None, TetMaterial]:
    """The mean terms of the quadratic tets `rows` (k,) with point volumes (k, s), and all tets' material with what is
    left of the first Lamé parameter; None where no tet has a mean term."""
    mu, lam = rest_lame_parameters(material)
    share = np.zeros(len(lam))
    share[rows] = volume_share(mu[rows], lam[rows])
    possible = has_volume_term(material.kind)
    laws = []
    for part in material.laws:
        if part.flow is None and part.law.bulk is not None:
            here, parameters = part.rows, part.parameters.copy()
            share[here] = np.minimum(share[here], np.maximum(parameters[:, part.law.bulk], 0.0))
            possible[here] = True
            parameters[:, part.law.bulk] -= share[here]
            part = part.of(here, parameters)
        laws.append(part)
    share = np.where(possible, share, 0.0)
    if not share.any():
        return None, material
    kind = np.where(material.kind == BY_LAW, np.int32(_SQUARED), material.kind)[rows]
    return MeanVolumes(kind, share[rows], volumes), replace(material, lam=material.lam - share, laws=tuple(laws))


def volume_share(mu: NDArray[np.float64], lam: NDArray[np.float64]) -> NDArray[np.float64]:
    """l [Pa] of Lamé parameters at rest [Pa]."""
    above = lam > 2.0 * mu
    return np.where(above, (lam - 2.0 * mu) * (lam + mu) / np.where(above, lam, 1.0), 0.0)


@njit(cache=True)
def _states(J, volumes, kind, share, energies, pressures, stiffness):
    for e in range(len(share)):
        whole = total = 0.0
        for q in range(volumes.shape[1]):
            whole += volumes[e, q]
            total += volumes[e, q] * (J[e, q] - 1.0)
        U, first, second = volume_term(kind[e], 1.0 + total / whole)
        energies[e] = whole * share[e] * U
        pressures[e] = share[e] * first
        stiffness[e] = share[e] * second / whole
