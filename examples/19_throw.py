"""The speed and the angle of a throw that lands a soft ball in the middle of a bowl, with contact and friction.

The bowl is a pyramid of four planes. The ball touches a side and slides down, and is to be in the middle after .6 s.
The derivatives go through the contact.

Run it:  python examples/19_throw.py
"""

import numpy as np

import supple as sp

DT, STEPS, SLOPE = 1 / 120, 72, 0.5
MESH = sp.shapes.sphere(0.05, edge_length=0.05)
BOWL = np.array([1.2, 0.0, 0.0])


def throw(p: np.ndarray) -> sp.Scene:
    """The ball with the speed p[0] [m/s], at the angle p[1] [degrees] above the horizon."""
    angle = np.radians(p[1])
    velocity = p[0] * np.array([np.cos(angle), np.sin(angle), 0.0])
    rubber = sp.StableNeoHookean(youngs=3e4, poisson=0.4, density=300, damping=0.1)
    ball = sp.Body("ball", MESH, rubber, position=(0, 1.0, 0), velocity=velocity)
    sides = [(-SLOPE, 1, 0), (SLOPE, 1, 0), (0, 1, SLOPE), (0, 1, -SLOPE)]
    bowl = [sp.HalfSpace(point=BOWL, normal=n, friction=0.3, name=f"side {k}") for k, n in enumerate(sides)]
    return sp.Scene([ball], obstacles=bowl)


def main() -> dict[str, float]:
    goal = (BOWL[0], 0.08, np.nan)

    loss = sp.Misfit("center", "ball", goal)
    solver = sp.Implicit(integrator="bdf2", tolerance=1e-5, contact=sp.IPCContact(dhat=0.01))
    aim = sp.Sensitivity(throw, loss, solver, DT, STEPS)
    found = sp.fit_simulation(aim, [2.0, 20.0], bounds=([1, 0], [4, 60]), names=["speed", "angle"], report=print)
    print(found)
    miss = found.loss**0.5
    print(f"the ball is {1e3 * miss:.2g} mm off")
    return {"off": miss / BOWL[0], "runs": found.evaluations}


if __name__ == "__main__":
    main()
