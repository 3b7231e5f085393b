"""A soft mat falls on knives: upright triangles without thickness."""

import numpy as np
from tests.torture.watch import ContactMeasurement, Size, mass, mechanical_energy, push, torture

from supple.app.demos.demo import Claim
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.surface import SurfaceMesh
from supple.scene.body import Body
from supple.scene.obstacles.triangle_obstacle import TriangleObstacle
from supple.scene.scene import Scene
from supple.solvers.implicit.details import ImplicitDetails

SIZE = (0.6, 0.03, 0.3)
PLACES = (-0.2, 0.0, 0.2)  # x [m]
BLADE = 0.2  # height of a blade [m]
GRAVITY = 9.81


def blade(x: float) -> SurfaceMesh:
    """An upright sheet along z, two triangles, its edge at y = 0."""
    points = [[x, 0, -0.25], [x, 0, 0.25], [x, -BLADE, -0.25], [x, -BLADE, 0.25]]
    return SurfaceMesh(np.array(points), np.array([[0, 1, 2], [2, 1, 3]]))


def scene(cells: int) -> Scene:
    """A mat 5 cm above three blades."""
    mesh = shapes.box(SIZE, (10 * cells, cells, 5 * cells))
    mat = StableNeoHookean(youngs=3e4, poisson=0.4, density=1000.0, damping=0.02)
    return Scene(
        bodies=[Body("mat", mesh, mat, position=(0, SIZE[1] / 2 + 0.05, 0))],
        obstacles=[TriangleObstacle(name=f"knife{k}", surface=blade(x), friction=0.5) for k, x in enumerate(PLACES, 1)],
        gravity=(0, -GRAVITY, 0),
    )


class _Measurement(ContactMeasurement):
    def own_claims(self) -> list[Claim]:
        weight = GRAVITY * mass(self.last, "mat")
        forces = [push(self.last, "mat", f"knife{k}") for k in range(1, len(PLACES) + 1)]
        details = self.last.report.details
        assert isinstance(details, ImplicitDetails)
        friction = details.friction_forces.get("mat", np.zeros(3))
        carried = (sum(forces) + float(friction[1])) / weight
        before, after = mechanical_energy(self.first), mechanical_energy(self.last)
        return [
            Claim(
                "at the end the three blades carry the mat within 2 %",
                ", ".join(f"{force:.2f} N" for force in forces) + f"; {100 * carried:.2f} % of its weight",
                abs(carried - 1) <= 0.02 and min(forces) > 0,
            ),
            Claim("the energy does not grow", f"{before:.4g} J before, {after:.4g} J after", after <= before),
        ]


KNIVES = torture(
    name="knives",
    summary="a soft mat falls on three blades without thickness",
    explanation=(
        "A mat (E = 30 kPa) of 60 x 30 x 3 cm falls by 5 cm on three upright sheets of two triangles each, which "
        "have no thickness, and hangs over their edges."
    ),
    scene=scene,
    measurement=_Measurement,
    small=Size((1,), 1 / 100, 60),
    full=Size((2,), 1 / 100, 100),
    large=Size((4,), 1 / 100, 20),
)
