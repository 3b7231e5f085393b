"""Two rigid jaws close on a soft cube and lift it: friction carries its weight.

Run it:  python examples/07_rigid_jaws.py
"""

import numpy as np

import supple as sp


def main() -> float:
    jaw = sp.shapes.box_surface((0.02, 0.08, 0.08), (1, 1, 1))
    left = sp.RigidBody("left", jaw, density=2700, position=(-0.062, 0.0, 0), friction=0.8)
    right = sp.RigidBody("right", jaw, density=2700, position=(0.062, 0.0, 0), friction=0.8)
    jelly = sp.StableNeoHookean(youngs=5e4, poisson=0.4, density=1000)
    cube = sp.Body("cube", sp.shapes.box((0.1, 0.1, 0.1), (3, 3, 3)), jelly, friction=0.8)
    times = [0.0, 0.3, 0.6]
    close, lift = np.array([0.007, 0.0, 0.0]), np.array([0.0, 0.1, 0.0])
    pins = [
        sp.Pin("left", motion=sp.Keyframes(times, displacements=[(0, 0, 0), close, close + lift])),
        sp.Pin("right", motion=sp.Keyframes(times, displacements=[(0, 0, 0), -close, lift - close])),
    ]
    floor = sp.HalfSpace(point=(0, -0.0502, 0), friction=0.5, name="floor")
    scene = sp.Scene([left, right, cube], obstacles=[floor], pins=pins)
    *_, frame = sp.simulate(scene, sp.Implicit(), dt=1 / 60, steps=60)
    details = frame.report.details
    carried = (details.contact_forces["cube"] + details.friction_forces["cube"])[1]
    share = float(carried / (1000 * 0.1**3 * 9.81))
    height = frame.positions["cube"][:, 1].min() + 0.05
    print(f"lifted by {height:.3f} m by jaws that are at y = {frame.poses['left'].translation[1]:.3f} m")
    print(f"friction carries {100 * share:.2f} % of the weight")
    return share


if __name__ == "__main__":
    main()
