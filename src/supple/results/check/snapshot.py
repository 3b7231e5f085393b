"""One frame of a recording as the checks use it: read once, and measured once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import MUSCLE
from supple.results.check.floors import Floors
from supple.results.check.geometry import quadratic_tets
from supple.results.check.geometry.box_tree import build_tree, triangle_boxes
from supple.results.check.geometry.orientation import volume_signs
from supple.results.check.geometry.surface_pairs import meeting_pairs
from supple.results.check.load_forces import ActuatorState, actuator_states, add_muscle_forces, load_forces
from supple.results.check.stored_energies import elastic_energy, stitch_energies
from supple.results.check.surfaces import Surfaces, seam_keys
from supple.results.check.trajectory import Trajectory, TrajectoryFrame

_MOST_PAIRS = 1000


class Scene:
    """What all frames of a trajectory share. Seams are among the surfaces' ignored pairs."""

    def __init__(self, trajectory: Trajectory) -> None:
        self.recording = trajectory
        self.surfaces = Surfaces(trajectory)
        self.surfaces.ignored = np.union1d(self.surfaces.ignored, seam_keys(trajectory, self.surfaces))

    @cached_property
    def rest_inverse(self) -> NDArray[np.float64]:
        """(m, 3, 3) Dm^-1 [1/m]; NaN where a tet is flat at rest."""
        return _inverses(edge_vectors(self.recording.rest_positions, self.recording.tets))

    @cached_property
    def quadratic_at_rest(self) -> NDArray[np.float64]:
        """(k, 10, 3) nodes of the quadratic tets at rest [m]."""
        quadratic = self.recording.quadratic
        return np.zeros((0, 10, 3)) if quadratic is None else self.recording.rest_positions[quadratic[1]]

    @cached_property
    def size(self) -> float:
        """Longest extent of the largest body at rest [m]."""
        rest = self.recording.rest_positions
        return max(float(np.ptp(body.points(rest), axis=0).max()) for body in self.recording.bodies)

    @cached_property
    def reach(self) -> float:
        """The largest coordinate at rest and in the first frame [m]."""
        found = (self.recording.rest_positions, self.snapshot(0).positions)
        return max(float(np.abs(x[np.isfinite(x).all(axis=1)]).max(initial=0.0)) for x in found)

    @cached_property
    def floors(self) -> Floors:
        """Below which numbers are not judged."""
        return Floors(self.recording, self.size, self.reach)

    def snapshot(self, number: int) -> Snapshot:
        """A frame."""
        return Snapshot(**vars(self.recording.frame(number)), scene=self)

    def name(self, kind: Literal["vertex", "tet"], row: int) -> str:
        """A vertex or tet as messages call it: its number within its body, or the file; of a skin, within that."""
        for body, first in self.surfaces.skins if kind == "vertex" else ():
            if body.skin is not None and first <= row < first + len(body.skin.corners):
                return f"vertex {row - first} of {body.name}"
        for body in self.recording.bodies:
            rows = body.vertices if kind == "vertex" else body.tets
            if rows.start <= row < rows.stop:
                numbers = self.recording.file_numbers
                number = row - rows.start if numbers is None else int(numbers[kind][row])
                return f"{kind} {number} of {body.name}"
        return f"{kind} {row}"


@dataclass(frozen=True, eq=False, kw_only=True)
class Snapshot(TrajectoryFrame):
    """One frame, with what is measured on it."""

    scene: Scene

    @cached_property
    def finite(self) -> bool:
        """Whether positions, velocities and poses are finite, and the frame can be compared with others."""
        known = (
            (self.positions, self.poses)
            if "files" in self.scene.recording.knows
            else (self.positions, self.poses, self.velocities)
        )
        return self.other is None and all(bool(np.isfinite(values).all()) for values in known)

    @cached_property
    def moves(self) -> bool:
        """Whether velocities are finite: those of a series are not beside a frame that cannot be used."""
        return bool(np.isfinite(self.velocities).all())

    @cached_property
    def volumes(self) -> NDArray[np.float64]:
        """(bodies,) [m^3] of tets; of a body without tets what its surface encloses, NaN where that is open."""
        recording = self.scene.recording
        out = np.full(len(recording.bodies), np.nan)
        for k, body in enumerate(recording.bodies):
            if body.tets.stop > body.tets.start:
                out[k] = float(recording.rest_volumes[body.tets] @ self.J[body.tets])
            elif self.scene.surfaces.closed[k]:
                x = self.positions[body.vertices]
                a, b, c = (x - x.mean(axis=0))[body.triangles].transpose(1, 0, 2)
                out[k] = float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
        return out

    @cached_property
    def signs(self) -> NDArray[np.int8]:
        """(m,) exact sign of every tet's determinant; of a quadratic one, 1 where it is positive everywhere in it."""
        signs = volume_signs(self.positions, self.scene.recording.tets)
        if self.scene.recording.quadratic is not None:
            rows, nodes = self.scene.recording.quadratic
            signs[rows] = np.where(quadratic_tets.are_positive(self.positions[nodes]), 1, -1)
        return signs

    @cached_property
    def F(self) -> NDArray[np.float64]:
        """(m, 3, 3) deformation gradients."""
        return edge_vectors(self.positions, self.scene.recording.tets) @ self.scene.rest_inverse

    @cached_property
    def J(self) -> NDArray[np.float64]:
        """(m,) their determinants, computed here; of quadratic tets, the ratios of their volumes."""
        a, b, c = self.F[:, :, 0], self.F[:, :, 1], self.F[:, :, 2]
        J = np.einsum("ij,ij->i", a, np.cross(b, c))
        if self.scene.recording.quadratic is not None:
            rows, nodes = self.scene.recording.quadratic
            J[rows] = quadratic_tets.volumes(self.positions[nodes]) / self.scene.recording.rest_volumes[rows]
        return J

    @cached_property
    def least_J(self) -> NDArray[np.float64]:
        """(m,) as `J`; in quadratic tets the smallest of those at nodes and quadrature points."""
        if self.scene.recording.quadratic is None:
            return self.J
        rows, nodes = self.scene.recording.quadratic
        least = self.J.copy()
        least[rows] = quadratic_tets.smallest_ratios(self.positions[nodes], self.scene.quadratic_at_rest)
        return least

    @cached_property
    def bounded_J(self) -> NDArray[np.float64]:
        """(m,) as `J`; in quadratic tets, what bounds it below everywhere in them where they are straight at rest."""
        if self.scene.recording.quadratic is None:
            return self.J
        rows, nodes = self.scene.recording.quadratic
        least = self.J.copy()
        least[rows] = quadratic_tets.lowest_coefficients(self.positions[nodes], self.scene.quadratic_at_rest)
        return least

    @cached_property
    def elastic_energy(self) -> float | None:
        """[J], zero at rest; None where the recording does not contain the law of a body."""
        recording, inverse = self.scene.recording, self.scene.rest_inverse
        return elastic_energy(recording, self.positions, self.J, inverse, self.internal, self.active)

    @cached_property
    def stitch_energy(self) -> float | None:
        """[J], zero at rest; None where the recording does not contain the laws of its stitches."""
        return float(np.delete(self._pair_energies, self.broken).sum())

    @cached_property
    def energy_of_latest(self) -> float:
        """What the pairs store here that broke since the frame before [J]."""
        return float(self._pair_energies[self.latest].sum())

    @cached_property
    def _pair_energies(self) -> NDArray[np.float64]:
        return stitch_energies(self.scene.recording, self.positions, self.poses)

    @cached_property
    def load_forces(self) -> dict[str, NDArray[np.float64]]:
        """(n, 3) forces of recorded loads and actuators on the vertices [N], by the name of their work."""
        recording = self.scene.recording
        found = load_forces(recording.loads, self.load_values, self.positions, self.velocities)
        if any(each.kind == MUSCLE for each in self.active):
            shapes = self.scene.rest_inverse, recording.rest_volumes
            out = found.setdefault("muscles", np.zeros_like(self.positions))
            add_muscle_forces(self.active, recording.tets, self.F, shapes, out)
        for each in self.actuators:
            out = found.setdefault(each.work, np.zeros_like(self.positions))
            np.add.at(out, each.vertices, each.force * each.gradient)
        return found

    @cached_property
    def actuators(self) -> list[ActuatorState]:
        """Cavities, and spans of cables."""
        recording = self.scene.recording
        values = self.pressures, self.tensions
        return actuator_states(recording.cavities, recording.cables, *values, self.positions)

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """All points of all surfaces; see `Surfaces.place`."""
        return self.scene.surfaces.place(self.positions, self.poses)

    @cached_property
    def tree(self) -> tuple[NDArray, NDArray, NDArray, NDArray, NDArray, NDArray]:
        """The boxes around the triangles, and the tree over them: the last arguments of `meeting_pairs`."""
        low, high = triangle_boxes(self.points, self.scene.surfaces.triangles)
        return (low, high, *build_tree(low, high))

    @cached_property
    def meeting(self) -> tuple[int, NDArray[np.int64]]:
        """How many pairs of triangles meet, and the first ones (k, 2) of them, at most a thousand."""
        surfaces = self.scene.surfaces
        out = np.zeros((_MOST_PAIRS, 2), dtype=np.int64)
        count = meeting_pairs(
            self.points, surfaces.triangles, surfaces.owners, surfaces.allowed, surfaces.ignored, *self.tree, out
        )
        return count, out[: min(count, _MOST_PAIRS)]


def edge_vectors(x: NDArray[np.float64], tets: NDArray[np.int32]) -> NDArray[np.float64]:
    """(m, 3, 3) whose columns are x1 - x0, x2 - x0, x3 - x0."""
    corners = x[tets]
    return np.ascontiguousarray((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))


def _inverses(D: NDArray[np.float64]) -> NDArray[np.float64]:
    a, b, c = D[:, :, 0], D[:, :, 1], D[:, :, 2]
    rows = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return rows / np.einsum("ij,ij->i", a, rows[:, 0])[:, None, None]
