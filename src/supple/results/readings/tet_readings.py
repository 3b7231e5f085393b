"""Strains, stresses and energies of a frame, of a simulation or of a recording, computed when they are read."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from supple.kinds.suggestion import Named
from supple.materials.elastic_tets.laws import TetLaws
from supple.materials.elastic_tets.stress import (
    cauchy_of_tets,
    energy_densities,
    first_piolas,
    mean_deformation_gradients,
    volume_ratios,
    von_mises,
)
from supple.materials.laws.hencky import HENCKY
from supple.materials.laws.internal import DISSIPATED, FLOW, NEVER_FLOWED, checked
from supple.materials.per_tet import LawTets
from supple.model.state import State
from supple.model.system import System
from supple.numerics.svd3 import principal_stretches
from supple.results.readings.by_body import TetField
from supple.runtime.displayed import DisplayedFrame
from supple.scene.rigid.pose import Pose, pose_of

QUANTITIES = ("J", "von_mises", "energy")


@np.errstate(all="ignore")
def tet_values(
    laws: TetLaws, positions: NDArray[np.float64], quantity: str, internal: NDArray[np.float64] = NEVER_FLOWED
) -> NDArray[np.float64]:
    """(m,) of every tet: "J" [-], "von_mises" stress [Pa], or "energy" density per rest volume [J/m^3].

    internal : of the state, see `State`

    NaN where the tet has no law, or holds something rigid and a stress is asked for.
    """
    x = np.ascontiguousarray(positions)
    F = mean_deformation_gradients(laws, x)
    if quantity == "J":
        return volume_ratios(laws, x, F)
    if quantity == "energy":
        return energy_densities(laws, x, F, internal)
    return von_mises(cauchy_of_tets(laws, x, first_piolas(laws, x, F, internal), F, internal))


_OF_RIGID = "is rigid: it does not have strains and stresses"
_THIN = "is a {}, which has no tets: fields are those of tets"
_NO_LAW = "has no known elastic law, so it has no {}; give it an elastic material such as StableNeoHookean"
_RIGID = "has rigid edges or volumes, whose forces do not follow from positions; give both a compliance above 0"


class TetReadings(DisplayedFrame):
    """Fields on tets, by body name: `frame.stress["bear"]` is (m, 3, 3), `frame.stress.at_vertices["bear"]` (n, 3, 3).

    Stresses are those of the elastic forces, without the viscous ones of `damping`. A value is not finite where a tet
    is flat, or where its energy is infinite. Those of a quadratic tet are means over it.
    """

    if TYPE_CHECKING:  # fields of some frames, properties of others

        @property
        def state(self) -> State: ...
        @property
        def system(self) -> System: ...

    @cached_property
    def positions(self) -> dict[str, NDArray[np.float64]]:
        """By body name, (n, 3) [m]; of a rigid body, of its surface's vertices."""
        return self.system.split(self.state.positions)

    @cached_property
    def velocities(self) -> dict[str, NDArray[np.float64]]:
        """By body name, (n, 3) [m/s]."""
        return self.system.split(self.state.velocities)

    @cached_property
    def poses(self) -> dict[str, Pose]:
        """Of the rigid bodies, by name."""
        x, v, rest = self.state.positions, self.state.velocities, self.system.rest_positions
        rows = {part.name: part.vertices for part in self.system.rigid_bodies}
        return Named("rigid body", {name: pose_of(rest[part], x[part], v[part]) for name, part in rows.items()})

    @cached_property
    def laws(self) -> TetLaws:
        """The elastic laws of all tets, with the growths and muscles of this frame."""
        return self.system.laws_at(self.state.time)

    @cached_property
    def det_F(self) -> NDArray[np.float64]:
        """(m,) J of every tet, in the order of the bodies; of a quadratic one, the ratio of its volumes."""
        return volume_ratios(self.laws, self.state.positions, self._F)

    @cached_property
    def first_piola(self) -> TetField:
        """First Piola stress P (m, 3, 3) [Pa]: force per area at rest, P n for the normal n at rest.

        The nodal forces -V P Dm^-T of all tets add up to the elastic forces, with any material.
        """
        return self._field(first_piolas(self.laws, self.state.positions, self._F, self.state.internal), "stress")

    @cached_property
    def stress(self) -> TetField:
        """Cauchy stress P F^T / J (m, 3, 3) [Pa]: force per area as it is, symmetric."""
        P = self.first_piola.values_of_all
        with np.errstate(all="ignore"):
            return self._field(
                cauchy_of_tets(self.laws, self.state.positions, P, self._F, self.state.internal), "stress"
            )

    @cached_property
    def von_mises(self) -> TetField:
        """Von Mises stress (m,) [Pa]: sqrt(3/2 s : s) with the deviator s of the Cauchy stress."""
        return self._field(von_mises(self.stress.values_of_all), "stress")

    @cached_property
    def principal_stretches(self) -> TetField:
        """(m, 3) singular values of F [-], descending; the last one is negative where the tet is inverted."""
        return TetField(principal_stretches(self._F), self.system.bodies, self._without_tets, self._to_vertices)

    @cached_property
    def energy_density(self) -> TetField:
        """Strain energy per rest volume (m,) [J/m^3], zero at rest. Rigid edges and volumes have none."""
        refused = {name: _NO_LAW.format("energy") for name in self._names_where(~self.laws.known)}
        refused |= self._without_tets
        return TetField(
            energy_densities(self.laws, self.state.positions, self._F, self.state.internal),
            self.system.bodies,
            refused,
            self._to_vertices,
        )

    @cached_property
    def plastic_strain(self) -> TetField:
        """Accumulated plastic strain (m,) [-] of `J2Plastic`; zero where a tet has none."""
        return self._of_flow(FLOW, lambda tets: tets.law is HENCKY)

    @cached_property
    def dissipated_energy(self) -> TetField:
        """Energy per rest volume (m,) [J/m^3] that viscous and plastic flow has dissipated since the start."""
        return self._of_flow(DISSIPATED, lambda tets: True)

    def _of_flow(self, column: int, chosen: Callable[[LawTets], bool]) -> TetField:
        material, out = self.laws.material, np.zeros(len(self.laws.tets))
        internal = checked(material, self.state.internal)
        for tets, rows in material.flowing_laws:
            if chosen(tets):
                out[tets.rows] += self.laws.means(tets, internal[rows, column])
        return TetField(out, self.system.bodies, self._without_tets, self._to_vertices)

    @cached_property
    def _F(self) -> NDArray[np.float64]:
        return mean_deformation_gradients(self.laws, self.state.positions)

    def _field(self, values: NDArray[np.float64], what: str) -> TetField:
        refused = dict.fromkeys(self._names_where(~self.laws.stressed), _RIGID)
        refused |= {name: _NO_LAW.format(what) for name in self._names_where(~self.laws.known)}
        refused |= self._without_tets
        return TetField(values, self.system.bodies, refused, self._to_vertices)

    @property
    def _without_tets(self) -> dict[str, str]:
        rigid = {body.name: _OF_RIGID for body in self.system.bodies if body.rigid}
        thin = {body.name: _THIN.format(body.body.kind) for body in self.system.bodies if body.body.offset > 0.0}
        return rigid | thin

    def _names_where(self, chosen: NDArray[np.bool_]) -> list[str]:
        return [body.name for body in self.system.bodies if chosen[body.tets].any()]

    def _to_vertices(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.laws.vertex_means(values, len(self.state.positions))
