"""A thick rubber cylinder, inner radius 1 m and outer radius 2 m, in plane strain, is blown up until its inner radius
has grown by half. Rivlin (1949) gives the pressure for an incompressible Neo-Hookean material, here by SciPy's
integral of the equilibrium along the radius. The material has nu = 0.4999.
"""

import numpy as np
from scipy.integrate import quad
from tests.published.case import Case, Reference, Solution
from tests.published.lame import INNER, OUTER, quarter_cylinder

import supple as sp

MU, GROWN = 1e5, 1.5


def pressure():
    """p = integral of mu (s^2 - 1 / s^2) dr / r over the deformed wall, where s = r / R and r^2 - R^2 is constant."""
    area = (GROWN * INNER) ** 2 - INNER**2

    def slope(r):
        s = r / np.sqrt(r**2 - area)
        return MU * (s**2 - s**-2) / r

    return quad(slope, GROWN * INNER, np.sqrt(OUTER**2 + area))[0]


def solve(divisions):
    law = sp.StableNeoHookean(youngs=2 * MU * 1.4999, poisson=0.4999)
    load = sp.Curve([0.0, 1.0], [0.0, pressure()])
    frame, mesh = quarter_cylinder(divisions, 0.3, law, load)
    inner = np.hypot(*mesh.vertices[:, :2].T) < INNER + 1e-9
    return Solution({"inner radius": np.hypot(*frame.positions["cylinder"][inner, :2].T).mean()}, frame)


CASE = Case(
    title="Inflated rubber cylinder",
    source="Rivlin 1949",
    references={"inner radius": Reference(GROWN, "m")},
    solve=solve,
    meshes=((6, 3, 1), (12, 6, 1)),
    look={"color": "von_mises"},
)
