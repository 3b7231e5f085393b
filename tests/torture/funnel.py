"""A gummy bear is pulled through a funnel that is much narrower than the bear."""

import numpy as np
from tests.torture.watch import ContactMeasurement, Size, torture

from supple.app.demos.demo import Claim, volume
from supple.materials.elastic import NeoHookean
from supple.mesh import shapes
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.scene.body import Body
from supple.scene.motion import Keyframes
from supple.scene.obstacles.triangle_obstacle import TriangleObstacle
from supple.scene.pins import Pin
from supple.scene.scene import Scene

HEIGHT = 0.1
RIM, TOP, THROAT, BOTTOM = 0.07, 0.05, -0.03, -0.06  # radius of the rim, and heights of rim, throat and lower end [m]
SIDES = 32
START, WAY, SECONDS = 0.065, 0.30, 2.0


def funnel(neck: float) -> SurfaceMesh:
    """An open sheet around the y axis, with a neck of this radius [m]."""
    profile = ((RIM, TOP), (neck, THROAT), (neck, BOTTOM))
    angles = 2 * np.pi * np.arange(SIDES) / SIDES
    rings = [np.column_stack([r * np.cos(angles), np.full(SIDES, y), r * np.sin(angles)]) for r, y in profile]
    triangles = []
    k = np.arange(SIDES)
    after = (k + 1) % SIDES
    for i in range(len(profile) - 1):
        a, b = i * SIDES, (i + 1) * SIDES
        triangles += [np.column_stack([a + k, a + after, b + after]), np.column_stack([a + k, b + after, b + k])]
    return SurfaceMesh(np.concatenate(rings), np.concatenate(triangles))


def grip(mesh: TetMesh) -> np.ndarray:
    """The lowest vertices near the axis, which the pin holds."""
    x = mesh.vertices
    middle = np.hypot(x[:, 0], x[:, 2]) < 0.1 * HEIGHT
    return np.flatnonzero(middle & (x[:, 1] < x[middle, 1].min() + 0.08 * HEIGHT))


def scene(edge_length: float, neck: float) -> Scene:
    """A bear above the funnel; a pin at its lower end pulls it down along the axis."""
    mesh = shapes.gummy_bear(height=HEIGHT, edge_length=edge_length)
    bear = Body("bear", mesh, NeoHookean(youngs=3e4, poisson=0.4, density=1100.0, damping=0.01), position=(0, START, 0))
    pull = Keyframes([0.0, SECONDS], displacements=[(0, 0, 0), (0, -WAY, 0)])
    return Scene(
        bodies=[bear],
        obstacles=[TriangleObstacle(name="funnel", surface=funnel(neck), friction=0.1)],
        pins=[Pin("bear", grip(mesh), pull, name="grip")],
    )


class _Measurement(ContactMeasurement):
    def own_claims(self) -> list[Claim]:
        ratio = volume(self.last, "bear") / volume(self.first, "bear")
        highest = float(self.last.positions["bear"][:, 1].max()) - BOTTOM
        x = self.first.positions["bear"]
        surface = self.first.system.scene.obstacles[0].surface  # pyright: ignore[reportAttributeAccessIssue]
        neck = float(np.hypot(surface.vertices[:, 0], surface.vertices[:, 2]).min())
        width = max(float(np.ptp(x[:, 0])), float(np.ptp(x[:, 2])))
        return [
            Claim(
                f"the bear, {1e3 * width:.0f} mm wide, has passed through the neck, {2e3 * neck:.0f} mm wide",
                f"highest vertex {1e3 * highest:+.1f} mm from its end",
                highest < 0.0,
            ),
            Claim("its volume is the initial one within 5 %", f"{100 * ratio:.2f} %", abs(ratio - 1) <= 0.05),
        ]


FUNNEL = torture(
    name="funnel",
    summary="a gummy bear is pulled through a funnel that is narrower than the bear",
    explanation=(
        "A pin at the lower end of a gummy bear (E = 30 kPa), 10 cm tall and 5 cm wide, pulls it through a funnel, "
        "an open sheet of triangles with a neck of 36 mm."
    ),
    scene=scene,
    measurement=_Measurement,
    small=Size((0.014, 0.022), 1 / 10, round(10 * SECONDS)),
    full=Size((0.011, 0.018), 1 / 25, round(25 * SECONDS)),
    large=Size((0.0042, 0.018), 1 / 25, 12),
)
