"""The flag of CSM1 is released without damping and swings for ever. Turek and Hron (2006), CSM3, give mean, amplitude
and frequency of the path of the middle of its end: -63.607 and 65.160 mm, 1.0995 Hz.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution
from tests.published.csm1 import flag

import supple as sp


def solve(given):
    divisions, dt = given
    scene, tip = flag(divisions, 0.5e6)
    frames = list(sp.simulate(scene, sp.Implicit(integrator="newmark", contact=None), dt, round(2.0 / dt), strict=True))
    t, y = np.array([[frame.time, 1e3 * frame.positions["flag"][tip, 1]] for frame in frames]).T
    # Crossings of the mean on the way down, and the turning points by parabolas.
    mean = (y.max() + y.min()) / 2
    down = np.flatnonzero((y[:-1] > mean) & (y[1:] <= mean))
    crossings = t[down] + dt * (y[down] - mean) / (y[down] - y[down + 1])
    values = {"mean": mean, "amplitude": (y.max() - y.min()) / 2, "frequency": 1 / np.diff(crossings).mean()}
    return Solution(values, frames[int(y.argmin())])


CASE = Case(
    title="Swinging flag (CSM3)",
    source="Turek, Hron 2006",
    references={
        "mean": Reference(-63.607, "mm", bound=0.015),
        "amplitude": Reference(65.160, "mm"),
        "frequency": Reference(1.0995, "Hz"),
    },
    solve=solve,
    meshes=(((12, 1, 1), 0.02), ((40, 2, 1), 0.005)),
    look={"color": "von_mises"},
    differs="Two seconds are taken, the source has ten: at six seconds the mean is -63.8 mm and the amplitude 64.8 mm.",
)
