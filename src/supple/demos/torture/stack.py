"""Five equal cubes, one per cent of their size apart, fall on each other and rest, without friction.

With less than four cells along an edge, every cube is one per cent smaller than the one below it. Outlines that lie
above each other repel each other, and in coarse meshes no other force is large enough to balance that.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from supple.demos.demo import Claim, Demo
from supple.demos.torture.meshes import mirrored_box
from supple.demos.torture.watch import ContactMeasurement, Torture, center, mass
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
    def begin(self, first: Frame, dt: float, steps: int) -> None:
        super().begin(first, dt, steps)
        self.names = [part.name for part in first.system.bodies]
        self.settled: Frame | None = None

    def write(self, frame: Frame) -> None:
        super().write(frame)
        if self.settled is None and frame.time >= SETTLED - 1e-9:
            self.settled = frame

    def own_claims(self) -> list[Claim]:
        contacts = self.last.contacts
        errors = []
        for k, name in enumerate(self.names):
            below = self.names[k - 1] if k else "floor"
            weight = GRAVITY * sum(mass(self.last, above) for above in self.names[k:])
            pushed = contacts.force_between(name, below)[1] if contacts is not None else 0.0
            errors.append(pushed / weight - 1.0)
        worst = max(errors, key=abs)
        drift = np.inf
        if self.settled is not None and self.last.time > self.settled.time:
            ways = [center(self.last, name) - center(self.settled, name) for name in self.names]
            furthest = max(float(np.hypot(way[0], way[2])) for way in ways)
            drift = furthest / SIDE / (self.last.time - self.settled.time)
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


def _demo(cells: int, steps: int) -> Demo:
    return Demo(
        name="torture-stack",
        summary="five cubes without friction fall on each other, rest, and do not creep",
        explanation=(
            "Five cubes (E = 10 MPa), one per cent of their size apart, fall on each other and on a floor, without any "
            "friction. The load on each of them is compared with the weight above it."
        ),
        scene=partial(scene, cells),
        solvers={"implicit": lambda: Implicit(tolerance=TOLERANCE)},
        measurement=_Measurement,
        dt=1 / 50,
        steps=steps,
    )


STACK = Torture(small=_demo(2, 50), full=_demo(4, 75), large=_demo(8, 8))
