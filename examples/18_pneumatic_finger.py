"""The pressures over time that bring the tip of a pneumatic finger onto a path.

A finger with a chamber beside its middle bends where the chamber is inflated. The pressure goes straight between its
values at eight times, which are found such that the tip rises and comes back as it should. All are equilibria.

Run it:  python examples/18_pneumatic_finger.py
"""

from pathlib import Path

import numpy as np

import supple as sp

STEPS = 8
SOLID = sp.shapes.box((0.1, 0.02, 0.015), (10, 4, 3))
CENTERS = SOLID.vertices[SOLID.tets].mean(axis=1)
CHAMBER = (np.abs(CENTERS[:, 0]) < 0.04) & (np.abs(CENTERS[:, 1] + 0.0025) < 0.0025) & (np.abs(CENTERS[:, 2]) < 0.0025)
MESH = sp.TetMesh(SOLID.vertices, SOLID.tets[~CHAMBER])
TIP = [int(np.argmax(MESH.vertices @ [1.0, -0.1, 0.0]))]
# How far the tip is to be above its place at the start [m].
PATH = 0.001 * np.array([0.5, 1.0, 1.35, 1.5, 1.5, 1.2, 0.75, 0.3])


def finger(p: np.ndarray) -> sp.Scene:
    """The finger with the pressures p [kPa] at the times 1/8 to 1."""
    curve = sp.Curve(np.arange(STEPS + 1) / STEPS, [0.0, *(1e3 * p)])
    rubber = sp.StableNeoHookean(youngs=2e5, poisson=0.45, density=1100)
    body = sp.Body("finger", MESH, rubber)
    wall = np.flatnonzero(MESH.vertices[:, 0] < -0.05 + 1e-9)
    cavity = sp.Cavity("finger", pressure=curve)
    return sp.Scene([body], pins=[sp.Pin("finger", wall)], cavities=[cavity], gravity=(0, 0, 0))


def main(output: Path | None = None) -> dict[str, float]:
    target = np.full((STEPS, 1, 3), np.nan)
    target[:, 0, 1] = MESH.vertices[TIP, 1] + PATH
    solver = sp.Implicit(integrator="static", contact=None)
    loss = sp.Misfit("positions", "finger", target, vertices=TIP)
    control = sp.Sensitivity(finger, loss, solver, dt=1 / STEPS, steps=STEPS)
    found = sp.fit_simulation(control, [20.0] * STEPS, bounds=(0, 100), report=print)
    print(found)
    (label,) = found.measured
    off = np.abs(found.simulated[label] - found.measured[label]).max() / PATH.max()
    print(f"the tip is within {100 * off:.2g} % of its path")
    if output is not None:
        found.plot(output)
    return {"off": float(off), "runs": found.evaluations}


if __name__ == "__main__":
    main(Path("pneumatic_finger.png"))
