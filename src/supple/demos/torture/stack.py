"""Five equal cubes, one per cent of their size apart, fall on each other and rest, without friction.

With less than four cells along an edge, every cube is one per cent smaller than the one below it. Outlines that lie
above each other repel each other, and in coarse meshes no other force is large enough to balance that.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.demos.demo import Claim
from supple.demos.torture.meshes import mirrored_box
from supple.demos.torture.watch import ContactMeasurement, Size, center, mass, push, torture
from supple.implicit.solver import Implicit
from supple.materials.stable_neo_hookean import StableNeoHookean
from supple.scene.body import Body
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.scene import Scene
from supple.simulate import Frame

COUNT, SIDE, GAP, YOUNGS = 5, 0.1, 1e-3, 1e7
SMALLER, COARSE = 0.01, 4
GRAVITY = 9.81
TOLERANCE = 1e-8  # so that Newton's errors are smaller than the drift that is measured
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
        centers = np.array([center(frame, name) for name in frame.positions])
        return {**super().values(frame), "centers": (frame.time, centers)}

    def own_claims(self) -> list[Claim]:
        names, errors = list(self.first.positions), []
        for k, name in enumerate(names):
            weight = GRAVITY * sum(mass(self.last, above) for above in names[k:])
            errors.append(push(self.last, name, names[k - 1] if k else "floor") / weight - 1.0)
        worst = max(errors, key=abs)
        settled = [(time, centers) for time, centers in self.series["centers"] if time >= SETTLED - 1e-9]
        drift = np.inf
        if len(settled) > 1:
            (begin, start), (end, now) = settled[0], settled[-1]
            drift = float(np.linalg.norm((now - start)[:, [0, 2]], axis=1).max()) / SIDE / (end - begin)
        return [
            Claim(
                "at the end every cube, and the floor, carries the weight above it within 2 %",
                f"furthest off {100 * worst:+.2g} %",
                abs(worst) <= 0.02,
            ),
            Claim(
                f"after {SETTLED:g} s no cube drifts sideways by more than 1e-6 of its size per second",
                f"fastest {drift:.1e} 1/s",
                drift <= 1e-6,
            ),
        ]


STACK = torture(
    name="stack",
    summary="five cubes without friction fall on each other, rest, and do not creep",
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
