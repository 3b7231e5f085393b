"""A surface is filled: by which mesher, with which options, and checks of what it returned."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from supple.errors import MeshError, MeshingError
from supple.mesh.meshing.child_process import DEFAULT_TETS, Limits, MesherFailure, MesherResult
from supple.mesh.meshing.decimation import decimate_surface
from supple.mesh.meshing.facing import facing_outward
from supple.mesh.meshing.meshers import mesh_with_mmg, mesh_with_tetgen
from supple.mesh.meshing.option_names import option
from supple.mesh.meshing.sizes import allow, edge_of_volume, tets_of_walls, volume_of_edge
from supple.mesh.meshing.stuffing import stuffed
from supple.mesh.meshing.surface_fit import fitted
from supple.mesh.surface import SurfaceMesh
from supple.mesh.surface_checks import SurfaceReport
from supple.mesh.tetmesh import TetMesh

logger = logging.getLogger(__name__)

Mesher = Literal["auto", "tetgen", "stuffing"]
Chosen = Literal["tetgen", "stuffing"]

# Of the volume: what is more is said. TetGen's facets are planar to 0.1 degrees; Mmg's are coarser, and fitted.
VOLUME_TOLERANCE = 0.02
# A surface of more triangles for each tet that was asked for is decimated before TetGen, which keeps all: that takes
# most of the time, and changes the volume by this share at most.
DENSE, DENSE_TOLERANCE = 5, 0.01
# TetGen's coarsest mesh of a ball of 100 to 300 triangles has 5 to 7 tets for each triangle.
TETS_OF_TRIANGLE = 6
DEFAULT_QUALITY = 1.4


@dataclass(frozen=True, eq=False)
class Filling:
    """What shall be filled, and how: the parameters of `tetrahedralize`.

    Attributes
    ----------
    surface : faces outward; watertight : whether it encloses a volume
    """

    surface: SurfaceMesh
    watertight: bool
    max_volume: float | None
    edge: float | None
    tets: int | None
    quality: float | None
    min_dihedral: float | None
    keep_surface: bool
    limits: Limits

    @property
    def enclosed(self) -> float:
        """The volume to fill [m^3], about: an open surface has none."""
        return self.surface.volume if self.watertight else 0.5 * self._box

    @cached_property
    def _box(self) -> float:
        low, high = self.surface.bounds
        return float(np.prod(high - low))

    def by(self, mesher: Chosen) -> tuple[str, TetMesh]:
        """The name of the mesher that made the tets, and these.

        Raises
        ------
        MesherFailure, MeshingError : see `tetrahedralize`
        """
        if mesher == "stuffing":
            return mesher, self._by_stuffing()
        tets, bound = self.tets, self.max_volume
        if self.max_volume is self.edge is tets is None and not self.keep_surface:
            if TETS_OF_TRIANGLE * len(self.surface.triangles) <= DEFAULT_TETS:
                # Where more points are needed, the shape of the triangles is bad, and the mesh is not used.
                mesh = self._by_tetgen(None, DEFAULT_TETS)
                if len(mesh.tets) <= DEFAULT_TETS:
                    return mesher, self._checked(mesh)
            tets = DEFAULT_TETS
        if self.max_volume is None and not self.keep_surface:
            mesh = self._remeshed(tets)
            _say_volume(mesh.volume, self.surface.volume)
            return "mmg", mesh
        if self.edge is not None:
            bound = volume_of_edge(self.edge)
        elif tets is not None:
            bound = 2.0 * self.enclosed / tets
        mesh = self._by_tetgen(bound)
        if tets is not None and not 0.8 * tets < len(mesh.tets) < 1.25 * tets:
            mesh = self._by_tetgen(min(self.enclosed, (bound or 0.0) * len(mesh.tets) / tets))
            _say_count(len(mesh.tets), tets)
        return mesher, self._checked(mesh)

    def _by_tetgen(self, bound: float | None, points: int | None = None) -> TetMesh:
        """`points` : to add at most."""
        options: dict[str, Any] = {
            "max_volume": bound,
            "quality": self.quality,
            "min_dihedral": self.min_dihedral,
            "keep_surface": self.keep_surface,
            "points": points,
        }
        return _used("tetgen", mesh_with_tetgen(self.surface, options, self.limits))

    def _by_stuffing(self) -> TetMesh:
        # The largest tets of a lattice have 2.5 times the mean volume.
        edge = edge_of_volume(0.4 * self.max_volume) if self.max_volume is not None else self.edge
        mesh, volume = stuffed(self.surface, self.tets or (DEFAULT_TETS if edge is None else None), edge)
        _say_volume(mesh.volume, volume)
        return mesh

    def _remeshed(self, tets: int | None) -> TetMesh:
        """Of Mmg, from TetGen's tets."""
        base, wanted = self.surface, tets
        if tets is not None:
            wanted = tets_of_walls(base, tets)
            if len(base.triangles) > DENSE * wanted:
                base = self._fewer(base, DENSE * wanted)
        logger.info("filling %d triangles with %s", len(base.triangles), f"about {wanted} tets" if tets else "tets")
        result = mesh_with_mmg(base, tets=wanted, edge=self.edge, limits=self.limits)
        mesh = fitted(_used("Mmg", result), self.surface)
        # Mmg sees the tets on one side of its boundary, not the gap on the other.
        if mesh.surface.compact().check().self_intersecting:
            raise MesherFailure(
                "failed", "gaps of the surface are narrower than tets; more tets keep their sides apart"
            )
        if wanted is not None:
            _say_count(len(mesh.tets), wanted)
        return mesh

    def _fewer(self, surface: SurfaceMesh, triangles: int) -> SurfaceMesh:
        """The surface with fewer triangles, where that changes neither its faults nor its volume."""
        limits = self.limits
        try:
            reduced = decimate_surface(surface, triangles, time_limit=limits.time, memory_limit=limits.memory)
        except MeshingError as error:
            logger.info("%s; filling all triangles", error)
            return surface
        reduced, report = facing_outward(reduced)
        same = abs(reduced.volume - surface.volume) <= DENSE_TOLERANCE * surface.volume and report.ok
        return reduced if same else surface

    def _checked(self, mesh: TetMesh) -> TetMesh:
        """TetGen's mesh, where it meets the demands."""
        bound, largest = self.max_volume, float(mesh.volumes.max())
        if bound is not None and largest > bound * (1.0 + 1e-6):
            remedy = "give a finer surface"
            if self.keep_surface:
                remedy = f"omit {option('keep_surface')}, {remedy}"
            raise MeshingError(
                f"TetGen left a tet of {largest:.4g} m^3, larger than {option('max_volume', bound)}; {remedy}, or "
                "allow larger tets"
            )
        _say_volume(mesh.volume, self.surface.volume)
        if self.keep_surface and len(mesh.surface.used_vertices) > len(self.surface.vertices):
            raise MeshingError(
                f"TetGen added vertices on the surface; omit {option('keep_surface')}, or give a finer surface"
            )
        return mesh


def _used(mesher: str, result: MesherResult) -> TetMesh:
    try:
        return TetMesh.dropping_unused(result.vertices, result.elements)
    except MeshError as error:
        # As a failure of the mesher, so that "auto" continues with stuffing.
        raise MesherFailure(
            "failed",
            f"{mesher} returned an unusable mesh: {str(error).removeprefix('TetMesh: ')}; the surface has triangles "
            f"that are too thin or too close to each other: remesh it evenly, or use {option('mesher', 'stuffing')}",
        ) from None


def _say_count(made: int, wanted: int) -> None:
    if made > 1.25 * wanted:
        allow(f"the details of the surface need {made:,} tets", made, wanted)
        logger.warning("%s tets instead of %s: the details of the surface need so many", f"{made:,}", f"{wanted:,}")


def _say_volume(made: float, volume: float) -> None:
    if abs(made - volume) > VOLUME_TOLERANCE * volume:
        logger.warning(
            "the tets have %+.1f %% of the surface's volume and mass: its details are smaller than tets; ask for more",
            100.0 * (made / volume - 1.0),
        )


def choose(mesher: Mesher, report: SurfaceReport, repaired: bool, keep_surface: bool) -> Chosen:
    """Which mesher fills a surface first; raises `MeshingError` where none may."""
    if mesher not in ("auto", "tetgen", "stuffing"):
        names = '"auto", "tetgen" or "stuffing"'
        raise MeshingError(f"{option('mesher')} must be {names}, not {mesher!r}")
    if mesher == "stuffing":
        return mesher
    if report.ok:
        return "tetgen"
    faults = "; ".join(report.problems)
    if mesher == "auto" and not keep_surface:
        logger.warning("the surface is not clean (%s): filling it with a lattice, which rounds sharp edges", faults)
        return "stuffing"
    remedies = ["fix it in a modelling program"] if repaired else [f"fix it with {option('repair', True)}"]
    remedies.append(f"use {option('mesher', 'stuffing')}")
    still = "even after repair, " if repaired else ""
    raise MeshingError(f"TetGen cannot mesh this surface: {still}{faults}; {' or '.join(remedies)}")


def check_tetgen_options(mesher: str, quality: float | None, min_dihedral: float | None, keep_surface: bool) -> None:
    """Raise for options that only TetGen has; warn of the one that is not used."""
    if mesher != "tetgen":
        for name, given in (("keep_surface", keep_surface), ("min_dihedral", min_dihedral is not None)):
            if given:
                raise MeshingError(
                    f"{mesher} has no {option(name)}; omit it, or clean the surface so that TetGen can mesh it"
                )
    for name, given in (("quality", quality != DEFAULT_QUALITY), ("min_dihedral", min_dihedral is not None)):
        if given:
            logger.warning("%s is not used: it is TetGen's, with %s", option(name), option("max_volume"))
