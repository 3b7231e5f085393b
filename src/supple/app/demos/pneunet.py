"""A finger of air chambers that bends under pressure, against a finer mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.tetmesh import TetMesh
from supple.results.frame import Frame
from supple.results.readings.reading import AngleReading
from supple.scene.body import Body
from supple.scene.loads.cavity import Cavity
from supple.scene.loads.over_time import Curve
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.selection import InBox
from supple.scene.sensors import AngleSensor
from supple.solvers.implicit.solver import Implicit

# Cells of one chamber along the finger: two walls, two cells of air, and the slot to the next one.
_WALL, _AIR, _SLOT = (0, 3), (1, 2), 4
_HEIGHT, _WIDTH = 6, 4


def bellows(chambers: int, cell: float, finer: tuple[int, int, int] = (1, 1, 1)) -> TetMesh:
    """A finger along x from 0, with its base on y = 0; the air in the chambers is one void.

    Parameters
    ----------
    cell : thickness of the walls [m]; finer : into how many cells of the mesh this is divided along x, y and z
    """
    cells = np.array([5 * chambers - 1, _HEIGHT, _WIDTH])
    mesh = shapes.box(tuple(cells * cell), tuple(int(n) for n in cells * np.array(finer)))
    vertices = mesh.vertices + 0.5 * cells * cell
    i, j, k = np.floor(vertices[mesh.tets].mean(axis=1) / cell).astype(int).T
    tets = mesh.tets[_is_solid(i, j, k)]
    used, numbers = np.unique(tets, return_inverse=True)
    return TetMesh(vertices[used], numbers.reshape(-1, 4))


def _is_solid(i: NDArray[np.int_], j: NDArray[np.int_], k: NDArray[np.int_]) -> NDArray[np.bool_]:
    along, inside = i % 5, (k > 0) & (k < _WIDTH - 1)
    slot = (along == _SLOT) & (j > 2)
    chamber = np.isin(along, _AIR) & inside & (j > 0) & (j < _HEIGHT - 1)
    # The channel that joins the chambers begins and ends in the air of one.
    channel = (j == 1) & inside & (i > 0) & (i < i.max())
    return ~(slot | chamber | channel)


WALL, STEPS, HIGHEST = 0.005, 3, 6e4
# Cells of a wall along x, y and z. The reference has 7,968 quadratic tets; a slow test computes it again.
MESH, FINER = (1, 2, 2), (2, 2, 2)
REFERENCE = np.array([3.555, 7.591, 12.315])  # degrees at the pressures of the steps


def scene(divided: tuple[int, int, int] = MESH) -> Scene:
    """A finger of two chambers that is held at one end, of quadratic tets; the pressure rises in equal steps."""
    silicone = StableNeoHookean(youngs=5e5, poisson=0.45)
    finger = Body("finger", bellows(2, WALL, divided).to_order(2), silicone)
    wall = Pin("finger", InBox((-1, -1, -1), (1e-6, 1, 1)), name="wall")
    air = Cavity("finger", pressure=Curve([0.0, STEPS], [0.0, HIGHEST]))
    end = finger.mesh.vertices[:, 0].max()
    tip = AngleSensor("tip", "finger", InBox((end - 1e-9, -1, -1), (1, 1, 1)), axis=(0, 0, -1))
    return Scene([finger], pins=[wall], cavities=[air], sensors=[tip], gravity=(0, 0, 0))


def bend(frame: Frame) -> float:
    """By which the end of the finger has turned, towards its flat side [degrees]."""
    tip = frame.sensors["tip"]
    assert isinstance(tip, AngleReading)
    return float(np.degrees(tip.angle))


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        cavity = frame.report.cavities["finger"]
        return {**super().values(frame), "bend": bend(frame), "work": cavity.work, "stored": frame.report.energy}

    def claims(self) -> list[Claim]:
        bends = np.array(self.series["bend"])
        error = float(np.abs(bends / REFERENCE[: len(bends)] - 1.0).max())
        work, stored = float(np.sum(self.series["work"])), self.series["stored"][-1]
        angles = ", ".join(f"{angle:.2f}" for angle in bends)
        return [
            Claim(
                "the finger bends as on a mesh with twice as many tets, within 5 %",
                f"{angles} degrees; largest difference {100 * error:.2g} %",
                error <= 0.05,
            ),
            Claim("it bends by more than 10 degrees", f"{bends[-1]:.2f} degrees", bool(bends[-1] > 10.0)),
            # Three steps take the work with the pressure at the end of each.
            Claim(
                "the air does more work than the finger stores",
                f"{1e3 * work:.3g} mJ of work, {1e3 * stored:.3g} mJ stored",
                work > stored,
            ),
            self.no_tet_inverts(),
        ]


PNEUNET = Demo(
    name="pneunet",
    summary="a bellows finger that bends under air pressure, against a finer mesh",
    explanation=(
        "Air presses on the walls of two chambers in a row, which are one cavity. The chambers lengthen and the flat "
        "base does not, so that the finger bends towards its base."
    ),
    scene=scene,
    # Quadratic tets, since thin walls of linear ones are too stiff; each step is an equilibrium.
    solvers={"implicit": lambda: Implicit(integrator="static", contact=None, tolerance=1e-6)},
    measurement=_Measurement,
    dt=1.0,
    steps=STEPS,
)
