"""Creates the bodies that are added on the page, and places them in free space."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import AddBody, Point
from supple.errors import CommandError
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.tetmesh import TetMesh
from supple.scene.body import Body
from supple.scene.scene import Scene

# Gap below a new body, as a share of its height.
GAP = 0.1
# Material values of new bodies.
_DAMPING, _FRICTION = 0.005, 0.3


def make_mesh(shape: str, size: float, resolution: int) -> TetMesh:
    """The mesh of one of `limits.SHAPES`, of `size` [m], with `resolution` edges across it."""
    edge = size / resolution
    match shape:
        case "box":
            return shapes.box((size, size, size), (resolution, resolution, resolution))
        case "sphere":
            return shapes.sphere(0.5 * size, min(edge, 0.5 * size))
        case "cylinder":
            return shapes.cylinder(0.25 * size, size, min(edge, 0.25 * size))
        case "torus":
            return shapes.torus(0.35 * size, 0.15 * size, min(edge, 0.12 * size))
        case "gummy_bear":
            return shapes.gummy_bear(size, min(edge, size / 7.0))
    raise CommandError(f"shape {shape!r} does not exist")


def new_body(command: AddBody, scene: Scene, positions: NDArray[np.float64], up: NDArray[np.float64]) -> Body:
    """The body that a command describes, above `positions` (n, 3) [m] where the command gives no position.

    Raises
    ------
    MeshError : where the mesh of the command cannot be used.
    """
    mesh = make_mesh(command.shape, command.size, command.resolution)
    name = command.name if command.name is not None else unused_name(scene, command.shape.replace("_", " "))
    values = {"youngs": command.youngs, "poisson": command.poisson, "density": command.density}
    material = StableNeoHookean(**values, damping=_DAMPING)
    return Body(name, mesh, material, position=place_for(mesh, command.position, positions, up), friction=_FRICTION)


def place_for(
    mesh: TetMesh, position: Point | None, positions: NDArray[np.float64], up: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Position of the origin of a mesh: its box is centered at `position`, or is above all `positions` (n, 3) [m]."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    center = 0.5 * (low + high)
    if position is not None:
        return np.asarray(position) - center
    middle = 0.5 * (positions.min(axis=0) + positions.max(axis=0))
    heights = mesh.vertices @ up
    reach = float(heights.max() - heights.min())
    top = float((positions @ up).max()) + GAP * reach
    return middle - center + (top - heights.min() - (middle - center) @ up) * up


def unused_name(scene: Scene, stem: str) -> str:
    """`stem` with the first number that gives a name which no body and no obstacle has."""
    used = {thing.name for thing in (*scene.bodies, *scene.obstacles)}
    return next(f"{stem} {k}" for k in itertools.count(1) if f"{stem} {k}" not in used)


def check_size(scene: Scene, mesh: TetMesh) -> None:
    """Raise `CommandError` where another body with this mesh exceeds the limits of a live page."""
    if len(scene.bodies) >= limits.MOST_BODIES:
        raise CommandError(f"there are {len(scene.bodies)} bodies already; remove one first")
    total = len(mesh.tets) + sum(len(body.mesh.tets) for body in scene.bodies)
    if total > limits.MOST_TETS:
        raise CommandError(
            f"the scene would have {total} tets; a live page allows at most {limits.MOST_TETS}: lower the resolution"
        )


def moved_apart(
    scene: Scene, added: frozenset[str], starts: Mapping[str, NDArray[np.float64]], up: NDArray[np.float64]
) -> Scene:
    """The scene in which `added` bodies that would start inside the box of another body are placed above all bodies.

    Parameters
    ----------
    starts : by body name, (n, 3) deformed initial positions [m]
    """
    places = [starts.get(body.name, body.place(body.mesh.vertices)) for body in scene.bodies if body.name not in added]
    bodies = []
    for body in scene.bodies:
        if body.name in added:
            place = body.place(body.mesh.vertices)
            if any(_boxes_meet(place, other) for other in places):
                body = body.changed(position=place_for(body.mesh, None, np.concatenate(places), up))
                place = body.place(body.mesh.vertices)
            places.append(place)
        bodies.append(body)
    return replace(scene, bodies=bodies)


def _boxes_meet(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    return bool(np.all(a.min(axis=0) <= b.max(axis=0)) and np.all(b.min(axis=0) <= a.max(axis=0)))
