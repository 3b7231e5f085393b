"""A muscle between two walls, and one that shortens.

Fibres along two bars are activated, fully and then by 30 %. The bar between two walls keeps its shape and pulls on them
with activation x strength x area; the other one shortens until its elastic stress balances that of the fibres.

Run it:  python examples/11_muscle.py
"""

import numpy as np

import supple as sp

LENGTH, SIDE, STRENGTH, DT = 0.2, 0.04, 3e4, 1 / 60
ACTIVATION = sp.Curve([0.0, 0.2, 0.4, 0.6, 0.8], [0.0, 1.0, 1.0, 0.3, 0.3])


def main(solver: sp.XPBD | sp.Implicit | None = None, sinks=()) -> dict[str, float]:
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.4, damping=0.02)
    mesh = sp.shapes.box((LENGTH, SIDE, SIDE), (8, 2, 2))
    bodies = [sp.Body("held", mesh, material), sp.Body("free", mesh, material, position=(0, 3 * SIDE, 0))]
    left, right = (sp.InBox((at - 1e-6, -1, -1), (at + 1e-6, 1, 1)) for at in (-LENGTH / 2, LENGTH / 2))
    pins = [sp.Pin("held", left, name="left"), sp.Pin("held", right, name="right"), sp.Pin("free", left, name="wall")]
    curve = ([0.5, 0.95, 1.05, 1.6], [0.0, 1.0, 1.0, 0.0])
    muscles = [sp.Muscle(body.name, STRENGTH, (1, 0, 0), ACTIVATION, force_length=curve) for body in bodies]
    scene = sp.Scene(bodies, pins=pins, loads=muscles, gravity=(0, 0, 0))

    largest = STRENGTH * SIDE**2
    error = unequal = 0.0
    shortest = 1.0
    solver = solver or sp.XPBD()
    earlier = 0.5 * DT if isinstance(solver, sp.XPBD) else 0.0  # XPBD has the means of forces over a step
    for frame in sp.simulate(scene, solver, DT, steps=60, sinks=sinks):
        expected = float(ACTIVATION(frame.time - earlier)) * largest
        pulls = frame.reactions[scene.pins[0].label][0], frame.reactions[scene.pins[1].label][0]
        error = max(error, abs(-pulls[0] - expected) / largest, abs(pulls[1] - expected) / largest)
        unequal = max(unequal, abs(sum(pulls)) / largest)
        shortest = min(shortest, float(np.ptp(frame.positions["free"][:, 0])) / LENGTH)
    print(f"the held muscle pulls with up to {largest:.3g} N, within {100 * error:.2g} % of that")
    print(f"the free one shortens to {100 * shortest:.1f} % of its length")
    return {"error": float(error), "unequal": float(unequal), "shortest": shortest}


if __name__ == "__main__":
    main()
