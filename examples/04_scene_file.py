"""A scene file is loaded and simulated: a block slides down a slope of 30 degrees with friction.

Run it:  python examples/04_scene_file.py
"""

import math
from pathlib import Path

import numpy as np

import supple as sp

SCENE = Path(__file__).parent / "scenes" / "slope.yaml"


def main() -> float:
    run = sp.load_run(SCENE)
    *_, last = sp.simulate(run.scene, run.solver, run.dt, run.steps)
    block = run.scene.body("block")
    slid = float(np.mean(last.positions["block"][:, 0]) - np.mean(block.mesh.vertices[:, 0]))
    angle = math.radians(30)
    expected = 0.5 * 9.81 * (math.sin(angle) - 0.3 * math.cos(angle)) * last.time**2
    print(f"slid {slid:.4f} m in {last.time:.2f} s; Coulomb's law predicts {expected:.4f} m")
    return slid / expected


if __name__ == "__main__":
    main()
