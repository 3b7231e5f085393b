"""Tetrahedra and a cube fall through a slot that is wider than they are by one micrometre on either side."""

import numpy as np
from tests.torture.watch import ContactMeasurement, Size, center, torture

from supple.app.demos.demo import Claim
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.scene.body import Body
from supple.scene.obstacles.triangle_obstacle import TriangleObstacle
from supple.scene.scene import Scene
from supple.solvers.implicit.contact.settings import IPCContact
from supple.solvers.implicit.solver import Implicit

CLEARANCE = 1e-6
WIDTH, DEPTH, BEVEL = 0.1, 0.2, 0.02
GRAVITY = 9.81
BOTTOM = -DEPTH


def tetrahedron(width: float) -> TetMesh:
    """One regular tet between two planes `width` apart: an edge lies in each of them."""
    h = width / 2
    return TetMesh(np.array([[-h, 0, h], [-h, 0, -h], [h, h, 0], [h, -h, 0]]), np.array([[0, 1, 2, 3]]))


def wall(side: float) -> SurfaceMesh:
    """A closed prism along z; its upper inner edge is bevelled, so that the slot is wider at the top."""
    inner, outer = WIDTH / 2, WIDTH / 2 + 0.1
    profile = np.array([(inner, -DEPTH), (inner, -BEVEL), (inner + BEVEL, 0), (outer, 0), (outer, -DEPTH)])
    n = len(profile)
    points = np.concatenate(
        [np.column_stack([side * profile[:, 0], profile[:, 1], np.full(n, z)]) for z in (-0.3, 0.3)]
    )
    k = np.arange(n)
    after = (k + 1) % n
    fan = np.array([[0, 1, 4], [1, 3, 4], [1, 2, 3]])
    triangles = np.concatenate(
        [np.column_stack([k, after + n, after]), np.column_stack([k, k + n, after + n]), fan, fan[:, ::-1] + n]
    )
    return SurfaceMesh(points, triangles if side > 0 else triangles[:, ::-1])


def scene(names: tuple[str, ...]) -> Scene:
    """Two walls along z, and above their gap the bodies of these names, one micrometre from either wall."""
    material = StableNeoHookean(youngs=1e6, poisson=0.3, density=1000.0)
    width = WIDTH - 2 * CLEARANCE
    box = shapes.box((width, WIDTH, WIDTH), (2, 2, 2))
    bodies = [
        Body("tet", tetrahedron(width), material, position=(0, 0.07, -0.2)),
        Body("cube", box, material, position=(0, 0.07, 0)),
        Body("leaning tet", tetrahedron(width), material, position=(0, 0.07, 0.2), rotation=(0.4, 0, 0)),
    ]
    walls = [
        TriangleObstacle(name="left", surface=wall(-1.0)),
        TriangleObstacle(name="right", surface=wall(1.0)),
    ]
    return Scene(bodies=[body for body in bodies if body.name in names], obstacles=walls, gravity=(0, -GRAVITY, 0))


class _Measurement(ContactMeasurement):
    def own_claims(self) -> list[Claim]:
        n = self.statuses.total()
        fall = GRAVITY * self.dt**2 * n * (n + 1) / 2  # backward Euler in free fall
        behind = {
            name: 1 - float((center(self.first, name) - center(self.last, name))[1]) / fall
            for name in self.last.positions
        }
        slowest = max(behind, key=lambda name: abs(behind[name]))
        highest = max(float(x[:, 1].max()) for x in self.last.positions.values())
        return [
            Claim(
                "all of them have left the slot at its lower end",
                f"highest vertex {1e3 * (highest - BOTTOM):+.1f} mm from it",
                highest < BOTTOM,
            ),
            Claim(
                "without friction they fall as in free fall, within 1 %",
                f"{slowest} is furthest off, {100 * behind[slowest]:.2g} % behind",
                abs(behind[slowest]) <= 0.01,
            ),
        ]


SLOTS = torture(
    name="slots",
    summary="tets and a cube fall through a slot that leaves one micrometre on either side",
    explanation=(
        "Two single tetrahedra and a cube, 10 cm wide, fall through a slot that leaves them one micrometre on "
        "either side: they neither touch its walls nor get stuck."
    ),
    scene=scene,
    solver=lambda: Implicit(contact=IPCContact(dhat=CLEARANCE / 2)),
    measurement=_Measurement,
    small=Size((("tet", "leaning tet"),), 1 / 50, 15),
    full=Size((("tet", "cube", "leaning tet"),), 1 / 100, 30),
)
