"""Andrews' squeezing mechanism: seven plane bodies, ten hinges, one spring, driven from rest by a motor of .033 N m;
the first body makes two and a half turns in .03 s. Schiehlen (1990) made it a test of multibody codes, IFToMM's A03 has
it, and the angles at .03 s are those of the Test Set for IVP Solvers (Mazzia, Magherini 2008), problem "Andrews".
"""

from typing import Any

import numpy as np
from tests.published.case import DYNAMIC, Case, Reference, Solution, simulated

import supple as sp

# Angles of the start and at .03 s: beta, Theta, gamma, Phi, delta, Omega, epsilon [rad].
START = (
    *(-0.0617138900142764496, 0.0, 0.455279819163070380, 0.222668390165885885),
    *(0.487364979543842550, -0.222668390165885885, 1.23054744454982119),
)
END = (15.8107711962990, -15.7563710598430, 0.0408222401307310, -0.534730116322670, 0.524409965880530, 0.53473011632267)
END = (*END, 1.04808074104226)
MASSES = (0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498)
INERTIAS = (2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
XA, YA, XB, YB, XC, YC = -0.06934, -0.00227, -0.03635, 0.03273, 0.014, 0.072
D, DA, E, EA, RR, RA = 0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092
SA, SB, SC, SD = 0.01874, 0.01043, 0.018, 0.02
TA, TB, U, UA, UB, ZF, ZT, FA = 0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421


def directions(angle):
    """Along an angle in the plane, and across it."""
    return np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])


def solve(dt):
    b, T, g, p, d, o, e = START
    A, B = np.array([XA, YA, 0.0]), np.array([XB, YB, 0.0])
    (b1, _), (bt, _), (g1, g2), (d1, d2) = directions(b), directions(b + T), directions(g), directions(d)
    (_, pd2), (oe1, _), (e1, e2) = directions(p + d), directions(o + e), directions(e)
    crank, middle = RR * b1, RR * b1 - D * bt
    E45, E67 = A + ZT * d1, A - U * e2
    centers = (
        *(RA * b1, crank - DA * bt, B - SA * g2 + SB * g1, E45 - (E - EA) * pd2),
        *(A + TA * d1 + TB * d2, E67 + (ZF - FA) * oe1, A - UA * e2 - UB * e1),
    )
    cube = sp.shapes.box_surface((0.03, 0.03, 0.005), (1, 1, 1))
    bodies = [
        sp.RigidBody(f"K{k + 1}", cube, mass=m, inertia=(J, J, J), position=c, center=(0, 0, 0))
        for k, (m, J, c) in enumerate(zip(MASSES, INERTIAS, centers, strict=True))
    ]
    places = {
        ("K1", None): (0, 0, 0), ("K2", "K1"): crank, ("K3", "K2"): middle, ("K4", "K2"): middle, ("K6", "K2"): middle,
        ("K3", None): B, ("K5", "K4"): E45, ("K5", None): A, ("K7", "K6"): E67, ("K7", None): A,
    }  # fmt: skip
    motor = sp.ForceMotor(0.033)
    joints = [
        sp.HingeJoint(*pair, point=place, motor=motor if pair == ("K1", None) else None, name=f"{pair[0]}-{pair[1]}")
        for pair, place in places.items()
    ]
    hook = B + SC * -g2 + SD * g1
    spring = sp.Spring(("K3", tuple(hook - centers[2])), (None, (XC, YC, 0.0)), stiffness=4530.0, rest_length=0.07785)
    scene = sp.Scene(bodies, joints=joints, loads=[spring], gravity=(0, 0, 0))
    values: dict[str, Any] = {}
    frame: Any = None
    for name, solver in DYNAMIC.items():
        frames = simulated(scene, solver, dt, 0.03)
        frame = frames[-1]
        turned = [
            np.unwrap([np.arctan2(*f.poses[f"K{k}"].rotation[1::-1, 0]) for f in frames])[-1] for k in (1, 3, 5, 7)
        ]
        values[f"angles at .03 s, {name}"] = np.array([b, g, d, e]) + turned
    return Solution(values, frame)


ANGLES = tuple(END[k] for k in (0, 2, 4, 6))
CASE = Case(
    title="Andrews' squeezing mechanism",
    source="Schiehlen 1990",
    references={f"angles at .03 s, {name}": Reference(ANGLES, "rad", coarse=0.06) for name in DYNAMIC},
    solve=solve,
    meshes=(1.5e-4, 2.5e-5),
    differs="The angles are those of the crank (beta), and of the three bodies that turn about fixed points (gamma, "
    "delta, epsilon). Coarse and fine are steps of 1.5e-4 and 2.5e-5 s.",
)
