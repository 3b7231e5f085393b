"""Five rods of 1 m and 1 kg and the ground are a closed chain of six hinges along the edges of a cube, each normal to
its two rods. Grubler's formula gives no degree of freedom, and Bricard (1897) found that it has one. IFToMM's library
of benchmarks, A04, lets it fall for 10 s under gravity of 9.81 m/s^2 along -y; its energy must not change.
"""

from typing import Any

import numpy as np
from tests.published.case import DYNAMIC, Case, Reference, Solution, rod, simulated

import supple as sp

PLACES = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], dtype=float)
AXES = ((0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0))


def solve(setting):
    dt, end = setting
    rods = [rod(f"rod {k}", PLACES[k], PLACES[k + 1]) for k in range(5)]
    names = [None, *(body.name for body in rods), None]
    joints = [
        sp.HingeJoint(names[k + 1] or names[k], names[k] if names[k + 1] else None, point=PLACES[k], axis=AXES[k])
        for k in range(6)
    ]
    scene = sp.Scene(rods, joints=joints, gravity=(0, -9.81, 0))
    (free,) = sp.modes(scene, 1).frequencies  # asked for two, it says that there is one
    values: dict[str, Any] = {"frequency of its one motion": free}
    frame: Any = None
    for name, solver in DYNAMIC.items():
        frames = simulated(scene, solver, dt, end)
        energies = [f.report.energy for f in frames]
        values[f"change of energy, {name}"] = (max(energies) - min(energies)) / (5 * 9.81)
        frame = frames[round(0.3 / dt)]
    return Solution(values, frame)


REFERENCES = {"frequency of its one motion": Reference(0.0, "Hz", bound=1e-3, coarse=1e-3, scale=1.0)}
REFERENCES |= {f"change of energy, {one}": Reference(0.0, "5 m g L", scale=1.0) for one in DYNAMIC}
CASE = Case(
    title="Bricard's six bars",
    source="Bricard 1897",
    references=REFERENCES,
    solve=solve,
    meshes=((1 / 100, 1.0), (1 / 200, 10.0)),
    differs="Coarse and fine are steps of 1/100 s for 1 s, and of 1/200 s for 10 s.",
)
