"""Ready-made bodies, centred at the origin, with y up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.kinds.validators import POSITIVE, Counts, Extents
from supple.mesh.primitives import gummy_bear as bear
from supple.mesh.primitives.filling import of_order, tets_between_layers
from supple.mesh.primitives.gummy_bear import gummy_bear_surface
from supple.mesh.primitives.isosurface_stuffing import stuff
from supple.mesh.primitives.shape import shape
from supple.mesh.primitives.sizes import counts, edge_of_torus, edge_or_share, fits, lengths, not_too_many, positive
from supple.mesh.primitives.surfaces import sheet, sphere_surface, torus_surface
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

__all__ = [
    "box",
    "box_surface",
    "cylinder",
    "cylinder_surface",
    "gummy_bear",
    "gummy_bear_surface",
    "sheet",
    "sphere",
    "sphere_surface",
    "spherical_shell",
    "torus",
    "torus_surface",
]


@shape
def box(
    size: Annotated[Sequence[float], Extents()] = (1.0, 1.0, 1.0),
    divisions: Annotated[Sequence[int], Counts(3)] = (4, 4, 4),
    order: int = 1,
) -> TetMesh:
    """A box cut into a grid of cells, each of six tets around its diagonal (Kuhn 1960).

    Vertices are in the order of `numpy.mgrid`: z runs fastest, then y, then x.

    Parameters
    ----------
    size : (3,) full edge lengths [m]
    divisions : (3,) number of cells along x, y and z
    order : 1, or 2 for quadratic tets (see `TetMesh`); the nodes on edges come after the grid's

    Raises
    ------
    MeshError : where a number is not positive, or there are too many cells.
    """
    extent, n = lengths("box", "size", size), counts("box", "divisions", divisions)
    not_too_many("box", 6.0 * n[0] * n[1] * n[2], "make divisions smaller")
    points = np.stack(np.meshgrid(*(np.linspace(-0.5, 0.5, k + 1) for k in n), indexing="ij"), axis=-1).reshape(-1, 3)
    index = np.arange(len(points)).reshape(n[0] + 1, n[1] + 1, n[2] + 1)
    # Corner 4 i + 2 j + k of each cell.
    cell = [index[i : n[0] + i, j : n[1] + j, k : n[2] + k].ravel() for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    # Each path from corner 0 to corner 7 along the axes is one tet. In half of them two corners are swapped.
    paths = [(0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7)]
    tets = np.stack([np.column_stack([cell[c] for c in path]) for path in paths], axis=1).reshape(-1, 4)
    return of_order(TetMesh(points * extent, tets), order)


@shape
def box_surface(
    size: Annotated[Sequence[float], Extents()] = (1.0, 1.0, 1.0),
    divisions: Annotated[Sequence[int], Counts(3)] = (4, 4, 4),
) -> SurfaceMesh:
    """The surface of `box`.

    Parameters
    ----------
    size : (3,) full edge lengths [m]; divisions : (3,) number of cells along x, y and z
    """
    return box(size, divisions).surface.compact()


@shape
def sphere(
    radius: Annotated[float, POSITIVE] = 0.5, edge_length: Annotated[float | None, POSITIVE] = None, order: int = 1
) -> TetMesh:
    """A ball of well-shaped tets, with its surface vertices exactly on the sphere.

    Parameters
    ----------
    radius : [m]
    edge_length : mean edge [m], at most `radius`; None: a fifth of it
    order : 1, or 2 for quadratic tets (see `TetMesh`); their surface nodes are on the sphere

    Raises
    ------
    MeshError : where a length is not positive, or the edge is too long or too short for the radius.
    """
    edge_length = edge_or_share("sphere", edge_length, 0.2, radius=radius)
    fits("sphere", edge_length, "radius", radius)
    reach = np.full(3, float(radius))
    mesh = stuff("sphere", lambda x: np.linalg.norm(x, axis=1) - radius, (-reach, reach), edge_length)
    return of_order(mesh, order, lambda x: x * (radius / np.linalg.norm(x, axis=1))[:, None])


@shape
def spherical_shell(
    inner_radius: Annotated[float, POSITIVE] = 0.3,
    outer_radius: Annotated[float, POSITIVE] = 0.5,
    edge_length: Annotated[float | None, POSITIVE] = None,
    order: int = 1,
) -> TetMesh:
    """A hollow ball: layers of prisms over the triangles of a sphere, each of three tets.

    Parameters
    ----------
    inner_radius, outer_radius : [m]
    edge_length : approximate length of edges on the outer surface and across the wall [m], at most `inner_radius`;
        None: half of the wall
    order : 1 for linear tets, 2 for quadratic ones with curved sides on both surfaces

    Raises
    ------
    MeshError : where a length is not positive, the inner radius is not the smaller one, or the edge is too long.
    """
    owner = "spherical_shell"
    positive(owner, inner_radius=inner_radius, outer_radius=outer_radius)
    if inner_radius >= outer_radius:
        raise MeshError(f"{owner}: inner_radius = {inner_radius:g} m is not below outer_radius = {outer_radius:g} m")
    edge_length = edge_or_share(owner, edge_length, 0.5, wall=outer_radius - inner_radius)
    fits(owner, edge_length, "inner_radius", inner_radius)
    surface = sphere_surface(1.0, edge_length / outer_radius)
    layers = max(1, round((outer_radius - inner_radius) / edge_length))
    not_too_many(owner, 3.0 * layers * len(surface.triangles), "make edge_length longer")
    radii = np.linspace(inner_radius, outer_radius, layers + 1)
    points = (radii[:, None, None] * surface.vertices).reshape(-1, 3)
    mesh = TetMesh(points, tets_between_layers(surface.triangles, len(surface.vertices), layers))

    def onto(x: NDArray[np.float64]) -> NDArray[np.float64]:
        distance = np.linalg.norm(x, axis=1)
        inner = distance < 0.5 * (inner_radius + outer_radius)
        return x * (np.where(inner, inner_radius, outer_radius) / distance)[:, None]

    return of_order(mesh, order, onto)


@shape
def torus(
    radius: Annotated[float, POSITIVE] = 0.5,
    tube_radius: Annotated[float, POSITIVE] = 0.2,
    edge_length: Annotated[float | None, POSITIVE] = None,
    order: int = 1,
) -> TetMesh:
    """A ring around the y axis, of well-shaped tets.

    Parameters
    ----------
    radius : of the circle in the middle of the tube [m]
    tube_radius : of the tube [m], less than `radius`
    edge_length : mean edge [m], at most `tube_radius`; None: 0.4 of that
    order : 1, or 2 for quadratic tets (see `TetMesh`); their surface nodes are on the torus

    Raises
    ------
    MeshError : where a length is not positive, the tube closes the ring, or the edge is too long or too short.
    """
    edge_length = edge_of_torus("torus", radius, tube_radius, edge_length)
    reach = np.array([radius + tube_radius, tube_radius, radius + tube_radius])

    def inside(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.hypot(np.hypot(x[:, 0], x[:, 2]) - radius, x[:, 1]) - tube_radius

    def onto(x: NDArray[np.float64]) -> NDArray[np.float64]:
        around = x * [1.0, 0.0, 1.0]
        center = radius * around / np.linalg.norm(around, axis=1)[:, None]
        return center + tube_radius * (x - center) / np.linalg.norm(x - center, axis=1)[:, None]

    return of_order(stuff("torus", inside, (-reach, reach), edge_length), order, onto)


@shape
def cylinder(
    radius: Annotated[float, POSITIVE] = 0.5,
    height: Annotated[float, POSITIVE] = 1.0,
    edge_length: Annotated[float | None, POSITIVE] = None,
    order: int = 1,
) -> TetMesh:
    """A cylinder along the y axis: rings of triangles, in layers of prisms, each of three tets.

    Parameters
    ----------
    radius, height : [m]
    edge_length : approximate length of edges [m], at most `radius` and `height`; None: a fifth of the smaller
    order : 1, or 2 for quadratic tets (see `TetMesh`); the nodes of the side are on the cylinder

    Raises
    ------
    MeshError : where a length is not positive, or the edge is too long or too short.
    """
    edge_length = edge_or_share("cylinder", edge_length, 0.2, radius=radius, height=height)
    fits("cylinder", edge_length, "radius", radius)
    fits("cylinder", edge_length, "height", height)
    rings, layers = max(2, round(radius / edge_length)), max(1, round(height / edge_length))
    not_too_many("cylinder", 18.0 * rings**2 * layers, "make edge_length longer")
    disk, triangles = _disk(rings)
    n = len(disk)
    points = np.empty((layers + 1, n, 3))
    points[:, :, 0], points[:, :, 2] = radius * disk[:, 0], radius * disk[:, 1]
    points[:, :, 1] = np.linspace(-0.5 * height, 0.5 * height, layers + 1)[:, None]

    def onto(x: NDArray[np.float64]) -> NDArray[np.float64]:
        # In the middle of an edge between two of the outermost columns; edges of the ends may be farther inside.
        distance = np.hypot(x[:, 0], x[:, 2])
        outermost = distance > radius * (np.cos(np.pi / (6 * rings)) - 1e-9)
        scale = np.where(outermost, radius / np.maximum(distance, 0.1 * radius), np.nan)
        return np.column_stack([scale * x[:, 0], x[:, 1], scale * x[:, 2]])

    return of_order(TetMesh(points.reshape(-1, 3), tets_between_layers(triangles, n, layers)), order, onto)


@shape
def gummy_bear(
    height: Annotated[float, POSITIVE] = 1.0, edge_length: Annotated[float | None, POSITIVE] = None, order: int = 1
) -> TetMesh:
    """The gummy bear; quadratic tets with `order=2` have straight sides.

    Parameters
    ----------
    height : [m]
    edge_length : mean edge [m], at most a seventh of the height; None: 0.08 of the height
    order : 1, or 2 for quadratic tets (see `TetMesh`)
    """
    return of_order(bear.gummy_bear(height, edge_or_share("gummy_bear", edge_length, 0.08, height=height)), order)


@shape
def cylinder_surface(
    radius: Annotated[float, POSITIVE] = 0.5,
    height: Annotated[float, POSITIVE] = 1.0,
    edge_length: Annotated[float | None, POSITIVE] = None,
) -> SurfaceMesh:
    """The surface of `cylinder`.

    Parameters
    ----------
    radius, height : [m]; edge_length : approximate length of edges [m]; None: a fifth of the smaller
    """
    return cylinder(radius, height, edge_length).surface.compact()


def _disk(rings: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Unit disk of concentric rings, 6 k points on ring k: points (n, 2) and triangles (m, 3)."""
    points = [np.zeros((1, 2))]
    for k in range(1, rings + 1):
        angle = 2.0 * np.pi * np.arange(6 * k) / (6 * k)
        points.append(k / rings * np.column_stack([np.cos(angle), np.sin(angle)]))
    triangles = []
    for k in range(1, rings + 1):
        # Ring k begins after 1 + 6 + ... + 6 (k - 1) points; the centre is ring 0.
        outer, inner = 1 + 3 * k * (k - 1), 1 + 3 * (k - 1) * (k - 2)
        for sector in range(6):
            out = [outer + (sector * k + j) % (6 * k) for j in range(k + 1)]
            into = [inner + (sector * (k - 1) + j) % (6 * (k - 1)) for j in range(k)] if k > 1 else [0]
            triangles += [(into[j], out[j], out[j + 1]) for j in range(k)]
            triangles += [(into[j], out[j + 1], into[j + 1]) for j in range(k - 1)]
    return np.concatenate(points), np.array(triangles, dtype=np.int64)
