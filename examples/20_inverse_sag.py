"""The shape that a soft arm must be made in so that it is straight where it hangs.

Gravity bends an arm. Its rest shape is found such that it is a straight box in equilibrium. All vertices are unknown:
the gradient by them comes with a few passes over the tets.

Run it:  python examples/20_inverse_sag.py
"""

import numpy as np
from scipy.optimize import minimize

import supple as sp

WANTED = sp.shapes.box((0.3, 0.04, 0.04), (12, 2, 2))
WALL = np.flatnonzero(WANTED.vertices[:, 0] < -0.15 + 1e-9)
TIP = int(np.argmax(WANTED.vertices[:, 0]))


def arm(shape: np.ndarray) -> sp.Scene:
    """The arm that is made with the vertices `shape` (3 n,) [m], whose end at the wall stays where it is."""
    mesh = sp.TetMesh(shape.reshape(-1, 3), WANTED.tets)
    body = sp.Body("arm", mesh, sp.NeoHookean(youngs=2e6, poisson=0.4, density=1000))
    return sp.Scene([body], pins=[sp.Pin("arm", WALL)])


def main() -> dict[str, float]:
    loss = sp.Misfit("positions", "arm", WANTED.vertices)
    sag = sp.Sensitivity(arm, loss, sp.Implicit(integrator="static", contact=None), dt=1.0, steps=1)
    history: list[float] = []

    def value_and_gradient(shape: np.ndarray) -> tuple[float, np.ndarray]:
        found = sag.gradient(shape, [], rest=True)
        by = found.rest_positions["arm"].copy()
        by[WALL] = 0.0
        history.append(np.sqrt(found.value / len(WANTED.vertices)))
        print(f"run {len(history)}: {1e3 * history[-1]:.3g} mm off, in the root mean square")
        return 1e3 * found.value, 1e3 * by.ravel()

    options = {"maxfun": 20, "maxcor": 20, "ftol": 0.0, "gtol": 0.0}
    best = minimize(value_and_gradient, WANTED.vertices.ravel(), jac=True, method="L-BFGS-B", options=options)
    off, rise = min(history) / history[0], (best.x.reshape(-1, 3) - WANTED.vertices)[TIP, 1]
    print(f"made {1e3 * rise:.3g} mm higher at its tip, it is {100 * off:.1g} % of its sag off")
    return {"off": off, "rise": float(rise), "runs": len(history)}


if __name__ == "__main__":
    main()
