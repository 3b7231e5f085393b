"""Three meshes of one cantilever under a tip load, against beam theory."""

from __future__ import annotations

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.scene.body import Body
from supple.scene.forces import Force
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.selection import InBox
from supple.solvers.implicit.solver import Implicit

LENGTH, SIDE, YOUNGS, POISSON, LOAD = 1.0, 0.1, 1e6, 0.3, 0.01
MESHES = {"coarse": (32, 5, 1), "medium": (64, 10, 2), "fine": (128, 20, 4)}


def beam_theory() -> float:
    """Tip deflection [m] of a Timoshenko beam: P L^3 / (3 E I) + P L / (kappa G A), kappa = 10 (1 + nu) / (12 + 11 nu).

    Source: Cowper, "The Shear Coefficient in Timoshenko's Beam Theory" (1966).
    """
    bending = LOAD * LENGTH**3 / (3.0 * YOUNGS * SIDE**4 / 12.0)
    kappa = 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON)
    shear = LOAD * LENGTH / (kappa * YOUNGS / (2.0 * (1.0 + POISSON)) * SIDE**2)
    return bending + shear


def scene() -> Scene:
    """Beams of 1 x 0.1 x 0.1 m side by side, held at one end, 0.01 N down at the other; each mesh has cells
    half as large as the mesh before."""
    bodies, pins, forces = [], [], []
    for k, (name, divisions) in enumerate(MESHES.items()):
        z = 3.0 * SIDE * (k - 1)
        mesh = shapes.box((LENGTH, SIDE, SIDE), divisions)
        bodies.append(Body(name, mesh, StableNeoHookean(youngs=YOUNGS, poisson=POISSON), position=(LENGTH / 2, 0, z)))
        pins.append(Pin(name, InBox((-1e-9, -1, -9), (1e-9, 1, 9)), name="wall"))
        end = InBox((LENGTH - 1e-9, -1, -9), (LENGTH + 1e-9, 1, 9))
        forces.append(Force(name, end, (0.0, -LOAD, 0.0), name="load"))
    return Scene(bodies=bodies, pins=pins, forces=forces, gravity=(0, 0, 0))


class _Measurement(Measurement):
    def claims(self) -> list[Claim]:
        expected = beam_theory()
        deflections = []
        for name in MESHES:
            at_start = self.first.positions[name]
            end = at_start[:, 0] > LENGTH - 1e-9
            deflections.append(float(np.mean((at_start - self.last.positions[name])[end, 1])))
        ratios = [deflection / expected for deflection in deflections]
        measured = ", ".join(f"{name} {100 * ratio:.1f} %" for name, ratio in zip(MESHES, ratios, strict=True))
        limit = (
            deflections[2] + (deflections[2] - deflections[1]) / 3.0
        )  # errors are proportional to the square of the mesh size
        return [
            Claim(
                f"refined meshes approach Timoshenko's {expected:.4g} m from below",
                measured,
                ratios[0] < ratios[1] < ratios[2] < 1.0,
            ),
            Claim(
                "the finest is within 3 % of it",
                f"{deflections[2]:.4g} m",
                abs(ratios[2] - 1.0) <= 0.03,
            ),
            Claim(
                "extrapolated to the mesh size zero, the deflection is within 1.5 % of it",
                f"{limit:.4g} m, {100 * limit / expected:.1f} %",
                abs(limit / expected - 1.0) <= 0.015,
            ),
        ]


CANTILEVER = Demo(
    name="cantilever",
    summary="a beam bent by a load at its tip, against beam theory",
    explanation=(
        "The same beam (E = 1 MPa, nu = 0.3) three times, each mesh twice as fine as the one before, bent by 0.01 N "
        "at its tip. Linear tetrahedra are too stiff in bending, so coarse meshes bend too little. The demo measures "
        "by how much."
    ),
    scene=scene,
    solvers={"implicit": lambda: Implicit(integrator="static")},
    measurement=_Measurement,
    dt=1.0,
    steps=1,
)
