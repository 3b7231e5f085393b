"""The collision geometries of links as surfaces of a scene file, in the frames of their links."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.scene_file.entries.mesh_sources import MeshStore, surface_model
from supple.app.scene_file.urdf.elements import Problem
from supple.app.scene_file.urdf.notes import Notes
from supple.app.scene_file.urdf.robot import Geometry, Link, Placement, Robot
from supple.app.scene_file.yaml_files import printable
from supple.errors import MeshError, SceneError, SuppleError
from supple.mesh.closed_surfaces import is_closed
from supple.mesh.io.mesh_files import SURFACE_READERS
from supple.mesh.surface import SurfaceMesh
from supple.scene.rigid.mass_properties import of_solid

# The edges of spheres and cylinders, as a share of the radius. A cylinder has one layer of them to so many; a flat or a
# long one is made by a scale along its axis.
_EDGE, _LAYERS = 0.5, 20
# Cylinders are along y here, and along z in a URDF.
_UPRIGHT = Placement(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]))


class Shapes:
    """Finds and reads the meshes of collision geometries.

    Parameters
    ----------
    folder : of the URDF; meshes : reads the files
    """

    def __init__(self, folder: Path, meshes: MeshStore, notes: Notes) -> None:
        self.folder, self.meshes, self.notes = folder, meshes, notes

    def usable(self, robot: Robot) -> Robot:
        """The robot with the geometries that can be used. What is left out, or changed, is noted.

        Raises
        ------
        Problem : where a mesh is damaged, or may not be read.
        """
        links = {}
        for name, link in robot.links.items():
            found = [self._usable(geometry, link) for geometry in link.collisions]
            links[name] = replace(link, collisions=tuple(one for one in found if one is not None))
        return replace(robot, links=links)

    def surface(self, entries: list[dict[str, Any]]) -> SurfaceMesh:
        """The surfaces of entries as one."""
        return self.meshes.joined([surface_model().model_validate(one) for one in entries])

    def _usable(self, geometry: Geometry, link: Link) -> Geometry | None:
        if geometry.kind != "mesh":
            return geometry
        what = f"{printable(geometry.file, 100)} of link {printable(link.name)!r}"
        if Path(geometry.file).suffix.lower() not in SURFACE_READERS:
            self.notes.add("mesh of a format that is not read, left out (convert it to STL or OBJ)", what)
            return None
        path = next((path for path in self._places(geometry.file) if _is_file(path)), None)
        if path is None:
            self.notes.add("mesh that does not exist, left out", what)
            return None
        file = Path(os.path.relpath(path.resolve(), self.folder.resolve())).as_posix()
        found = replace(geometry, file=file, placement=Placement())
        try:
            solid = _is_solid(self.surface(entries(found, Placement())))
        except SuppleError as error:
            raise Problem(f"link {printable(link.name)!r}: {error}", link.line) from None
        if not solid:
            found = replace(found, hull=True)
            try:
                self.surface(entries(found, Placement()))
            except MeshError:
                self.notes.add("mesh that contains no volume, left out", what)
                return None
            self.notes.add("mesh that is not closed, or inside out: its convex hull is used", what)
        return replace(found, placement=geometry.placement)

    def _places(self, name: str) -> Iterator[Path]:
        """Where a mesh may be: beside the URDF or a folder above it, of which one may be, or contain, the package."""
        name = name.replace("\\", "/")
        if name.startswith("$(find "):
            name = name.replace("$(find ", "package://", 1).replace(")", "", 1)
        scheme, _, rest = name.rpartition("://")
        if scheme == "file" or (not scheme and rest.startswith("/")):
            yield Path(rest)
        elif scheme in ("", "package", "model"):
            package, _, inside = rest.lstrip("/").partition("/")
            for above in (self.folder.resolve(), *self.folder.resolve().parents):
                yield above / rest.lstrip("/")
                if scheme and (above.name == package or (above / "package.xml").is_file()):
                    yield above / inside


def entries(geometry: Geometry, frame: Placement) -> list[dict[str, Any]]:
    """The surfaces of a geometry in a frame in which that of its link is at `frame`."""
    numbers, placement = geometry.numbers, frame.then(geometry.placement)
    if geometry.kind == "mesh":
        hull = {"hull": True} if geometry.hull else {}
        # Programs for robots ignore which axis a .dae file says to point up.
        axes = {"keep_axes": True} if geometry.file.lower().endswith(".dae") else {}
        return [_placed({"file": geometry.file, "scale": list(numbers), **hull, **axes}, placement)]
    if geometry.kind == "box":
        return [_placed({"shape": {"kind": "box", "size": list(numbers), "divisions": [1, 1, 1]}}, placement)]
    radius, length = numbers[0], numbers[-1]
    ball = {"shape": {"kind": "sphere", "radius": radius, "edge_length": _EDGE * radius}}
    if geometry.kind == "sphere":
        return [_placed(ball, placement)]
    surfaces = []
    if length > 0.0:
        edge = _EDGE * radius
        height = edge * min(max(round(length / edge), 1), _LAYERS)
        tube = {"kind": "cylinder", "radius": radius, "height": height, "edge_length": edge}
        surfaces.append(_placed({"shape": tube, "scale": [1.0, length / height, 1.0]}, placement.then(_UPRIGHT)))
    if geometry.kind == "capsule":
        ends = (Placement(translation=np.array([0.0, 0.0, z])) for z in (-0.5 * length, 0.5 * length))
        surfaces += [_placed(ball, placement.then(end)) for end in ends]
    return surfaces


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _is_solid(surface: SurfaceMesh) -> bool:
    try:
        return is_closed(surface.triangles) and of_solid(surface, "").volume > 0.0
    except SceneError:
        return False


def _placed(entry: dict[str, Any], placement: Placement) -> dict[str, Any]:
    rotation, position = rotation_vector(placement.rotation), placement.translation
    return {**entry, "rotation": rotation.tolist(), "position": position.tolist()}


def rotation_vector(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) whose rotation is R."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_rotvec()
