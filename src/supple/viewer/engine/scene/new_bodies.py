"""Bodies that a page adds: made from a few numbers, and placed where there is room."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.errors import CommandError
from supple.materials.stable_neo_hookean import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.tetmesh import TetMesh
from supple.scene.body import Body
from supple.scene.scene import Scene
from supple.viewer.protocol import limits
from supple.viewer.protocol.commands import AddBody, AddMesh, Point

# Of the new body's height: the gap to what is below.
GAP = 0.1
# Of new bodies.
_DAMPING, _FRICTION = 0.005, 0.3


def make_mesh(shape: str, size: float, resolution: int) -> TetMesh:
    """The mesh of a whitelisted shape, `size` [m] across, with `resolution` edges across it."""
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
    raise CommandError(f"there is no shape {shape!r}")


def new_body(command: AddBody, scene: Scene, positions: NDArray[np.float64], up: NDArray[np.float64]) -> Body:
    """The body that a command describes, above `positions` (n, 3) [m] unless it names a place."""
    mesh = make_mesh(command.shape, command.size, command.resolution)
    material = StableNeoHookean(
        youngs=command.youngs, poisson=command.poisson, density=command.density, damping=_DAMPING
    )
    name = command.name if command.name is not None else unused_name(scene, command.shape.replace("_", " "))
    return Body(name, mesh, material, position=place_for(mesh, command.position, positions, up), friction=_FRICTION)


def body_of_mesh(command: AddMesh, scene: Scene, positions: NDArray[np.float64], up: NDArray[np.float64]) -> Body:
    """The body that a command brings the mesh of, above `positions` (n, 3) [m].

    Raises
    ------
    MeshError : where the mesh cannot be used.
    """
    mesh = TetMesh(command.vertices, command.tets)
    material = StableNeoHookean(youngs=command.youngs, poisson=0.45, density=1000.0, damping=_DAMPING)
    place = place_for(mesh, None, positions, up)
    return Body(unused_name(scene, command.name), mesh, material, position=place, friction=_FRICTION)


def place_for(
    mesh: TetMesh, position: Point | None, positions: NDArray[np.float64], up: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Where to place a mesh's origin: its box's center at `wanted`, or the whole of it above all `positions` (n, 3)."""
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
    """`stem` with the first number that no body's name has."""
    used = {body.name for body in scene.bodies}
    return next(f"{stem} {k}" for k in itertools.count(1) if f"{stem} {k}" not in used)


def check_size(scene: Scene, mesh: TetMesh) -> None:
    """Raise `CommandError` where another body with that mesh would be too much for a live page."""
    if len(scene.bodies) >= limits.MOST_BODIES:
        raise CommandError(f"there are {len(scene.bodies)} bodies already; remove one first")
    total = len(mesh.tets) + sum(len(body.mesh.tets) for body in scene.bodies)
    if total > limits.MOST_TETS:
        raise CommandError(
            f"that would make {total} tets; a live page has at most {limits.MOST_TETS}: lower the resolution"
        )


def moved_apart(
    scene: Scene, added: frozenset[str], starts: Mapping[str, NDArray[np.float64]], up: NDArray[np.float64]
) -> Scene:
    """The scene with those of its `added` bodies that would start inside another one's box placed above everything.

    Parameters
    ----------
    starts : by body name, (n, 3) of bodies that do not start as they are placed [m]
    """
    places = [starts.get(body.name, body.place(body.mesh.vertices)) for body in scene.bodies if body.name not in added]
    bodies = []
    for body in scene.bodies:
        if body.name in added:
            place = body.place(body.mesh.vertices)
            if any(_boxes_meet(place, other) for other in places):
                body = replace(body, position=place_for(body.mesh, None, np.concatenate(places), up))
                place = body.place(body.mesh.vertices)
            places.append(place)
        bodies.append(body)
    return replace(scene, bodies=bodies)


def _boxes_meet(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    return bool(np.all(a.min(axis=0) <= b.max(axis=0)) and np.all(b.min(axis=0) <= a.max(axis=0)))
