"""The law of a foam from a crush test: force over displacement in a CSV file, of a block between glued plates.

The plates hold the block's width at both ends, so that no formula gives stress over stretch. The whole test is
simulated; modulus and Poisson's ratio are fitted. The file was made with 80 kPa and 0.25, and noise of .5 % of forces.

Run it:  python examples/16_foam_law.py
"""

from pathlib import Path

import numpy as np

import supple as sp

DATA = Path(__file__).parent / "data" / "foam_crush.csv"
SIDE, STEPS = 0.05, 6


def test_of(p: np.ndarray) -> sp.Scene:
    """The test of a foam with the modulus p[0] [Pa] and Poisson's ratio p[1]."""
    mesh = sp.shapes.box((SIDE, SIDE, SIDE), (4, 4, 4))
    y = mesh.vertices[:, 1]
    foam = sp.Body("foam", mesh, sp.NeoHookean(youngs=p[0], poisson=p[1], density=60))
    plate = sp.Pin("foam", np.flatnonzero(y > y.max() - 1e-9), motion=lambda t: (0, -0.4 * SIDE * t, 0), name="plate")
    return sp.Scene([foam], pins=[sp.Pin("foam", np.flatnonzero(y < y.min() + 1e-9)), plate], gravity=(0, 0, 0))


def main(output: Path | None = None) -> dict[str, float]:
    displacement, force = np.loadtxt(DATA, delimiter=",", skiprows=1, unpack=True)
    assert np.allclose(displacement, 0.4 * SIDE * np.arange(1, STEPS + 1) / STEPS)
    target = np.full((STEPS, 3), np.nan)  # only the vertical force was measured
    target[:, 1] = -force
    loss = sp.Misfit("reaction", "plate", target)
    solver = sp.Implicit(integrator="static", contact=None)
    test = sp.Sensitivity(test_of, loss, solver, dt=1 / STEPS, steps=STEPS)
    found = sp.fit_simulation(
        test, [3e4, 0.4], bounds=([1e3, 0.01], [1e6, 0.49]), names=["youngs", "poisson"], report=print
    )
    print(found)
    if output is not None:
        found.plot(output)
    off = np.abs(found.values - [8e4, 0.25]) / found.standard_errors
    return {"youngs": found.values[0], "poisson": found.values[1], "off": float(off.max()), "runs": found.evaluations}


if __name__ == "__main__":
    main(Path("foam_law.png"))
