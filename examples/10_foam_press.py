"""A press on a block of foam: its force against its displacement.

A plate presses the block on a floor, without friction, so that it is compressed uniformly. The force follows from the
material's first Piola stress P at the side stretch where its sides are free, P11 = 0.

Run it:  python examples/10_foam_press.py
"""

import numpy as np
from scipy.optimize import brentq

import supple as sp

SIDE, HEIGHT, PRESSED, GAP = 0.1, 0.05, 0.02, 2e-4
FOAM = sp.StableNeoHookean(youngs=5e4, poisson=0.2, damping=0.002, density=100.0)


def closed_form(stretch: float) -> float:
    """Force of the block that is compressed uniformly to this share of its height [N]."""

    def stress(side: float) -> np.ndarray:
        return FOAM.first_piola(np.diag([side, stretch, side]))

    side = brentq(lambda side: stress(side)[0, 0], 0.5, 2.0)
    return float(-stress(side)[1, 1] * SIDE**2)


def main(sinks=()) -> dict[str, float]:
    block = sp.Body("foam", sp.shapes.box((SIDE, HEIGHT, SIDE), (6, 3, 6)), FOAM, position=(0, HEIGHT / 2 + GAP, 0))
    down = sp.Keyframes([0.0, 1.0], [(0, 0, 0), (0, -PRESSED - 2 * GAP, 0)])
    press = sp.obstacles.Box(
        name="press", center=(0, HEIGHT + 2 * GAP + 0.005, 0), size=(1.2 * SIDE, 0.01, 1.2 * SIDE), motion=down
    )
    scene = sp.Scene([block], [sp.HalfSpace(name="floor"), press], gravity=(0, 0, 0))
    stretches, forces = [], []
    for frame in sp.simulate(scene, sp.Implicit(), dt=1 / 20, steps=20, sinks=sinks):
        stretches.append(float(np.ptp(frame.positions["foam"][:, 1])) / HEIGHT)
        forces.append(-frame.sensors["press"].force[1])
    expected = np.array([closed_form(stretch) for stretch in stretches])
    error = float(np.abs(forces - expected).max() / expected.max())
    print(f"pressed to {100 * stretches[-1]:.1f} % of its height with {forces[-1]:.1f} N")
    print(f"at most {100 * error:.2g} % of the largest force from the closed form")
    return {"error": error, "stretch": stretches[-1], "force": float(forces[-1])}


if __name__ == "__main__":
    main()
