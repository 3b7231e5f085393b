"""Surfaces as CAD programs write them: exact, with long triangles."""

import numpy as np

from supple.mesh.shapes import box_surface, torus_surface
from supple.mesh.surface import SurfaceMesh


def joined(*surfaces):
    """Several surfaces as one."""
    starts = np.cumsum([0, *(len(item.vertices) for item in surfaces)])
    triangles = [item.triangles + start for item, start in zip(surfaces, starts, strict=False)]
    return SurfaceMesh(np.concatenate([item.vertices for item in surfaces]), np.concatenate(triangles))


def loops(rings):
    """The surface between closed loops (k, n, 3), each joined to the next, and the last to the first."""
    rings = np.array(rings)
    k, n = rings.shape[:2]
    i, j = (index.ravel() for index in np.meshgrid(np.arange(k), np.arange(n), indexing="ij"))
    a, b, c, d = ((i + p) % k * n + (j + q) % n for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
    surface = SurfaceMesh(rings.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))
    return surface if surface.volume > 0.0 else surface.flipped()


def plate(outer, inner, height):
    """A plate between two closed curves (n, 2), with a hole along z."""
    return loops([np.column_stack([curve, np.full(len(curve), z)]) for curve, z in
                  ((outer, 0.0), (outer, height), (inner, height), (inner, 0.0))])  # fmt: skip


def circle(radius, n):
    angle = 2.0 * np.pi * (np.arange(n) + 0.5) / n
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def square(side, n):
    round_ = circle(1.0, n)
    return 0.5 * side * round_ / np.abs(round_).max(axis=1)[:, None]


def washer():
    """40 x 40 x 3 mm with a hole of 20 mm; its corners are cut a little."""
    return plate(square(0.04, 64), circle(0.01, 64), 0.003)


def gear():
    """24 teeth, module 2 mm, 8 mm high, with a bore."""
    angle = 2.0 * np.pi * np.repeat(np.arange(24), 6) / 24 + np.tile([0.0, 0.18, 0.3, 0.4, 0.6, 0.7], 24) * np.pi / 12
    radius = 0.001 * np.tile([21.5, 21.5, 24.0, 26.0, 26.0, 24.0], 24)
    outer = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    bore = 0.005 * np.column_stack([np.cos(angle), np.sin(angle)])
    return plate(outer, bore, 0.008)


def tube_with_flange():
    """A bush: 12 mm long, walls of 2 mm, with a flange."""
    profile = [(4, 0), (4, 12), (6, 12), (6, 3), (10, 3), (10, 0)]
    return loops([0.001 * np.column_stack([circle(r, 72), np.full(72, z)]) for r, z in profile])


def cup(wall=1.5):
    """A thin cup of 70 mm, as a body of revolution whose bottoms have a hole of a tenth of a millimetre."""
    profile = [(0.05, 0), (25, 0), (32, 70), (32 - wall, 70), (25 - wall, wall), (0.05, wall)]
    return loops([0.001 * np.column_stack([circle(r, 48), np.full(48, z)]) for r, z in profile])


def panel():
    """1 m x 1 cm x 1 m, bent by 5 degrees."""
    flat = box_surface((1, 0.01, 1), (10, 1, 10))
    x, radius = flat.vertices.copy(), 1.0 / np.radians(5)
    x[:, 1] += radius - np.sqrt(radius**2 - x[:, 0] ** 2)
    return SurfaceMesh(x, flat.triangles)


def ring(tube=0.04):
    return torus_surface(0.5, tube, tube / 3)


def housing(wall):
    """A closed housing of .4 x .25 x .11 m: 24 triangles."""
    outer = np.array([0.4, 0.25, 0.11])
    return joined(box_surface(outer, (1, 1, 1)), box_surface(outer - 2 * wall, (1, 1, 1)).flipped())


def turned_tetrahedron():
    """Two of its four triangles face inward."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return SurfaceMesh(0.05 * corners, [[0, 1, 2], [0, 3, 1], [0, 3, 2], [1, 2, 3]])


def overlapping():
    """Two boxes that cut each other."""
    return joined(
        box_surface((0.04, 0.02, 0.02), (2, 1, 1)),
        box_surface((0.011, 0.05, 0.012), (1, 1, 1)).transformed(translation=(0.013, 0.002, 0.001)),
    )


def noisy_scan():
    """A ball with noise and two holes."""
    ball = torus_surface(0.03, 0.015, 0.0025)
    x = ball.vertices + np.random.default_rng(1).normal(0.0, 1.5e-4, ball.vertices.shape)
    middle = x[ball.triangles].mean(axis=1)
    kept = np.ones(len(middle), dtype=bool)
    for k in (7, 900):
        kept &= np.linalg.norm(middle - middle[k], axis=1) > 0.005
    return SurfaceMesh(x, ball.triangles[kept]).compact()


CLEAN = {"washer": washer, "gear": gear, "bush": tube_with_flange, "cup": cup, "panel": panel, "ring": ring}
