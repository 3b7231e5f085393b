"""A disk spins on a ball joint, upright and 5.7 degrees off, under gravity. Upright it sleeps where (I3 w)^2 exceeds
4 m g l I1 (Lagrange's top; Goldstein, "Classical Mechanics", section 5.7): here with 1.2 times the critical spin w it
only nutates, and with .8 times it falls. The largest tilts are those of the equation of Lagrange's top, by SciPy's
Runge-Kutta method of order 8.
"""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from tests.published.case import DYNAMIC, Case, Reference, Solution, simulated

import supple as sp

G, ARM, TILT, END = 9.81, 0.1, 0.1, 1.0
MASS, ABOUT, ACROSS = 1.0, 0.02, 0.0102  # of a disk [kg], [kg m^2]
I1 = ACROSS + MASS * ARM**2
CRITICAL = 2 * np.sqrt(MASS * G * ARM * I1) / ABOUT


def largest_tilt(spin):
    momentum = ABOUT * spin * np.cos(TILT)

    def rates(t, y):
        s, c = np.sin(y[0]), np.cos(y[0])
        turn = (momentum - ABOUT * spin * c) / (I1 * s * s)
        return [y[1], s * c * turn**2 - ABOUT / I1 * spin * turn * s + MASS * G * ARM * s / I1]

    times = np.linspace(0, END, 20_001)
    return float(
        solve_ivp(rates, (0, END), [TILT, 0], t_eval=times, method="DOP853", rtol=1e-10, atol=1e-12).y[0].max()
    )


def solve(dt):
    disk = sp.shapes.cylinder_surface(0.2, 0.02, 0.02)
    along = np.array([np.sin(TILT), np.cos(TILT), 0.0])
    values: dict[str, Any] = {}
    frame: Any = None
    for share in SHARES:
        top = sp.RigidBody(
            "top", disk, mass=MASS, inertia=(ACROSS, ABOUT, ACROSS), position=ARM * along, rotation=(0, 0, -TILT),
            angular_velocity=share * CRITICAL * along,
        )  # fmt: skip
        scene = sp.Scene([top], joints=[sp.BallJoint("top", None, point=(0, 0, 0))], gravity=(0, -G, 0))
        for name, solver in DYNAMIC.items():
            frames = simulated(scene, solver, dt, END)
            cosines = [f.poses["top"].rotation[1, 1] for f in frames]
            values[f"tilt at {share} of the critical spin, {name}"] = np.degrees(np.arccos(min(cosines)))
            frame = frames[-1]
    return Solution(values, frame)


SHARES = (1.2, 0.8)
CASE = Case(
    title="Sleeping top",
    source="Goldstein 1980",
    references={
        f"tilt at {share} of the critical spin, {name}": Reference(
            np.degrees(largest_tilt(share * CRITICAL)), "degrees", coarse=0.1
        )
        for share in SHARES
        for name in DYNAMIC
    },
    solve=solve,
    meshes=(1 / 120, 1 / 800),
    differs="Coarse and fine are steps of 1/120 and 1/800 s for 1 s.",
)
