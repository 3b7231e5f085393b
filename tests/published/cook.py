"""A tapered panel, 48 long, is clamped at its high end (44) and loaded by a unit force along its low end (16); E = 1
and Poisson's ratio is 1/3. Cook (1974) asked for the deflection of the middle of the loaded end. The accepted value
in plane stress, 23.96, is that of refined meshes.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, graded, mapped_box, triangles_where

import supple as sp

LOAD = 1e-4  # of the unit force, so that the deflection is small, as the source has it


def panel(cells, thickness):
    """The panel in cells^2 cells, smaller towards the clamp and the sides, where stresses are singular."""

    def place(x):
        s, half = graded(x[:, 0], cells, 1.5), graded(1 - np.abs(2 * x[:, 1] - 1), cells // 2, 1.5) / 2
        t = np.where(x[:, 1] < 0.5, half, 1 - half)
        return np.column_stack([48 * s, 44 * s + t * (44 - 28 * s), thickness * (x[:, 2] - 0.5)])

    return mapped_box((cells, cells, 1), place)


def solve(cells):
    thickness = 1.0
    mesh = panel(cells, thickness)
    x = mesh.vertices
    end = x[:, 0] > 48 - 1e-9
    scene = sp.Scene(
        [sp.Body("panel", mesh, sp.StableNeoHookean(youngs=1.0, poisson=1 / 3))],
        pins=[sp.Pin("panel", np.flatnonzero(x[:, 0] < 1e-9))],
        loads=[sp.Traction("panel", (0.0, LOAD / 16 / thickness, 0.0), triangles_where(mesh, end))],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene)[-1]
    middle = end & (np.abs(x[:, 1] - 52) < 1e-6)
    return Solution({"deflection": (frame.positions["panel"] - x)[middle, 1].mean() / LOAD}, frame)


CASE = Case(
    title="Cook's membrane, plane stress",
    source="Cook 1974",
    references={"deflection": Reference(23.96, "1")},
    solve=solve,
    meshes=(4, 16),
    differs="The panel is one thick; the clamp holds its thickness, too.",
)
