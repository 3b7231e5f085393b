"""A hat stitched to a gummy bear, which is then thrown."""

from __future__ import annotations

from itertools import takewhile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.demos.demo import Claim, Demo, Measurement, stitch_lengths
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.numerics.geometry.triangle_tree import TriangleTree
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.obstacles.half_space import HalfSpace
from supple.scene.scene import Scene
from supple.scene.stitches.vertex_triangle import SoftVertexTriangleStitch
from supple.solvers.implicit.solver import Implicit
from supple.solvers.xpbd.solver import XPBD

HEIGHT, GAP = 0.1, 0.0015
THROW = np.array([0.45, 1.3, 0.1])
SPIN = np.array([0.0, 1.0, -5.0])
GRAVITY = np.array([0.0, -9.81, 0.0])


def scene() -> Scene:
    """A bear of 10 cm with a round hat stitched on between its ears, thrown up and forward over a floor."""
    bear = Body(
        "bear",
        shapes.gummy_bear(height=HEIGHT, edge_length=0.012),
        StableNeoHookean(youngs=5e4, poisson=0.4, density=1100.0, damping=0.005),
        position=(0, 0.51 * HEIGHT, 0),
        velocity=THROW,
        angular_velocity=SPIN,
        friction=0.5,
        skin=shapes.gummy_bear_surface(height=HEIGHT, resolution=40),
        look="gummy",
    )
    mesh = shapes.cylinder(radius=0.006, height=0.014, edge_length=0.004)
    placed = bear.place(bear.mesh.vertices)
    center = _just_above(TriangleTree.of(placed, bear.mesh.surface.triangles), mesh.vertices)
    # At the start the hat moves with the bear, as one rigid body.
    volumes = bear.mesh.volumes
    middle = volumes @ placed[bear.mesh.tets].mean(axis=1) / volumes.sum()
    hat = Body(
        "hat",
        mesh,
        StableNeoHookean(youngs=3e4, poisson=0.4, density=600.0, damping=0.005),
        position=center,
        velocity=THROW + np.cross(SPIN, center - middle),
        angular_velocity=SPIN,
        friction=0.5,
    )
    seam = SoftVertexTriangleStitch(
        "hat", "bear", max_distance=0.004, youngs=1e4, poisson=0.3, min_separate_distance=1e-3, damping=0.005
    )
    return Scene(
        bodies=[bear, hat],
        obstacles=[HalfSpace(name="floor", friction=0.5)],
        stitches=[seam],
        gravity=GRAVITY,
    )


def _just_above(surface: TriangleTree, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """The position of a mesh above the middle of a surface, at a distance of `GAP` from it."""
    center = np.array([0.0, 3.0 * HEIGHT, 0.0])
    for _ in range(100):
        center[1] -= float(surface.nearest(vertices + center)[1].min()) - GAP
    return center


def center_of_mass(frame: Frame) -> NDArray[np.float64]:
    """(3,) of all bodies together [m]."""
    m = frame.system.masses
    return m @ frame.state.positions / m.sum()


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        m, t = self.first.system.masses, frame.time
        throw = m @ self.first.state.velocities / m.sum()
        there = center_of_mass(self.first) + t * throw + 0.5 * t * t * GRAVITY
        lowest = float(frame.state.positions[:, 1].min())
        return {
            "longer": float(np.abs(stitch_lengths(frame) - stitch_lengths(self.first)).max()),
            "lowest": lowest,
            "time, height and way off": (t, lowest, float(np.linalg.norm(center_of_mass(frame) - there))),
        }

    def claims(self) -> list[Claim]:
        longer, lowest = max(self.series["longer"]), min(0.0, *self.series["lowest"])
        flight = list(takewhile(lambda way: way[0] <= 0.1 or way[1] >= 5e-3, self.series["time, height and way off"]))
        landed = len(flight) < self.statuses.total()
        in_air, off = flight[-1][0], max(way[2] for way in flight)
        return [
            Claim(
                "the hat stays on: no stitch becomes longer or shorter by more than 3 mm",
                f"at most {1e3 * longer:.2f} mm, over {self.last.time:.2f} s",
                longer <= 3e-3 and landed,
            ),
            Claim(
                "until they land, their common center of mass follows the parabola of free flight within 3 mm",
                f"at most {1e3 * off:.2f} mm off in {in_air:.2f} s",
                off <= 3e-3 and in_air > 0.15,
            ),
            Claim(
                "they land on the floor and do not sink into it by 1 mm",
                f"lowest point {1e3 * lowest:.3f} mm",
                landed and lowest > -1e-3,
            ),
        ]


STITCH = Demo(
    name="stitch",
    summary="a hat stitched to a gummy bear, which is then thrown",
    explanation=(
        "Hat and bear are two meshes that share no vertex. Soft tetrahedra between the hat's vertices and the "
        "triangles of the bear's head hold them together, in the air and when they hit the floor."
    ),
    scene=scene,
    solvers={"xpbd": lambda: XPBD(), "implicit": lambda: Implicit(integrator="bdf2")},
    measurement=_Measurement,
    steps=60,
)
