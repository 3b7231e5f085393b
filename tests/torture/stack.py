"""Five equal cubes, one per cent of their size apart, fall on each other and rest, without friction.

Nothing but the tilt of loaded faces pushes them sideways. With less than four cells along an edge, every cube is one
per cent smaller than the one below it: outlines are above faces there, and above each other in finer stacks.
"""

from typing import Any

import numpy as np
from tests.torture.meshes import mirrored_box
from tests.torture.watch import ContactMeasurement, Size, mass, push, torture

from supple.app.demos.demo import Claim
from supple.materials.elastic import StableNeoHookean
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.scene import Scene
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.implicit.solver import Implicit

COUNT, SIDE, GAP, YOUNGS = 5, 0.1, 1e-3, 1e7
SMALLER, COARSE = 0.01, 4
GRAVITY = 9.81
TOLERANCE = 1e-8  # so that Newton's errors are smaller than the forces that are measured
SETTLED = 0.5  # [s] after this time the stack rests


def scene(cells: int, scale: float = 1.0) -> Scene:
    """Cubes of cells^3 cells in a tower above a floor.

    Parameters
    ----------
    scale : of all lengths; moduli and gravity follow, so that all shapes are the same at all times
    """
    material = StableNeoHookean(youngs=YOUNGS * scale**2, poisson=0.3, density=1000.0, damping=0.01)
    bodies, height = [], 0.0
    for k in range(COUNT):
        side = SIDE * (1.0 - (SMALLER if cells < COARSE else 0.0) * k)
        mesh = mirrored_box((scale * side,) * 3, cells)
        bodies.append(Body(f"cube{k + 1}", mesh, material, position=(0, scale * (height + GAP + side / 2), 0)))
        height += GAP + side
    return Scene(bodies=bodies, obstacles=[HalfSpace(name="floor")], gravity=(0, -GRAVITY * scale, 0))


class _Measurement(ContactMeasurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        details = frame.report.details
        assert isinstance(details, ImplicitDetails)
        forces = details.contact_forces
        aside = [np.hypot(*forces[name][[0, 2]]) / (GRAVITY * mass(frame, name)) for name in frame.positions]
        return {**super().values(frame), "aside": (frame.time, max(aside))}

    def own_claims(self) -> list[Claim]:
        names, errors = list(self.first.positions), []
        for k, name in enumerate(names):
            weight = GRAVITY * sum(mass(self.last, above) for above in names[k:])
            errors.append(push(self.last, name, names[k - 1] if k else "floor") / weight - 1.0)
        worst = max(errors, key=abs)
        aside = max((share for time, share in self.series["aside"] if time >= SETTLED - 1e-9), default=np.inf)
        return [
            Claim(
                "at the end every cube, and the floor, carries the weight above it within 2 %",
                f"furthest off {100 * worst:+.2g} %",
                abs(worst) <= 0.02,
            ),
            Claim(
                f"after {SETTLED:g} s contact pushes no cube sideways by more than 2e-5 of its weight",
                f"most {aside:.1e} of it",
                aside <= 2e-5,
            ),
        ]


STACK = torture(
    name="stack",
    summary="five cubes without friction fall on each other, rest, and are not pushed sideways",
    explanation=(
        "Five cubes (E = 10 MPa), one per cent of their size apart, fall on each other and on a floor, without any "
        "friction. The load on each of them is compared with the weight above it."
    ),
    scene=scene,
    solver=lambda: Implicit(tolerance=TOLERANCE),
    measurement=_Measurement,
    small=Size((2,), 1 / 50, 50),
    full=Size((4,), 1 / 50, 75),
    large=Size((8,), 1 / 50, 8),
)
