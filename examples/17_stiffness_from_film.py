"""The stiffness of the regions of a soft part from a film of markers on it.

A bar of three regions swings under its weight. Three of its vertices are markers, of which a film has the places in 12
frames, with an error of 20 um. The moduli of the regions follow from them, with their errors.

Run it:  python examples/17_stiffness_from_film.py
"""

from pathlib import Path

import numpy as np

import supple as sp

DT, STEPS, NOISE = 1 / 60, 12, 2e-5
TRUE = np.array([2.0e5, 0.8e5, 1.4e5])
MESH = sp.shapes.box((0.3, 0.05, 0.05), (9, 2, 2))
REGION = np.digitize(MESH.vertices[MESH.tets].mean(axis=1)[:, 0], [-0.05, 0.05])
MARKERS = np.flatnonzero((MESH.vertices[:, 1] > 0.024) & (np.abs(MESH.vertices[:, 2]) < 1e-9))


def swing(p: np.ndarray) -> sp.Scene:
    """The bar with the modulus p[k] [Pa] in region k."""
    rubber = sp.StableNeoHookean(youngs=p[REGION], poisson=0.4, density=1000, damping=0.01)
    wall = np.flatnonzero(MESH.vertices[:, 0] < -0.15 + 1e-9)
    return sp.Scene([sp.Body("part", MESH, rubber)], pins=[sp.Pin("part", wall)])


def main(output: Path | None = None, noise: float = NOISE) -> dict[str, float]:
    solver = sp.Implicit(integrator="bdf2", contact=None, tolerance=1e-6)
    frames = sp.simulate(swing(TRUE), solver, DT, STEPS)
    film = np.array([frame.positions["part"][MARKERS] for frame in frames])
    film += noise * np.random.default_rng(1).standard_normal(film.shape)
    loss = sp.Misfit("positions", "part", film, vertices=MARKERS)
    names = ["root", "middle", "tip"]
    test = sp.Sensitivity(swing, loss, solver, DT, STEPS)
    found = sp.fit_simulation(test, [1e5, 1e5, 1e5], bounds=(1e4, 1e6), names=names, report=print)
    print(found)
    if output is not None:
        found.plot(output)
    errors = np.abs(found.values - TRUE)
    return {
        "relative": float((errors / TRUE).max()),
        "off": float((errors / found.standard_errors).max()),
        "runs": found.evaluations,
    }


if __name__ == "__main__":
    main(Path("stiffness_from_film.png"))
