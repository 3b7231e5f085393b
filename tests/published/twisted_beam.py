"""A cantilever, 12 in long, 1.1 in wide and 0.32 in thick, is twisted by 90 degrees from its clamp to its end; E =
29e6 psi and Poisson's ratio is 0.22. A unit force acts on the end, once along the width of the end and once across
it. MacNeal and Harder (1985) give the deflections along the force; Zupan and Saje (2004) found them within 0.2 % by
another theory.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, mapped_box, nearest, triangles_where

import supple as sp

LENGTH, WIDTH, THICKNESS = 12.0, 1.1, 0.32


def twisted(divisions):
    """Along x; at the clamp the width is along z, at the end along y."""

    def place(x):
        angle = x[:, 0] * np.pi / 2
        w, t = WIDTH * (x[:, 1] - 0.5), THICKNESS * (x[:, 2] - 0.5)
        return np.column_stack(
            [LENGTH * x[:, 0], w * np.sin(angle) + t * np.cos(angle), w * np.cos(angle) - t * np.sin(angle)]
        )

    return mapped_box(divisions, place)


def solve(divisions):
    mesh = twisted(divisions)
    x = mesh.vertices
    end = x[:, 0] > LENGTH - 1e-9
    middle, values, frame = nearest(mesh, (LENGTH, 0, 0)), {}, None
    for name, axis in AXES.items():
        force = np.eye(3)[axis] / (WIDTH * THICKNESS)
        scene = sp.Scene(
            [sp.Body("beam", mesh, sp.StVenantKirchhoff(youngs=29e6, poisson=0.22))],
            pins=[sp.Pin("beam", np.flatnonzero(x[:, 0] < 1e-9))],
            loads=[sp.Traction("beam", force, triangles_where(mesh, end))],
            gravity=(0, 0, 0),
        )
        frame = equilibria(scene)[-1]
        values[name] = frame.positions["beam"][middle, axis] - x[middle, axis]
    assert frame is not None
    return Solution(values, frame)


AXES = {"along the width of the end": 1, "across it": 2}
CASE = Case(
    title="Twisted beam",
    source="MacNeal, Harder 1985",
    references={
        "along the width of the end": Reference(0.005424, "in"),
        "across it": Reference(0.001754, "in"),
    },
    solve=solve,
    meshes=((12, 2, 2), (24, 4, 2)),
)
