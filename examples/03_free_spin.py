"""A soft ring spins freely, stretched by its own centrifugal force, and keeps its angular momentum.

Run it:  python examples/03_free_spin.py
"""

import numpy as np

import supple as sp


def main() -> float:
    ring = sp.Body(
        "ring",
        sp.shapes.torus(radius=0.5, tube_radius=0.15, edge_length=0.12),
        sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0),
        angular_velocity=(1, 5, 0),
    )
    scene = sp.Scene([ring], gravity=(0, 0, 0))
    frames = list(sp.simulate(scene, sp.XPBD(substeps=20), dt=1 / 60, steps=60))
    first, last = (np.asarray(frame.report.angular_momentum) for frame in (frames[0], frames[-1]))
    change = float(np.linalg.norm(last - first) / np.linalg.norm(first))
    print(f"after {frames[-1].time:.0f} s the angular momentum has a relative change of {change:.1e}")
    return change


if __name__ == "__main__":
    main()
