"""The 45 degree bend of Bathe and Bolourchi (1979) under five times their largest load, 3,000 lb. The reference is
that of later papers on geometrically exact beams; it could not be checked against a print.
"""

import numpy as np
from tests.published.bend import RADIUS, tips
from tests.published.case import Case, Reference, Solution


def solve(divisions):
    places, frame = tips(divisions, tuple(np.linspace(375, 3000, 8)))
    start = RADIUS * np.array([1 - np.cos(np.pi / 4), np.sin(np.pi / 4), 0])
    return Solution({"end moves by": places[-1] - start}, frame)


CASE = Case(
    title="45 degree bend, 3,000 lb",
    source="Bathe 1979",
    references={"end moves by": Reference((-25.04, -47.78, 68.52), "in")},
    solve=solve,
    meshes=((12, 1, 1), (32, 2, 2)),
)
