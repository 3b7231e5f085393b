"""A series for the checks: what the files do not contain is unknown, and the checks that need it are skipped."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import MeshError, OutputError, SuppleError
from supple.kinds.kind import Kind
from supple.kinds.validators import POSITIVE, Boolean, Choice, Vector
from supple.materials.elastic import Elastic, FixedCorotated, NeoHookean, StableNeoHookean, StVenantKirchhoff
from supple.materials.material import POISSON, NotRecorded
from supple.materials.per_tet import TetMaterial
from supple.mesh.io.series.series import OtherCells, Series
from supple.results.check.known import Part
from supple.results.check.series_parts import parts_of
from supple.results.check.trajectory import Snapshot, Trajectory

# As scene files call them.
LAWS: dict[str, type[Elastic]] = {
    "stable_neo_hookean": StableNeoHookean,
    "neo_hookean": NeoHookean,
    "fixed_corotated": FixedCorotated,
    "st_venant_kirchhoff": StVenantKirchhoff,
}
# Points that were one in the first frame are apart beyond this share of the size of everything.
_APART = 1e-6


@dataclass(frozen=True)
class SeriesMetadata(Kind):
    """What a user knows of a series beside its files.

    Parameters
    ----------
    density : [kg/m^3]; youngs : [Pa]; poisson : [-]
    law : of which the elastic energy is computed, one of `LAWS`
    gravity : (3,) [m/s^2]; dt : from frame to frame [s]
    free : whether nothing but gravity acts on the parts from outside

    Raises
    ------
    OutputError : where a number is out of range.
    """

    kind: ClassVar[str] = "check"
    error: ClassVar[type[SuppleError]] = OutputError

    density: Annotated[float | None, POSITIVE] = None
    youngs: Annotated[float | None, POSITIVE] = None
    poisson: Annotated[float | None, POISSON] = None
    gravity: Annotated[ArrayLike | None, Vector()] = None
    dt: Annotated[float | None, POSITIVE] = None
    free: Annotated[bool, Boolean()] = False
    law: Annotated[str, Choice(tuple(LAWS))] = "stable_neo_hookean"


class SeriesTrajectory(Trajectory):
    """The frames of another program."""

    def __init__(self, series: Series, given: SeriesMetadata) -> None:
        self.path, self._series, count = Path(series.path), series, len(series)
        first = self._first()
        parts = parts_of(series.cells, first, self._last(count))
        self._points, self._twins = parts.points, parts.twins
        self.rest_positions = rest = np.ascontiguousarray(first[parts.points])
        self._apart = _APART * float(np.ptp(rest, axis=0).max())
        self.tets = parts.tets.astype(np.int32)
        shares = np.repeat(np.abs(self.rest_volumes) * (given.density or 0.0) / 4.0, 4)
        self.masses = np.bincount(self.tets.ravel(), shares, len(rest)).astype(np.float64)
        if series.masses is not None:
            self.masses = np.ascontiguousarray(series.masses[parts.points])
        starts = np.vstack([np.zeros((1, 3), dtype=np.int64), parts.ends])
        rows = [[slice(*map(int, ends)) for ends in zip(a, b, strict=True)] for a, b in pairwise(starts)]
        self.bodies = [
            Part(name, vertices, tets, (parts.triangles[triangles] - vertices.start).astype(np.int32))
            for name, (vertices, tets, triangles) in zip(parts.names, rows, strict=True)
        ]
        step, solid = _step(series.times, given.dt), (self.rest_volumes > 0.0).all() and len(self.tets) > 0
        known = {
            "files": True,
            "tets": len(self.tets) > 0,
            "times": step is not None and count > 2,
            "masses": series.masses is not None or (given.density is not None and solid),
            "material": given.youngs is not None and given.poisson is not None,
            "gravity": given.gravity is not None,
            "free": given.free,
        }
        self.knows = frozenset(name for name, is_known in known.items() if is_known)
        self.times, self.dt = self._times(count, step), step or 1.0
        self.gravity = np.zeros(3) if given.gravity is None else np.asarray(given.gravity)
        self.material, self.springs = _material(given, len(self.tets)), (None,) * len(self.bodies)
        self.file_numbers = {"vertex": parts.points, "tet": parts.tet_numbers, "triangle": parts.triangle_numbers}
        self.numbers, self.notes = series.numbers, (*series.notes, *parts.notes)
        self._kept: dict[int, tuple[NDArray[np.float64], str | None]] = {}

    def snapshot(self, number: int) -> Snapshot:
        positions, other = self._frame(number)
        return Snapshot(self, number, float(self.times[number]), positions, self._velocities(number), other=other)

    def _frame(self, number: int) -> tuple[NDArray[np.float64], str | None]:
        """Positions (n, 3) in the order of the parts, and why they cannot be compared; the last few are kept."""
        if number not in self._kept:
            while len(self._kept) >= 4:
                del self._kept[next(iter(self._kept))]
            self._kept[number] = self._read(number)
        return self._kept[number]

    def _velocities(self, number: int) -> NDArray[np.float64]:
        """(n, 3) [m/s] by differences of second order between frames; NaN where a frame of these cannot be compared."""
        last = len(self) - 1
        if "times" not in self.knows:
            return np.zeros_like(self.rest_positions)
        a, b, c = (self._frame(min(max(number, 1), last - 1) + k)[0] for k in (-1, 0, 1))
        if number == 0:
            return (4.0 * b - 3.0 * a - c) / (2.0 * self.dt)
        if number == last:
            return (a + 3.0 * c - 4.0 * b) / (2.0 * self.dt)
        return (c - a) / (2.0 * self.dt)

    def _read(self, number: int) -> tuple[NDArray[np.float64], str | None]:
        try:
            x = self._series.positions(number)
        except OtherCells as other:
            return np.full_like(self.rest_positions, np.nan), str(other)
        apart = np.abs(x[self._twins[:, 0]] - x[self._twins[:, 1]]).max(axis=1) if len(self._twins) else np.zeros(0)
        other = None
        if (apart > self._apart).any():
            one, two = self._twins[int(np.argmax(apart))]
            other = f"points {one} and {two} had the same place and separate by {apart.max():.3g}"
        return np.ascontiguousarray(x[self._points]), other

    def _first(self) -> NDArray[np.float64]:
        """The positions of the first frame with finite numbers: the reference of shapes."""
        for number in range(min(len(self._series), 1000)):
            try:
                x = self._series.positions(number)
            except OtherCells:
                continue
            if np.isfinite(x).all():
                return x
        raise MeshError(f"{self.path}: no frame has finite positions only")

    def _last(self, count: int) -> NDArray[np.float64] | None:
        try:
            x = self._series.positions(count - 1)
        except OtherCells:
            return None
        return x if np.isfinite(x).all() else None

    def _times(self, count: int, step: float | None) -> NDArray[np.float64]:
        if self._series.times is not None:
            return np.asarray(self._series.times, dtype=np.float64)
        numbers = np.arange(count) if self._series.numbers is None else self._series.numbers - self._series.numbers[0]
        return np.asarray(numbers, dtype=np.float64) * (step or 1.0)


def _step(times: NDArray[np.float64] | None, given: float | None) -> float | None:
    """From frame to frame [s]; None where it is not known."""
    if given is not None or times is None or len(times) < 2:
        return given
    step = float(np.median(np.diff(times)))
    return step if np.isfinite(step) and step > 0.0 else None


def _material(given: SeriesMetadata, tets: int) -> TetMaterial:
    if given.youngs is None or given.poisson is None:
        return NotRecorded(name="unknown").per_tet(tets)
    return LAWS[given.law](youngs=given.youngs, poisson=given.poisson, density=given.density or 1.0).per_tet(tets)
