"""Spike on spike, edge on edge, point on point, with a friction coefficient of one."""

from typing import Any

import numpy as np
from tests.torture.watch import ContactMeasurement, Size, mechanical_energy, push, torture

from supple.app.demos.demo import Claim
from supple.materials.elastic import StableNeoHookean
from supple.mesh.tetmesh import TetMesh
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene.selection import InBox

GAP = 2e-3
FALL = 0.01


def pyramid(height: float, half: float) -> TetMesh:
    """Square pyramid, its tip up at the origin, on a base of side 2 `half`: four tets around its axis."""
    h, b = -height, half
    points = [[0, 0, 0], [0, h, 0], [-b, h, -b], [b, h, -b], [b, h, b], [-b, h, b]]
    return TetMesh(np.array(points), np.array([[0, 1, 2, 3], [0, 1, 3, 4], [0, 1, 4, 5], [0, 1, 5, 2]]))


def wedge(height: float, half: float, length: float) -> TetMesh:
    """A roof with its ridge along z, through the origin."""
    h, b, z = -height, half, length / 2
    points = [[0, 0, -z], [0, 0, z], [-b, h, -z], [b, h, -z], [-b, h, z], [b, h, z]]
    return TetMesh(np.array(points), np.array([[0, 2, 3, 4], [0, 3, 5, 4], [0, 5, 1, 4]]))


PAIRS = {
    "spikes": (pyramid(0.2, 0.02), (0, 0, 0)),
    "points": (pyramid(0.05, 0.05), (0, 0, 0)),
    "edges": (wedge(0.1, 0.05, 0.15), (0, 0, 0)),
    "crossed": (wedge(0.1, 0.05, 0.15), (0, np.pi / 2, 0)),
}


def scene() -> Scene:
    """Four pairs in a row: the lower one stands on its base, the upper one falls on it upside down."""
    material = StableNeoHookean(youngs=1e6, poisson=0.3, density=1000.0, damping=0.005)
    bodies, pins = [], []
    for k, (name, (mesh, turn)) in enumerate(PAIRS.items()):
        x = 0.3 * (k - 1.5)
        low = float(mesh.vertices[:, 1].min())
        bodies.append(Body(f"{name} below", mesh, material, position=(x, -low + GAP, 0), friction=1.0))
        # Upside down: half a turn about an axis in the plane, which is then turned about y.
        upside = np.pi * np.array([np.cos(turn[1] / 2), 0.0, np.sin(turn[1] / 2)])
        bodies.append(
            Body(f"{name} above", mesh, material, position=(x, -low + GAP + FALL, 0), rotation=upside, friction=1.0)
        )
        pins.append(Pin(f"{name} below", InBox((-9, -9, -9), (9, GAP + 1e-9, 9)), name=f"{name} base"))
    return Scene(bodies=bodies, pins=pins, obstacles=[HalfSpace(name="floor", friction=1.0)], gravity=(0, -9.81, 0))


class _Measurement(ContactMeasurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        pushes = {name: push(frame, f"{name} above", f"{name} below") for name in PAIRS}
        return {**super().values(frame), **pushes, "energy": mechanical_energy(frame)}

    def own_claims(self) -> list[Claim]:
        start = mechanical_energy(self.first)
        most = max(start, *self.series["energy"])
        caught = {name: max(0.0, *self.series[name]) for name in PAIRS}
        lowest = float(self.last.state.positions[:, 1].min())
        return [
            Claim(
                "each pair touches, and nothing sinks below the floor",
                ", ".join(f"{name} {force:.3g} N" for name, force in caught.items())
                + f"; lowest vertex {1e3 * lowest:.3g} mm above the floor",
                min(caught.values()) > 0.0 and lowest > 0.0,
            ),
            Claim(
                "at no time is there more energy than at the start",
                f"{start:.5g} J at the start, at most {most:.5g} J",
                most <= start * (1 + 1e-9),
            ),
        ]


SPIKES = torture(
    name="spikes",
    summary="spike on spike, point on point, edge on edge, with friction 1",
    explanation=(
        "Pyramids and roofs fall upside down on equal ones, tip exactly on tip, ridge along ridge and ridge across "
        "ridge, with a friction coefficient of 1. They balance, or topple and slide to the floor."
    ),
    scene=scene,
    measurement=_Measurement,
    small=Size((), 1 / 50, 40),
    full=Size((), 1 / 100, 200),
)
