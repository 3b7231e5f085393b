"""A sphere squeezed in a box and released."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement, height, spin_about, volume
from supple.materials.elastic import EdgesAndVolume, StableNeoHookean
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.forces import SoftTarget
from supple.scene.motion import Keyframes
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.solvers.implicit.solver import Implicit
from supple.solvers.xpbd.solver import XPBD

RADIUS = 0.5
PRESSED, RELEASED = 1.4, 1.9


def scene() -> Scene:
    """A sphere of radius 0.5 m on a floor, a lid that moves down to 0.55 m, and four walls; all but the floor move
    away."""
    ball = Body(
        "ball",
        shapes.sphere(radius=RADIUS, edge_length=0.11),
        EdgesAndVolume(edge_compliance=1e-4, volume_compliance=0.0, density=1000.0, damping=0.003),
        position=(0.0, RADIUS, 0.0),
    )
    down = -(2.0 * RADIUS - 0.55)
    lid = Keyframes([0.2, PRESSED, RELEASED, RELEASED + 0.1], [[0, 0, 0], [0, down, 0], [0, down, 0], [0, 3, 0]])
    wall = 1.3 * RADIUS

    def opening(direction: tuple[float, float, float]) -> Keyframes:
        return Keyframes([RELEASED, RELEASED + 0.1], [[0, 0, 0], [3 * d for d in direction]])

    return Scene(
        bodies=[ball],
        obstacles=[
            HalfSpace(name="floor", point=(0, 0, 0), normal=(0, 1, 0)),
            HalfSpace(name="lid", point=(0, 2 * RADIUS + 0.01, 0), normal=(0, -1, 0), motion=lid),
            HalfSpace(name="left", point=(-wall, 0, 0), normal=(1, 0, 0), motion=opening((-1, 0, 0))),
            HalfSpace(name="right", point=(wall, 0, 0), normal=(-1, 0, 0), motion=opening((1, 0, 0))),
            HalfSpace(name="back", point=(0, 0, -wall), normal=(0, 0, 1), motion=opening((0, 0, -1))),
            HalfSpace(name="front", point=(0, 0, wall), normal=(0, 0, -1), motion=opening((0, 0, 1))),
        ],
    )


def pinned_scene() -> Scene:
    """A sphere of radius 0.5 m with a pinned bottom cap; springs move its top cap down and up again."""
    mesh = shapes.sphere(radius=RADIUS, edge_length=0.13)
    skin = np.unique(mesh.surface.triangles)
    height = mesh.vertices[skin, 1]
    down = -(2.0 * RADIUS - 0.55)
    press = Keyframes([0.2, PRESSED, RELEASED, RELEASED + 0.3], [[0, 0, 0], [0, down, 0], [0, down, 0], [0, 0, 0]])
    return Scene(
        bodies=[
            Body(
                "ball",
                mesh,
                StableNeoHookean(youngs=5e4, poisson=0.49, density=1000.0, damping=0.01),
                position=(0.0, RADIUS, 0.0),
            )
        ],
        pins=[Pin("ball", skin[height <= -0.8 * RADIUS], name="floor")],
        soft_targets=[SoftTarget("ball", skin[height >= 0.8 * RADIUS], 5e4, press, name="lid")],
        gravity=(0, 0, 0),
    )


class _Pressed(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        change = abs(volume(frame, "ball") / volume(self.first, "ball") - 1.0)
        return {**super().values(frame), "change of volume": change, "height": height(frame, "ball")}


class _Measurement(_Pressed):
    def values(self, frame: Frame) -> dict[str, Any]:
        J = frame.det_F
        tet = int(np.abs(J - 1.0).argmax())
        spin = abs(spin_about(frame, "ball", 1))
        return {**super().values(frame), "J, tet and time": (float(J[tet]), tet, frame.time), "spin": spin}

    def claims(self) -> list[Claim]:
        change, spin = max(self.series["change of volume"]), max(self.series["spin"])
        J, tet, time = max(self.series["J, tet and time"], key=lambda worst: abs(worst[0] - 1.0))
        lowest, at_end = min(self.series["height"]), self.series["height"][-1]
        return [
            Claim(
                "the body's volume stays within 1 % in every frame",
                f"largest change {100 * change:.3f} %; worst tet {tet}: J = {J:.3f} at {time:.2f} s",
                change <= 0.01,
            ),
            Claim(
                "squeezed below 60 % of its height, it recovers at least 90 % of it",
                f"squeezed to {lowest:.3f} m, at the end {at_end:.3f} m of {2 * RADIUS:.1f} m",
                lowest <= 1.2 * RADIUS and at_end >= 1.8 * RADIUS,
            ),
            Claim(
                "it does not start to spin: at most 1e-9 rad/s about the vertical in every frame",
                f"at most {spin:.1e} rad/s in {self.last.time:.1f} s",
                spin <= 1e-9,
            ),
        ]


class _PinnedMeasurement(_Pressed):
    def claims(self) -> list[Claim]:
        change = max(self.series["change of volume"])
        lowest, at_end = min(self.series["height"]), self.series["height"][-1]
        return [
            Claim("every step converges", self.endings, self.every_step_converged),
            self.no_tet_inverts(),
            Claim(
                "squeezed below 60 % of its height, it keeps its volume within 5 % (Poisson's ratio is 0.49)",
                f"squeezed to {lowest:.3f} m; largest change of volume {100 * change:.2f} %",
                lowest <= 1.2 * RADIUS and change <= 0.05,
            ),
            Claim(
                "released, it recovers its height within 1 %",
                f"at the end {at_end:.4f} m of {2 * RADIUS:.1f} m",
                abs(at_end / (2 * RADIUS) - 1.0) <= 0.01,
            ),
        ]


_IMPLICIT = Demo(
    name="squash",
    summary="a sphere squeezed between its caps and released",
    explanation=(
        "The same ball with the implicit solver, without obstacles: a pin holds its bottom cap instead of a floor. "
        "Springs press its top cap down to 55 % of the ball's height, then move back. The material is stable "
        "Neo-Hookean rubber (E = 50 kPa, nu = 0.49) instead of edges and volumes. No tetrahedron inverts."
    ),
    scene=pinned_scene,
    solvers={"implicit": Implicit},
    measurement=_PinnedMeasurement,
    steps=210,
)

SQUASH = Demo(
    name="squash",
    summary="a sphere squeezed in a box and released",
    explanation=(
        "A lid presses the ball to 55 % of its height between four walls, then lid and walls move away. Tetrahedra "
        "resist every change of volume; edges are springs. With plain XPBD the ball would spin faster and faster; "
        "restoring the momentum prevents that."
    ),
    scene=scene,
    solvers={"xpbd": lambda: XPBD(substeps=40)},
    measurement=_Measurement,
    steps=240,
    variants={"implicit": _IMPLICIT},
)
