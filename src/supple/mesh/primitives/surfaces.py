"""Ready-made surfaces that do not come from a tet mesh: sheet, sphere and torus."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from supple.kinds.validators import POSITIVE
from supple.mesh.primitives.shape import shape
from supple.mesh.primitives.sizes import edge_of_torus, edge_or_share, fits, not_too_many
from supple.mesh.surface import SurfaceMesh
from supple.mesh.topology import merge_map


@shape
def sheet(
    length: Annotated[float, POSITIVE] = 1.0,
    width: Annotated[float, POSITIVE] = 1.0,
    edge_length: Annotated[float | None, POSITIVE] = None,
) -> SurfaceMesh:
    """A rectangle in the plane y = 0, which faces up: cells cut along one diagonal and the other in turns.

    Vertices are in rows: z runs fastest, then x.

    Parameters
    ----------
    length, width : along x and z [m]
    edge_length : of the edges of cells [m], at most; None: a tenth of the smaller side

    Raises
    ------
    MeshError : where a length is not positive, or the edge is too long or too short for the sides.
    """
    edge_length = edge_or_share("sheet", edge_length, 0.1, length=length, width=width)
    fits("sheet", edge_length, "shorter side", min(length, width))
    nx, nz = (math.ceil(side / edge_length * (1.0 - 1e-9)) for side in (length, width))
    not_too_many("sheet", 2.0 * nx * nz, "make edge_length longer")
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(nx + 1), np.arange(nz + 1), indexing="ij"))
    x = np.column_stack([length * (i / nx - 0.5), np.zeros(len(i)), width * (j / nz - 0.5)])
    i, j = (axis.ravel() for axis in np.meshgrid(np.arange(nx), np.arange(nz), indexing="ij"))
    a = i * (nz + 1) + j
    b, c, d = a + nz + 1, a + nz + 2, a + 1
    turned = ((i + j) % 2 == 1)[:, None]
    first = np.where(turned, np.column_stack([a, c, b]), np.column_stack([a, d, b]))
    second = np.where(turned, np.column_stack([a, d, c]), np.column_stack([b, d, c]))
    return SurfaceMesh(x, np.stack([first, second], axis=1).reshape(-1, 3))


@shape
def sphere_surface(
    radius: Annotated[float, POSITIVE] = 0.5, edge_length: Annotated[float | None, POSITIVE] = None
) -> SurfaceMesh:
    """A sphere of nearly equal triangles: an icosahedron with its faces cut into smaller ones.

    Parameters
    ----------
    radius : [m]
    edge_length : approximate length of edges [m], at most `radius`; None: a fifth of the radius

    Raises
    ------
    MeshError : where a length is not positive, or the edge is too long or too short for the radius.
    """
    edge_length = edge_or_share("sphere_surface", edge_length, 0.2, radius=radius)
    fits("sphere_surface", edge_length, "radius", radius)
    # An edge of the icosahedron spans the angle arctan 2.
    n = max(1, math.ceil(radius * math.atan(2.0) / edge_length))
    not_too_many("sphere_surface", 20.0 * n**2, "make edge_length longer")
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    signs = [(a, b) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    corners = np.array([np.roll((0.0, a, b * golden), shift) for shift in range(3) for a, b in signs])
    corners /= np.linalg.norm(corners[0])
    near = np.linalg.norm(corners[:, None] - corners[None], axis=2) < 1.1
    faces = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[k, i]
    ]
    # A face has rows of points i, j with i + j <= n; row i begins where the longer rows before it end.
    grid = np.array([(i, j) for i in range(n + 1) for j in range(n + 1 - i)])
    begin = np.cumsum([0] + [n + 1 - i for i in range(n + 1)])
    up = [(begin[i] + j, begin[i + 1] + j, begin[i] + j + 1) for i in range(n) for j in range(n - i)]
    down = [(begin[i + 1] + j, begin[i + 1] + j + 1, begin[i] + j + 1) for i in range(n - 1) for j in range(n - 1 - i)]
    pattern = np.array(up + down)
    points, triangles = [], []
    for face in faces:
        a, b, c = corners[list(face)]
        if np.dot(a, np.cross(b, c)) < 0.0:
            b, c = c, b
        flat = a + grid[:, :1] / n * (b - a) + grid[:, 1:] / n * (c - a)
        triangles.append(pattern + len(grid) * len(points))
        points.append(flat / np.linalg.norm(flat, axis=1, keepdims=True))
    every = radius * np.concatenate(points)
    keep, index = merge_map(every, 1e-3 * radius / n)
    return SurfaceMesh(every[keep], index[np.concatenate(triangles)])


@shape
def torus_surface(
    radius: Annotated[float, POSITIVE] = 0.5,
    tube_radius: Annotated[float, POSITIVE] = 0.2,
    edge_length: Annotated[float | None, POSITIVE] = None,
) -> SurfaceMesh:
    """A ring around the y axis as a grid of triangles.

    Parameters
    ----------
    radius : of the circle in the middle of the tube [m]
    tube_radius : of the tube [m], less than `radius`
    edge_length : of edges along the middle of the tube and around it [m], at most `tube_radius`; None: 0.4 of that

    Raises
    ------
    MeshError : as `torus`.
    """
    edge_length = edge_of_torus("torus_surface", radius, tube_radius, edge_length)
    n = math.ceil(2.0 * math.pi * radius / edge_length)
    m = math.ceil(2.0 * math.pi * tube_radius / edge_length)
    not_too_many("torus_surface", 2.0 * n * m, "make edge_length longer")
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    around, tube = 2.0 * np.pi * i / n, 2.0 * np.pi * j / m
    reach = radius + tube_radius * np.cos(tube)
    points = np.stack([reach * np.cos(around), tube_radius * np.sin(tube), reach * np.sin(around)], axis=-1)
    index = i * m + j
    onward, above = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    both = np.roll(onward, -1, axis=1)
    triangles = np.concatenate([np.stack([index, above, both], axis=-1), np.stack([index, both, onward], axis=-1)])
    return SurfaceMesh(points.reshape(-1, 3), triangles.reshape(-1, 3))
