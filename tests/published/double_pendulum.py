"""Two rods of 1 m and 1 kg are hinged to each other, and the first to the world; they start level and at rest, and
fall. The double pendulum is a standard problem of multibody dynamics (IFToMM 2006). The reference is the solution of
its equations of Lagrange by SciPy's Runge-Kutta method of order 8 with a tolerance of 1e-10.
"""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from tests.published.case import DYNAMIC, Case, Reference, Solution, rod, simulated

import supple as sp

G, WIDTH, END = 9.81, 0.05, 1.0
INERTIA = (1 + WIDTH**2) / 12


def rates(t, y):
    a, b, u, v = y
    c, s = 0.5 * np.cos(a - b), 0.5 * np.sin(a - b)
    M = [[INERTIA + 1.25, c], [c, INERTIA + 0.25]]
    return [u, v, *np.linalg.solve(M, [-s * v * v - 1.5 * G * np.cos(a), s * u * u - 0.5 * G * np.cos(b)])]


def tip(a, b):
    return (np.cos(a) + np.cos(b), np.sin(a) + np.sin(b), 0.0)


def solve(dt):
    bodies = [rod("upper", (0, 0, 0), (1, 0, 0), WIDTH), rod("lower", (1, 0, 0), (2, 0, 0), WIDTH)]
    joints = [sp.HingeJoint("upper", None, point=(0, 0, 0)), sp.HingeJoint("lower", "upper", point=(1, 0, 0))]
    scene = sp.Scene(bodies, joints=joints, gravity=(0, -G, 0))
    values: dict[str, Any] = {}
    frame: Any = None
    for name, solver in DYNAMIC.items():
        *_, frame = simulated(scene, solver, dt, END)
        pose = frame.poses["lower"]
        values[f"tip after 1 s, {name}"] = pose.translation + pose.rotation @ (0.5, 0, 0)
    return Solution(values, frame)


TIP = tip(*solve_ivp(rates, (0, END), [0, 0, 0, 0], method="DOP853", rtol=1e-10, atol=1e-12).y[:2, -1])
CASE = Case(
    title="Double pendulum",
    source="IFToMM 2006",
    references={f"tip after 1 s, {name}": Reference(TIP, "m") for name in DYNAMIC},
    solve=solve,
    meshes=(1 / 100, 1 / 400),
    differs="Coarse and fine are steps of 1/100 and 1/400 s.",
)
