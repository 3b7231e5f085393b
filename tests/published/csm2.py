"""The flag of CSM1 four times as stiff: mu = 2 MPa. Turek and Hron (2006), CSM2, give where the middle of its end
goes.
"""

from tests.published.case import Case, Reference
from tests.published.csm1 import solved

CASE = Case(
    title="Stiffer flag under its weight (CSM2)",
    source="Turek, Hron 2006",
    references={"end moves by": Reference((-0.4690, -16.97), "mm")},
    solve=lambda divisions: solved(divisions, 2e6),
    meshes=((20, 1, 1), (64, 3, 1)),
    look={"color": "von_mises"},
)
