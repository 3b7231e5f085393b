"""Two turning rollers pull a soft ball through a gap that is narrower than the ball."""

import numpy as np
from tests.torture.watch import ContactMeasurement, Size, torture

from supple.app.demos.demo import Claim, volume
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.surface import SurfaceMesh
from supple.scene.body import Body
from supple.scene.motion import Keyframes
from supple.scene.obstacles.polyhedra import prism
from supple.scene.obstacles.triangle_obstacle import TriangleObstacle
from supple.scene.scene import Scene

RADIUS = 0.1  # of the ball [m]
ROLLER, GAP = 0.15, 0.1  # radius of the rollers, and the distance of their surfaces [m]
SPIN = 2 * np.pi  # [rad/s]


def roller(x: float) -> SurfaceMesh:
    """A closed cylinder along z at x, of 48 sides."""
    points, triangles = prism(inscribed=True, sides=48)
    return SurfaceMesh(np.array([x, 0.0, 0.0]) + points[:, [1, 2, 0]] * [ROLLER, ROLLER, 0.2], triangles)


def scene(edge_length: float) -> Scene:
    """A ball on two rollers that turn towards each other."""
    ball = StableNeoHookean(youngs=5e4, poisson=0.4, density=1000.0, damping=0.01)
    away = ROLLER + GAP / 2
    height = np.sqrt((ROLLER + RADIUS) ** 2 - away**2) + 0.005
    obstacles = [
        TriangleObstacle(
            name=name,
            surface=roller(sign * away),
            friction=1.0,
            motion=Keyframes([0.0, 10.0], angles=[0.0, 10.0 * sign * SPIN], axis=(0, 0, 1), pivot=(sign * away, 0, 0)),
        )
        for name, sign in (("left", -1.0), ("right", 1.0))
    ]
    mesh = shapes.sphere(RADIUS, edge_length)
    return Scene(bodies=[Body("ball", mesh, ball, position=(0, height, 0))], obstacles=obstacles)


class _Measurement(ContactMeasurement):
    def own_claims(self) -> list[Claim]:
        highest = float(self.last.positions["ball"][:, 1].max())
        ratio = volume(self.last, "ball") / volume(self.first, "ball")
        return [
            Claim(
                "the whole ball is below the axes of the rollers",
                f"highest vertex at {1e3 * highest:+.0f} mm",
                highest < 0.0,
            ),
            Claim("its volume is the initial one within 1 %", f"{100 * ratio:.2f} %", abs(ratio - 1) <= 0.01),
        ]


ROLLERS = torture(
    name="rollers",
    summary="two turning rollers pull a ball through a gap of half its width",
    explanation=(
        "A soft ball (E = 50 kPa) of 20 cm lies on two rollers that turn towards each other, one turn a second, "
        "10 cm apart. Friction alone (mu = 1) pulls it through."
    ),
    scene=scene,
    measurement=_Measurement,
    small=Size((0.05,), 1 / 50, 25),
    full=Size((0.033,), 1 / 100, 50),
)
