"""Ambient occlusion: how much of the light of the whole sky the surfaces near a point keep from it.

The area of all surfaces is collected in the cells of a grid and blurred. At a plane, a point a little above it finds a
known density; what it finds beyond that is of other surfaces, or of its own where it is hollow.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from supple.runtime.kernel_cache import njit

Surfaces = list[tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float64]]]

_CELLS = 56  # of the longest side of the bounds of the bodies
_BLUR = 1.6  # standard deviation [cells]
_ABOVE = 1.2  # how far above its surface a point is [standard deviations]
REACH = _BLUR * _ABOVE  # [cells]
DARKEST, STEEPNESS = 0.55, 0.9
MOST = 256  # points of one triangle
# Of edges [cells]: up to the first length, what vertices know is right for their triangles; from the second one on, it
# would be spread over triangles that are much larger than the shade.
_SHORT, _LONG = 5.0, 12.0


def occlusion(surfaces: Surfaces, bodies: int, layers: Sequence[int]) -> list[NDArray[np.float64]]:
    """How dark (k,) the vertices of each surface are, from 0 to below 1.

    Parameters
    ----------
    surfaces : vertices (k, 3) [m], triangles (t, 3) and unit normals (k, 3); those of the bodies first
    bodies : number of these; the grid is about them
    layers : of each surface, how many of its parts lie on each other and count as one, as the two sides of a sheet
    """
    x = np.concatenate([own for own, _, _ in surfaces[:bodies]])
    low, high = x.min(axis=0), x.max(axis=0)
    cell = max(float((high - low).max()), 1e-9) / _CELLS
    margin = int(np.ceil((3.0 + _ABOVE) * _BLUR)) + 1
    origin = low - margin * cell
    grid = np.zeros(tuple(np.ceil((high - low) / cell).astype(int) + 2 * margin + 1))
    longest = [
        _collect(np.ascontiguousarray(own), item, origin, 1.0 / cell, 1.0 / count, grid)
        for (own, item, _), count in zip(surfaces, layers, strict=True)
    ]
    # Of the area [cells^2] in a cell, blurred: at a plane, that of a Gaussian across it.
    density = gaussian_filter(grid, _BLUR, mode="constant", truncate=3.0)
    plane = np.exp(-0.5 * _ABOVE**2) / (np.sqrt(2.0 * np.pi) * _BLUR)
    return [
        np.clip((_LONG - edges) / (_LONG - _SHORT), 0.0, 1.0)
        * _darkness(np.ascontiguousarray(own), normals, origin, 1.0 / cell, density, plane)
        for (own, _, normals), edges in zip(surfaces, longest, strict=True)
    ]


@njit(cache=True)
def _collect(x, triangles, origin, per_cell, share, grid):
    """Add a share of the area of triangles (t, 3) of vertices x (k, 3) to the cells of a grid, as points on each.

    Returns the length (k,) of the longest edge at each vertex [cells].
    """
    size, longest = grid.shape, np.zeros(len(x))
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        u, v = np.empty(3), np.empty(3)
        for k in range(3):
            u[k], v[k] = (x[b, k] - x[a, k]) * per_cell, (x[c, k] - x[a, k]) * per_cell
        one, two, three = np.sqrt((u**2).sum()), np.sqrt((v**2).sum()), np.sqrt(((u - v) ** 2).sum())
        longest[a] = max(longest[a], one, two)
        longest[b] = max(longest[b], one, three)
        longest[c] = max(longest[c], two, three)
        p, q, r = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
        area = 0.5 * np.sqrt(p * p + q * q + r * r)
        points = min(int(2.0 * area) + 1, MOST)
        for n in range(points):
            # A lattice with irrational steps fills a triangle evenly; one point is its center.
            first, second = (1.0 / 3.0 + 0.7548776662 * n) % 1.0, (1.0 / 3.0 + 0.5698402910 * n) % 1.0
            if first + second > 1.0:
                first, second = 1.0 - first, 1.0 - second
            i = int(np.floor((x[a, 0] - origin[0]) * per_cell + first * u[0] + second * v[0]))
            j = int(np.floor((x[a, 1] - origin[1]) * per_cell + first * u[1] + second * v[1]))
            k = int(np.floor((x[a, 2] - origin[2]) * per_cell + first * u[2] + second * v[2]))
            if 0 <= i < size[0] and 0 <= j < size[1] and 0 <= k < size[2]:
                grid[i, j, k] += share * area / points
    return longest


@njit(cache=True)
def _darkness(x, normals, origin, per_cell, density, plane):
    """(k,) of points x (k, 3), a little above which the density of a grid is more than that of a plane."""
    out = np.zeros(len(x))
    size = density.shape
    for n in range(len(x)):
        # Values are those in the middle of each cell.
        px = (x[n, 0] - origin[0]) * per_cell + REACH * normals[n, 0] - 0.5
        py = (x[n, 1] - origin[1]) * per_cell + REACH * normals[n, 1] - 0.5
        pz = (x[n, 2] - origin[2]) * per_cell + REACH * normals[n, 2] - 0.5
        i, j, k = int(np.floor(px)), int(np.floor(py)), int(np.floor(pz))
        if not (0 <= i < size[0] - 1 and 0 <= j < size[1] - 1 and 0 <= k < size[2] - 1):
            continue
        u, v, w = px - i, py - j, pz - k
        found = 0.0
        for a in range(2):
            for b in range(2):
                for c in range(2):
                    share = (u if a else 1.0 - u) * (v if b else 1.0 - v) * (w if c else 1.0 - w)
                    found += share * density[i + a, j + b, k + c]
        excess = max(0.0, found / plane - 1.0)
        out[n] = DARKEST * (1.0 - np.exp(-STEEPNESS * excess))
    return out
