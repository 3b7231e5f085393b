"""Three upright and two level links of 1 m and 1 kg are two windows of four bars each. The level links start with 1
m/s, and the mechanism turns over under gravity of 9.81 m/s^2; where all links are level, its motion could branch.
IFToMM's library of benchmarks, A02 (2006), asks for no change of energy. The reference of the place is the solution of
the equation of the branch on which the links stay parallel, by SciPy's Runge-Kutta method of order 8.
"""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from tests.published.case import DYNAMIC, Case, Reference, Solution, rod, simulated

import supple as sp

G, WIDTH, END = 9.81, 0.1, 1.0
INERTIA = 3 * ((1 + WIDTH**2) / 12 + 0.25) + 2


def solve(dt):
    uprights = [
        rod(f"u{k}", (k, 0, 0), (k, 1, 0), WIDTH, velocity=(0.5, 0, 0), angular_velocity=(0, 0, -1)) for k in range(3)
    ]
    levels = [rod(f"l{k}", (k, 1, 0), (k + 1, 1, 0), WIDTH, velocity=(1, 0, 0)) for k in range(2)]
    joints = [sp.HingeJoint(f"u{k}", None, point=(k, 0, 0), name=f"foot {k}") for k in range(3)]
    joints += [sp.HingeJoint(f"l{k}", f"u{k + j}", point=(k + j, 1, 0)) for k in range(2) for j in range(2)]
    scene = sp.Scene([*uprights, *levels], joints=joints, gravity=(0, -G, 0))
    values: dict[str, Any] = {}
    frame: Any = None
    for name, solver in DYNAMIC.items():
        frames = simulated(scene, solver, dt, END)
        energies = [f.report.energy for f in frames]
        pose = frames[-1].poses["u0"]
        values[f"B0 after 1 s, {name}"] = pose.translation + pose.rotation @ (0.5, 0, 0)
        values[f"change of energy, {name}"] = (max(energies) - min(energies)) / (7 * G)
        frame = frames[round(0.2 / dt)]
    return Solution(values, frame)


def rates(t, y):
    return [y[1], -3.5 * G * np.cos(y[0]) / INERTIA]


ANGLE = solve_ivp(rates, (0, END), [np.pi / 2, -1], method="DOP853", rtol=1e-10, atol=1e-12).y[0, -1]
REFERENCES = {}
for one in DYNAMIC:
    REFERENCES[f"B0 after 1 s, {one}"] = Reference((np.cos(ANGLE), np.sin(ANGLE), 0.0), "m")
    REFERENCES[f"change of energy, {one}"] = Reference(0.0, "7 m g L", scale=1.0)
CASE = Case(
    title="Two four-bar windows",
    source="IFToMM 2006",
    references=REFERENCES,
    solve=solve,
    meshes=(1 / 100, 1 / 400),
    differs="The source simulates 10 s. Coarse and fine are steps of 1/100 and 1/400 s.",
)
