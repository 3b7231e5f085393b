"""A cube is sheared by 0.5 with all its faces moved along. Rivlin (1948) gives the stresses of a Neo-Hookean
material: mu gamma on the planes of the shear, and the difference mu gamma^2 of the normal stresses, without which the
cube would not stay a parallelepiped (Poynting's effect). For every isotropic material the ratio of the two is gamma.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria

import supple as sp

MU, GAMMA = 1e5, 0.5


def solve(cells):
    mesh = sp.shapes.box((1, 1, 1), (cells, cells, cells), order=2)
    x = mesh.vertices
    outside = np.unique(mesh.surface.triangles)
    sheared = np.column_stack([GAMMA * (x[outside, 1] + 0.5), np.zeros((len(outside), 2))])
    law = sp.MooneyRivlin(c10=0.4 * MU, c01=0.1 * MU, bulk=1e7)
    scene = sp.Scene(
        [sp.Body("cube", mesh, law)],
        pins=[sp.Pin("cube", outside, lambda t: t * sheared)],
        gravity=(0, 0, 0),
    )
    frame = equilibria(scene)[-1]
    stress = frame.stress["cube"].mean(axis=0)
    difference = stress[0, 0] - stress[1, 1]
    return Solution({"shear stress": stress[0, 1] / MU, "difference over it": difference / stress[0, 1]}, frame)


CASE = Case(
    title="Simple shear of rubber",
    source="Rivlin 1948",
    references={"shear stress": Reference(GAMMA, "mu"), "difference over it": Reference(GAMMA, "1")},
    solve=solve,
    meshes=(1, 2),
    differs="The material is of Mooney and Rivlin, of which the Neo-Hookean one is a special case.",
    look={"color": "von_mises"},
)
