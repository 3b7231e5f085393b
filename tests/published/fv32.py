"""A membrane 10 m long, .05 m thick, tapers from 5 m at its clamped end to 1 m; E = 200 GPa, Poisson's ratio .3,
8,000 kg/m^3. It vibrates in its plane. NAFEMS (1987), test FV32 of "Selected benchmarks for natural frequency
analysis", gives its first six frequencies.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, as_bent, mapped_box

import supple as sp

VALUES = (44.623, 130.03, 162.70, 246.05, 379.90, 391.44)


def solve(divisions):
    def place(x):
        return np.column_stack([10 * x[:, 0], (x[:, 1] - 0.5) * (5 - 4 * x[:, 0]), 0.05 * (x[:, 2] - 0.5)])

    mesh = mapped_box(divisions, place)
    x = mesh.vertices
    clamp, middle = x[:, 0] < 1e-9, np.abs(x[:, 2]) < 1e-9
    scene = sp.Scene(
        [sp.Body("membrane", mesh, sp.StVenantKirchhoff(youngs=2e11, poisson=0.3, density=8000.0))],
        pins=[sp.Pin("membrane", np.flatnonzero(clamp))],
        loads=[sp.SoftTarget("membrane", np.flatnonzero(middle & ~clamp), stiffness=(0.0, 0.0, 1e12))],
        gravity=(0, 0, 0),
    )
    modes = sp.modes(scene, 6)
    return Solution(dict(zip(REFERENCES, modes.frequencies, strict=True)), as_bent(modes, 3, 1.0))


REFERENCES = {f"mode {k + 1}": Reference(value, "Hz") for k, value in enumerate(VALUES)}
CASE = Case(
    title="FV32, tapered membrane",
    source="NAFEMS 1987",
    references=REFERENCES,
    solve=solve,
    meshes=((8, 4, 1), (24, 12, 1)),
    differs="The membrane is a slab of solid tets, whose middle plane springs of 1e12 N/m hold along its thickness; "
    "the clamp holds its thickness, too.",
    look={"direction": (0.0, 0.0, 1.0)},
)
