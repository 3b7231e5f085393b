"""Two equal balls of radius 50 mm, E = 20,000 MPa and Poisson's ratio .3 are pressed together. Hertz (1882) gives the
radius of contact sqrt(R h / 2), and the pressure in its middle E / (1 - nu^2) sqrt(2 h / R) / pi, with the approach h
of their centers. Code_Aster's SSNV104 has h = 4 mm, and so 10 mm and 2,798.3 MPa; a hundredth of that h gives a tenth
of both.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution
from tests.solvers.implicit.contact import test_hertz as ball

import supple as sp

R_MM, A_MM, P_MPA = 50.0, 1.0, 279.83  # A / R is that of the imported mesh


def solve(cells):
    mesh, held = ball.graded_block(cells)

    def moved(time):
        d = ball.APPROACH * time
        return ball.boussinesq(mesh.vertices[held], ball.hertz(d)) - [0, d + 0.1 * ball.DHAT, 0]

    material = sp.StableNeoHookean(youngs=ball.YOUNGS, poisson=ball.POISSON, density=1000.0)
    scene = sp.Scene(
        [sp.Body("ball", mesh, material, position=(0, 1.1 * ball.DHAT, 0))],
        [sp.HalfSpace(name="plane")],
        pins=[sp.Pin("ball", vertices=held, motion=moved)],
        gravity=(0, 0, 0),
    )
    solver = sp.Implicit(integrator="static", contact=sp.IPCContact(dhat=ball.DHAT))
    (frame,) = sp.simulate(scene, solver, 1.0, 1, strict=True)
    contacts = frame.contacts
    assert contacts is not None
    forces = contacts.forces[:, 1]
    force = float(forces.sum())
    # Without deformation, the ball would be below the plane by the way that it went less the gap.
    d = ball.APPROACH - ball.DHAT + forces @ contacts.distances / force
    # Hertz's pressure has a mean square radius of two fifths of the circle's.
    squared = contacts.points[:, 0] ** 2 + contacts.points[:, 2] ** 2
    radius = np.sqrt(2.5 * (forces @ squared) / force) / np.sqrt(ball.RADIUS * d)
    pressure = force / ball.hertz(d) / radius**2
    return Solution({"radius of contact": A_MM * radius, "pressure in the middle": P_MPA * pressure}, frame)


CASE = Case(
    title="Hertz: ball on ball, ball on plane",
    source="Hertz 1882",
    references={
        "radius of contact": Reference(A_MM, "mm"),
        "pressure in the middle": Reference(P_MPA, "MPa", coarse=0.09),
    },
    solve=solve,
    meshes=(4, 8),
    differs="By symmetry, one of two equal balls touches a plane that is rigid. With a = R / 5 the source is "
    "beyond what Hertz's theory is made for: small parts of paraboloids. The region around the contact is "
    "meshed, and its faces are where Boussinesq's solution has them. The pressure is 3 F / (2 pi a^2), "
    "with a from the second moment of the forces.",
)
