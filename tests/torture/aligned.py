"""Eight exactly aligned cubes collide: faces, edges and corners meet at the same time."""

import numpy as np
from tests.torture.watch import ContactMeasurement, Size, center, mass, mechanical_energy, torture

from supple.app.demos.demo import Claim
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.scene.body import Body
from supple.scene.scene import Scene

SIDE, GAP, SPEED = 0.1, 1e-3, 0.5


def scene(cells: int) -> Scene:
    """Two by two by two cubes around the origin; each moves towards it, without gravity."""
    mesh = shapes.box((SIDE,) * 3, (cells,) * 3)
    material = StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)
    bodies = []
    for corner in np.ndindex(2, 2, 2):
        sign = 2.0 * np.array(corner) - 1.0
        name = "cube" + "".join(map(str, corner))
        bodies.append(Body(name, mesh, material, position=0.5 * (SIDE + GAP) * sign, velocity=-SPEED * sign))
    return Scene(bodies=bodies, gravity=(0, 0, 0))


class _Measurement(ContactMeasurement):
    def own_claims(self) -> list[Claim]:
        names = list(self.first.positions)
        item = SPEED * np.sqrt(3.0) * mass(self.first, names[0])
        total = float(np.linalg.norm(self.last.report.linear_momentum))
        away = min(float(center(self.last, n) @ center(self.first, n)) for n in names)
        spread = float(np.mean([np.linalg.norm(center(self.last, n)) for n in names]))
        before, after = mechanical_energy(self.first), mechanical_energy(self.last)
        return [
            Claim(
                "they bounce off: each moves away on the side that it came from",
                f"centers now {1e3 * spread:.1f} mm from the middle",
                away > 0.0 and spread > np.sqrt(0.75) * (SIDE + GAP),
            ),
            Claim(
                "the total momentum stays zero, to 1e-9 of one cube's",
                f"{total / item:.1e} of it",
                total <= 1e-9 * item,
            ),
            Claim("the energy does not grow", f"{before:.4g} J before, {after:.4g} J after", after <= before),
        ]


ALIGNED = torture(
    name="aligned",
    summary="eight aligned cubes collide and bounce off",
    explanation=(
        "Two by two by two soft cubes (E = 100 kPa), exactly aligned, collide in the middle at 0.5 m/s along each "
        "axis: vertices meet vertices, edges meet parallel edges, faces meet faces, all at the same time."
    ),
    scene=scene,
    measurement=_Measurement,
    small=Size((2,), 1 / 200, 24),
    full=Size((4,), 1 / 200, 40),
)
