"""The gummy bear: smoothly blended balls and capsules, as tets or as a surface."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.kinds.validators import POSITIVE, Integer
from supple.mesh.primitives.isosurface_stuffing import stuff
from supple.mesh.primitives.shape import shape
from supple.mesh.primitives.sizes import fits, not_too_many, positive
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.mesh.topology import without_unused

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


@shape
def gummy_bear_surface(
    height: Annotated[float, POSITIVE] = 1.0, resolution: Annotated[int, Integer(16, 1_000_000)] = 64
) -> SurfaceMesh:
    """The bear's surface, watertight: that of its tets.

    Parameters
    ----------
    height : [m]
    resolution : the height in mean edges, 16 or more

    Raises
    ------
    MeshError : where a number is out of range.
    """
    positive("gummy_bear_surface", height=height)
    if isinstance(resolution, bool) or not isinstance(resolution, int | np.integer) or resolution < 16:
        raise MeshError(f"gummy_bear_surface: resolution is {resolution!r}; give a whole number, 16 or more")
    not_too_many("gummy_bear_surface", float(resolution) ** 3, "make resolution smaller")
    tets = gummy_bear(height, height / resolution)
    return SurfaceMesh(*without_unused(tets.vertices, tets.surface.triangles))


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
