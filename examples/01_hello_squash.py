"""A soft ball lands on a floor, is squashed, and springs back.

Run it:  python examples/01_hello_squash.py
"""

import numpy as np

import supple as sp


def main() -> dict[str, float]:
    ball = sp.Body(
        "ball",
        sp.shapes.sphere(radius=0.5, edge_length=0.2),
        sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000.0),
        position=(0, 1, 0),
    )
    scene = sp.Scene([ball], obstacles=[sp.HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5)])

    drop, heights = [], []
    for frame in sp.simulate(scene, sp.XPBD(substeps=20), dt=1 / 60, steps=60):
        x = frame.positions["ball"]
        heights.append(float(np.ptp(x[:, 1])))
        if x[:, 1].min() > 0.02 and len(drop) == len(heights) - 1:  # free fall: only gravity acts
            drop.append(1.0 - float(np.average(x[:, 1], weights=frame.system.masses)) - 0.5 * 9.81 * frame.time**2)
    lowest = min(heights)
    rebound = max(heights[heights.index(lowest) :])
    print(f"squashed to {100 * lowest:.0f} % of its height, then {100 * rebound:.0f} %")
    print(f"while falling, {1e3 * max(map(abs, drop)):.2f} mm from g t^2 / 2")
    return {"lowest": lowest, "rebound": rebound, "fall_error": max(map(abs, drop))}


if __name__ == "__main__":
    main()
