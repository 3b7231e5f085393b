"""The gummy bear: smoothly blended balls and capsules, as tets or as a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.primitives.isosurface_stuffing import stuff
from supple.mesh.primitives.sizes import fits, not_too_many, positive
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.mesh.topology import unique_edges

# For a bear of height 1, feet at y = 0, looking along +z. Parts with x > 0 are mirrored. The last number is the
# width [m] of the blend with the parts before.
BELLY = ((0.0, 0.34, 0.0), (0.235, 0.30, 0.20))  # centre and radii of an ellipsoid
BALLS = (
    ((0.0, 0.31, 0.10), 0.165, 0.06),  # front of the belly
    ((0.0, 0.72, 0.02), 0.195, 0.05),  # head
    ((0.0, 0.675, 0.2), 0.082, 0.035),  # muzzle
    ((0.0, 0.713, 0.276), 0.026, 0.012),  # nose
    ((0.15, 0.915, -0.01), 0.085, 0.03),  # ears
    ((0.078, 0.785, 0.187), 0.021, 0.008),  # eyes
)
CAPSULES = (
    ((0.185, 0.50, 0.06), (0.135, 0.435, 0.245), 0.068, 0.03),  # arms, in front of the belly
    ((0.145, 0.13, 0.06), (0.15, 0.095, 0.25), 0.095, 0.03),  # legs
)
HOLLOWS = (((0.152, 0.93, 0.085), 0.045, 0.02),)  # inside of the ears
LOW, HIGH = np.array([-0.27, 0.0, -0.205]), np.array([0.27, 1.0, 0.345])
SMOOTHING_ROUNDS = 12


def gummy_bear(height: float = 1.0, edge_length: float = 0.08) -> TetMesh:
    """A sitting bear of well-shaped tets, about the origin, looking along +z.

    Parameters
    ----------
    height : [m]
    edge_length : mean edge [m], at most a seventh of the height

    Raises
    ------
    MeshError : where a length is not positive, or the edge too long or too short for the height.
    """
    positive("gummy_bear", height=height, edge_length=edge_length)
    fits("gummy_bear", edge_length, "a seventh of the height", height / 7.0)
    middle = 0.5 * (LOW + HIGH)
    mesh = stuff("gummy_bear", lambda x: bear_distance(x + middle), (LOW - middle, HIGH - middle), edge_length / height)
    return TetMesh(mesh.vertices * height, mesh.tets)


def gummy_bear_surface(height: float = 1.0, resolution: int = 64) -> SurfaceMesh:
    """The bear's surface, watertight: marching cubes, then vertices spread evenly over the surface.

    Parameters
    ----------
    height : [m]
    resolution : number of cells along the height, 16 or more

    Raises
    ------
    MeshError : where a number is out of range.
    """
    positive("gummy_bear_surface", height=height)
    if isinstance(resolution, bool) or not isinstance(resolution, int | np.integer) or resolution < 16:
        raise MeshError(f"gummy_bear_surface: resolution is {resolution!r}; give a whole number, 16 or more")
    not_too_many("gummy_bear_surface", float(resolution) ** 3, "make resolution smaller")
    points, triangles = _marching_cubes(int(resolution))
    points = _spread(points, triangles)
    return SurfaceMesh((points - 0.5 * (LOW + HIGH)) * height, triangles)


def bear_distance(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Approximate signed distance (k,) of points (k, 3) from the surface of the bear of height 1; negative inside."""
    mirrored = points * (-1.0, 1.0, 1.0)
    x = np.where(points[:, :1] < 0.0, mirrored, points)
    center, radii = (np.array(v) for v in BELLY)
    # Distance from an ellipsoid, right to first order: f / |grad f|.
    scaled, steep = (x - center) / radii, (x - center) / radii**2
    length = np.linalg.norm(scaled, axis=1)
    distance = length * (length - 1.0) / np.maximum(np.linalg.norm(steep, axis=1), 1e-12)
    for ball, radius, blend_width in BALLS:
        distance = _blended(distance, np.linalg.norm(x - ball, axis=1) - radius, blend_width)
    for start, end, radius, blend_width in CAPSULES:
        distance = _blended(distance, _to_segment(x, np.array(start), np.array(end)) - radius, blend_width)
    for ball, radius, blend_width in HOLLOWS:
        distance = -_blended(-distance, np.linalg.norm(x - ball, axis=1) - radius, blend_width)
    return distance


def _blended(a: NDArray[np.float64], b: NDArray[np.float64], blend_width: float) -> NDArray[np.float64]:
    """Smooth minimum: quadratic where the two differ by less than `blend_width`, the plain one elsewhere."""
    overlap = np.maximum(blend_width - np.abs(a - b), 0.0)
    return np.minimum(a, b) - overlap**2 / (4.0 * blend_width)


def _to_segment(x: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
    along = end - start
    t = np.clip((x - start) @ along / (along @ along), 0.0, 1.0)
    return np.linalg.norm(x - start - t[:, None] * along, axis=1)


def _marching_cubes(resolution: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    from skimage.measure import marching_cubes

    spacing = 1.0 / resolution
    low = LOW - 2.0 * spacing
    shape = np.ceil((HIGH - LOW) / spacing).astype(int) + 5
    grid = np.stack(np.meshgrid(*(np.arange(n) * spacing for n in shape), indexing="ij"), axis=-1)
    values = bear_distance(grid.reshape(-1, 3) + low).reshape(shape)
    points, triangles, _, _ = marching_cubes(
        values, 0.0, spacing=(spacing,) * 3, gradient_direction="descent", allow_degenerate=False
    )
    return points.astype(np.float64) + low, triangles.astype(np.int32)


def _spread(points: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    """Move each vertex along the surface towards the middle of its neighbours, then back onto the surface; repeat.

    This removes the slivers of marching cubes where the surface passes close to a grid point.
    """
    edges = unique_edges(triangles, len(points))
    both = np.concatenate([edges, edges[:, ::-1]])
    degree = np.bincount(both[:, 0], minlength=len(points))
    for _ in range(SMOOTHING_ROUNDS):
        middle = np.column_stack(
            [np.bincount(both[:, 0], weights=points[both[:, 1], k], minlength=len(points)) for k in range(3)]
        )
        step = middle / degree[:, None] - points
        _, normal = _value_and_gradient(points)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        points = points + 0.7 * (step - np.einsum("ij,ij->i", step, normal)[:, None] * normal)
        points = points - bear_distance(points)[:, None] * normal
    for _ in range(2):
        value, gradient = _value_and_gradient(points)
        points = points - (value / np.einsum("ij,ij->i", gradient, gradient))[:, None] * gradient
    return points


def _value_and_gradient(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    h = 1e-6
    value = bear_distance(points)
    return value, np.column_stack([(bear_distance(points + s) - value) / h for s in h * np.eye(3)])
