"""A masonry arch of 25 loose blocks, held by friction and its own weight."""

import numpy as np
from tests.torture.watch import ContactMeasurement, Size, center, mass, push, torture

from supple.app.demos.demo import Claim
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.tetmesh import TetMesh
from supple.scene.body import Body
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.scene import Scene
from supple.solvers.implicit.contact.settings import IPCContact
from supple.solvers.implicit.solver import Implicit

BLOCKS, RADIUS, THICKNESS, DEPTH = 25, 1.0, 0.25, 0.3
JOINT, DHAT = 1.99e-5, 2e-5  # width of the joints at the start, and where contact begins [m]
MU, SLOW = 0.5, 1e-5
SECONDS = 20.0
GRAVITY = 9.81


def voussoir(k: int, cells: int) -> TetMesh:
    """The k-th block of a semicircle, counted from its right end; on each side half of a joint is left out."""
    half = np.pi / BLOCKS / 2 - JOINT / 2 / RADIUS
    middle = np.pi * (k + 0.5) / BLOCKS
    mesh = shapes.box((THICKNESS, 2 * half, DEPTH), (cells, cells, cells))
    r, angle = RADIUS + mesh.vertices[:, 0], middle + mesh.vertices[:, 1]
    # The faces between blocks are planes through the axis, so all blocks have the same shape.
    return TetMesh(np.column_stack([r * np.cos(angle), r * np.sin(angle), mesh.vertices[:, 2]]), mesh.tets)


def scene(cells: int) -> Scene:
    """A semicircle of mean radius 1 m on a floor."""
    stone = StableNeoHookean(youngs=1e9, poisson=0.2, density=2000.0)
    bodies = [
        Body(f"block{k + 1:02d}", voussoir(k, cells), stone, position=(0, DHAT, 0), friction=MU) for k in range(BLOCKS)
    ]
    return Scene(bodies=bodies, obstacles=[HalfSpace(name="floor", friction=MU)], gravity=(0, -GRAVITY, 0))


class _Measurement(ContactMeasurement):
    def own_claims(self) -> list[Claim]:
        names = list(self.first.positions)
        moved = {name: float(np.linalg.norm(center(self.last, name) - center(self.first, name))) for name in names}
        furthest = max(moved, key=lambda name: moved[name])
        weight = GRAVITY * sum(mass(self.last, name) for name in names)
        carried = sum(push(self.last, name, "floor") for name in names) / weight
        return [
            Claim(
                f"the arch stands for {SECONDS:g} s: no block moves by more than 1 % of the thickness",
                f"{furthest} by {1e3 * moved[furthest]:.3g} mm up to {self.last.time:.3g} s",
                self.last.time >= SECONDS - 1e-9 and moved[furthest] <= 0.01 * THICKNESS,
            ),
            Claim("the floor carries its weight within 2 %", f"{100 * carried:.2f} %", abs(carried - 1) <= 0.02),
        ]


ARCH = torture(
    name="arch",
    summary="an arch of 25 loose blocks stands for 20 s on friction alone",
    explanation=(
        "A semicircle of 25 wedge-shaped blocks (E = 1 GPa, mu = 0.5), 2 m wide and 25 cm thick, without mortar. A "
        "line of thrust fits within its thickness, so it stands."
    ),
    scene=scene,
    solver=lambda: Implicit(contact=IPCContact(dhat=DHAT, friction_velocity=SLOW)),
    measurement=_Measurement,
    small=Size((1,), 1 / 5, round(5 * SECONDS)),
    full=Size((1,), 1 / 20, round(20 * SECONDS)),
)
