"""Cook's membrane in plane strain with lambda = 7,500 and mu = 0.375, that is nu = 0.499975: elements that lock in
volume show here. Krysl's FinEtools has 16.4326 for the deflection of the middle of the loaded end, extrapolated from
refined meshes (Cook_3D_strain.m); the outline and the load are those of Cook (1974).
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, rollers, triangles_where
from tests.published.cook import LOAD, panel

import supple as sp

LAMBDA, MU = 7500.0, 0.375
POISSON = LAMBDA / (2 * (LAMBDA + MU))
YOUNGS = 2 * MU * (1 + POISSON)


def solve(cells):
    mesh = panel(cells, 48 / cells)
    x = mesh.vertices
    end, side = x[:, 0] > 48 - 1e-9, np.abs(x[:, 2]) > 0.5 * 48 / cells - 1e-9
    scene = sp.Scene(
        [sp.Body("panel", mesh, sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON))],
        pins=[sp.Pin("panel", np.flatnonzero(x[:, 0] < 1e-9))],
        soft_targets=[rollers("panel", mesh, 2, side, YOUNGS)],
        loads=[sp.Traction("panel", (0.0, LOAD / 16, 0.0), triangles_where(mesh, end))],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene)[-1]
    middle = end & (np.abs(x[:, 1] - 52) < 1e-6)
    return Solution({"deflection": (frame.positions["panel"] - x)[middle, 1].mean() / LOAD}, frame)


CASE = Case(
    title="Cook's membrane, plane strain, nu = 0.499975",
    source="FinEtools (Krysl)",
    references={"deflection": Reference(16.4326, "1")},
    solve=solve,
    meshes=(6, 16),
)
