"""What the checks read: the frames of a simulation, and what is measured on them with their surfaces and energies."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from supple.results.check.energies import elastic_energy, stitch_energies
from supple.results.check.floors import Floors
from supple.results.check.geometry import quadratic_tets
from supple.results.check.geometry.box_tree import Tree, tree_of
from supple.results.check.geometry.orientation import volume_signs
from supple.results.check.geometry.vectors import enclosed_volume
from supple.results.check.known import Floats, Frame, Known
from supple.results.check.loads import Actuator, actuators
from supple.results.check.surfaces import Surfaces


class Trajectory(Known):
    """The frames, and what no frame changes."""

    @abstractmethod
    def snapshot(self, number: int) -> Snapshot:
        """A frame."""

    @cached_property
    def surfaces(self) -> Surfaces:
        """The surfaces of all bodies and obstacles."""
        return Surfaces(self)

    @cached_property
    def floors(self) -> Floors:
        """Below which numbers are not judged."""
        return Floors(self)

    def name(self, kind: Literal["vertex", "tet"], row: int) -> str:
        """A vertex or tet as messages call it: its number within its body, or the file; of a skin, within that."""
        for body, skin, first in self.surfaces.skins if kind == "vertex" else ():
            if first <= row < first + len(skin.corners):
                return f"vertex {row - first} of {body.name}"
        for body in self.bodies:
            rows = body.vertices if kind == "vertex" else body.tets
            if rows.start <= row < rows.stop:
                number = row - rows.start if self.file_numbers is None else int(self.file_numbers[kind][row])
                return f"{kind} {number} of {body.name}"
        return f"{kind} {row}"


@dataclass(frozen=True, eq=False)
class Snapshot(Frame):
    """One frame, with what is measured on it."""

    of: Trajectory

    @cached_property
    def volumes(self) -> Floats:
        """(bodies,) [m^3] of tets; of a body without tets what its surface encloses, NaN where that is open."""
        out = np.full(len(self.of.bodies), np.nan)
        for k, body in enumerate(self.of.bodies):
            if body.tets.stop > body.tets.start:
                out[k] = float(self.of.rest_volumes[body.tets] @ self.J[body.tets])
            elif self.of.surfaces.closed[k]:
                out[k] = enclosed_volume(self.positions[body.vertices], body.boundary)
        return out

    @cached_property
    def signs(self) -> NDArray[np.int8]:
        """(m,) exact sign of every tet's determinant; of a quadratic one, 1 where it is positive everywhere in it."""
        signs, (rows, nodes) = volume_signs(self.positions, self.of.tets), self.quadratic
        signs[rows] = np.where(quadratic_tets.are_positive(nodes), 1, -1)
        return signs

    @cached_property
    def elastic_energy(self) -> float | None:
        """[J], zero at rest; None where the law of a body is not known."""
        return elastic_energy(self)

    @cached_property
    def stitch_energy(self) -> float:
        """[J], zero at rest."""
        return float(np.delete(self._pair_energies, self.broken).sum())

    @cached_property
    def energy_of_latest(self) -> float:
        """What the pairs store here that broke since the frame before [J]."""
        return float(self._pair_energies[self.latest].sum())

    @cached_property
    def _pair_energies(self) -> Floats:
        return stitch_energies(self)

    @cached_property
    def load_forces(self) -> dict[str, Floats]:
        """(n, 3) forces of loads and actuators on the vertices [N], by the name of their work."""
        found: dict[str, Floats] = {}
        for work, forces in self.of.loads:
            if not isinstance(forces, str):
                here = forces(self.time, self.positions, self.velocities)
                found[work] = found[work] + here if work in found else here
        for one in self.actuators:
            here = one.force * one.gradient
            found[one.work] = found[one.work] + here if one.work in found else here
        return found

    @cached_property
    def actuators(self) -> list[Actuator]:
        """Cavities, and spans of cables."""
        return actuators(self)

    @cached_property
    def points(self) -> Floats:
        """All points of all surfaces; see `Surfaces.place`."""
        return self.of.surfaces.place(self.positions, self.poses)

    @cached_property
    def tree(self) -> Tree:
        """The tree of boxes over the triangles of all surfaces."""
        return tree_of(self.points, self.of.surfaces.triangles)

    @cached_property
    def meeting(self) -> tuple[int, NDArray[np.int64]]:
        """How many pairs of triangles meet, and the first ones (k, 2) of them, at most a thousand."""
        return self.of.surfaces.pairs(self.tree, self.points)
