"""The scenes that every program simulates for `supple check`, with NumPy alone: SI units, z up.

drop     a cube of 0.4 m falls on the floor, one corner first
stack    three cubes fall on each other, each a little beside the one below
twist    a free beam whose ends turn against each other at 20 rad/s
squeeze  a free cube whose upper and lower side move towards each other at 8 m/s each
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

YOUNGS, POISSON, DENSITY = 5e4, 0.4, 1000.0
FPS, FRAMES = 60, 60
NAMES = ("drop", "stack", "twist", "squeeze")
# Of the six tets of a cell, all around the diagonal from corner 0 to corner 7.
_PATHS = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]]


@dataclass
class Scene:
    """Points (n, 3), velocities (n, 3), tets (m, 4); for each body the end of its points and of its tets."""

    points: np.ndarray
    velocities: np.ndarray
    tets: np.ndarray
    ends: list
    gravity: float
    floor: bool

    def bodies(self):
        """For each body its points, velocities and tets, numbered in the body."""
        starts = [(0, 0), *self.ends]
        for (a, s), (b, t) in pairwise(starts):
            yield self.points[a:b], self.velocities[a:b], self.tets[s:t] - a


def grid(size, counts):
    """A box around the origin, and its tets."""
    axes = [np.linspace(-0.5 * s, 0.5 * s, n + 1) for s, n in zip(size, counts, strict=True)]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(x)).reshape([n + 1 for n in counts])
    i, j, k = np.meshgrid(*[np.arange(n) for n in counts], indexing="ij")
    corners = np.stack([number[i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)].ravel() for c in range(8)], axis=1)
    tets = corners[:, _PATHS].reshape(-1, 4)
    edges = x[tets[:, 1:]] - x[tets[:, :1]]
    negative = np.linalg.det(edges) < 0
    tets[negative] = tets[negative][:, [1, 0, 2, 3]]
    return x, tets


def scene(name):
    """A scene by its name."""
    cube, tets = grid((0.4, 0.4, 0.4), (4, 4, 4))
    if name == "drop":
        axis = np.cross([1, 1, 1], [0, 0, 1]) / np.sqrt(2.0)
        angle = np.arccos(1 / np.sqrt(3.0))
        K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        x = cube @ (np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K).T
        return _joined([(x + np.array([0, 0, 0.3 - x[:, 2].min()]), np.zeros_like(x), tets)], -9.81, True)
    if name == "stack":
        parts = [(cube + np.array([0.05 * k, 0.03 * k, 0.25 + 0.45 * k]), np.zeros_like(cube), tets) for k in range(3)]
        return _joined(parts, -9.81, True)
    if name == "twist":
        beam, tets = grid((1.2, 0.2, 0.2), (12, 2, 2))
        rate = 20.0 * beam[:, 0] / 0.6
        v = np.column_stack([np.zeros(len(beam)), -rate * beam[:, 2], rate * beam[:, 1]])
        return _joined([(beam + np.array([0, 0, 1]), v, tets)], 0.0, False)
    v = np.column_stack([np.zeros(len(cube)), np.zeros(len(cube)), -8.0 * cube[:, 2] / 0.2])
    return _joined([(cube + np.array([0, 0, 1]), v, tets)], 0.0, False)


def _joined(parts, gravity, floor):
    ends, count, rows, points, velocities, tets = [], 0, 0, [], [], []
    for x, v, own in parts:
        points.append(x)
        velocities.append(v)
        tets.append(own + count)
        count, rows = count + len(x), rows + len(own)
        ends.append((count, rows))
    return Scene(np.concatenate(points), np.concatenate(velocities), np.concatenate(tets), ends, gravity, floor)


def lumped_masses(own):
    """(n,) a quarter of each tet's mass on each of its corners."""
    edges = own.points[own.tets[:, 1:]] - own.points[own.tets[:, :1]]
    shares = DENSITY * np.abs(np.linalg.det(edges)) / 24
    return np.bincount(own.tets.ravel(), np.repeat(shares, 4), len(own.points))


def save(path, frames, own, masses):
    """What `supple check` reads; masses : (n,) of the points, as the program has them."""
    np.savez_compressed(
        path, positions=np.stack(frames), tets=own.tets, times=np.arange(len(frames)) / FPS, masses=masses
    )
