"""A rope is tied around a soft cylinder and pulled."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.distance import cdist

from supple.app.demos.demo import Claim, Demo, Measurement, meetings
from supple.materials.elastic import StableNeoHookean
from supple.materials.rods.rod_material import RodMaterial
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.motion import Keyframes
from supple.scene.pins import Pin
from supple.scene.rod import Rod
from supple.scene.scene import Scene
from supple.solvers.implicit.solver import Implicit

RADIUS, LENGTH, YOUNGS = 0.03, 0.1, 4e4
ROPE, EDGES, PULL, SECONDS, FRICTION = 0.003, 90, 0.056, 0.9, 0.2


def tied(radius: float, rope: float, edges: int) -> NDArray[np.float64]:
    """(edges + 1, 3) an overhand knot around a cylinder along z [m]: a loop whose ends turn 1.5 times about each
    other above it."""
    apart, half, around = 2.2 * rope, 0.7 * radius, radius + 2.2 * rope
    axis = around + 2.6 * rope  # the height of the line about which the ends turn
    phase = np.linspace(-0.5 * np.pi, 2.5 * np.pi, 25)
    turning = np.column_stack([np.linspace(-half, half, 25), axis + apart * np.sin(phase), apart * np.cos(phase)])
    angles = np.linspace(0.3, 1.7, 15) * np.pi + 0.5 * np.pi
    loop = around * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    end = np.column_stack([np.linspace(half + 0.4 * radius, 2.2 * radius, 5), np.full(5, axis + apart), np.zeros(5)])
    # From the left end to the right above the loop, around and back, and again to the right.
    other = turning * [-1.0, 1.0, -1.0]
    x = np.concatenate([end[::-1] * [-1.0, 1.0, 1.0], other[::-1], loop[::-1], turning, end])
    fine = CubicSpline(_along(x), x)(np.linspace(0.0, _along(x)[-1], 4000))
    places = np.linspace(0.0, _along(fine)[-1], edges + 1)
    return np.column_stack([np.interp(places, _along(fine), column) for column in fine.T])


def _along(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) lengths of a line of points up to each [m]."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])


def scene() -> Scene:
    """A cylinder of 6 cm whose ends are held, and a rope of 6 mm whose ends move apart."""
    fibres = RodMaterial(youngs=2e7, poisson=0.3, radius=ROPE, bending=1e-5, density=1000.0, damping=0.005)
    soft = StableNeoHookean(youngs=YOUNGS, poisson=0.4, density=1000.0, damping=0.01)
    cylinder = shapes.cylinder(RADIUS, LENGTH, 0.012)
    faces = np.flatnonzero(np.abs(cylinder.vertices[:, 1]) > 0.499 * LENGTH)
    ends = [
        Pin("rope", rows, name=name, motion=Keyframes([0.0, SECONDS], [(0, 0, 0), (sign * PULL, 0, 0)]))
        for name, rows, sign in (("left", [0, 1], -1.0), ("right", [EDGES - 1, EDGES], 1.0))
    ]
    bodies: list[Any] = [
        Rod("rope", tied(RADIUS, ROPE, EDGES), fibres, friction=FRICTION),
        Body("cylinder", cylinder, soft, rotation=(0.5 * np.pi, 0, 0), friction=FRICTION),
    ]
    return Scene(bodies, pins=[Pin("cylinder", faces, name="faces"), *ends])


def crossings(x: NDArray[np.float64]) -> NDArray[np.int64]:
    """(k,) 1 or -1 for every crossing of a line of points (n, 3) with itself, as seen along z: whether the part above
    it runs to the left or to the right."""
    i, j = np.triu_indices(len(x) - 1, 2)
    a, u, c, v = x[i], np.diff(x, axis=0)[i], x[j], np.diff(x, axis=0)[j]

    def area(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
        return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]

    turn = area(u, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = area(c - a, v) / turn, area(c - a, u) / turn
    met = (s >= 0.0) & (s < 1.0) & (t >= 0.0) & (t < 1.0)
    above = (a + s[:, None] * u - c - t[:, None] * v)[met, 2]
    return np.sign(turn[met] * above).astype(np.int64)


def least_distance(x: NDArray[np.float64]) -> float:
    """Between parts of a line of points (n, 3) that are not beside each other along it [m]: twelve radii apart."""
    along = _along(x)
    places = np.linspace(0.0, along[-1], 8 * len(x))
    fine = np.column_stack([np.interp(places, along, column) for column in x.T])
    apart = np.abs(places[:, None] - places) > 12.0 * ROPE
    return float(cdist(fine, fine)[apart].min())


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        line, around = frame.positions["rope"][: EDGES + 1], frame.positions["cylinder"]
        middle = np.abs(around[:, 2]) < 0.1 * LENGTH
        return {
            **super().values(frame),
            "meetings": meetings(frame),
            "crossings": int(crossings(line).sum()),
            "distance": least_distance(line),
            "width": float(np.ptp(around[middle, 0])),
        }

    def claims(self) -> list[Claim]:
        turns, least = set(self.series["crossings"]), min(self.series["distance"])
        waist = self.series["width"][-1] / self.series["width"][0]
        _, left, right = (float(force[0]) for force in self.last.reactions.values())
        off = abs(left + right) / abs(right)
        return [
            self.nothing_crosses(),
            Claim(
                "the rope does not pass itself: seen along the cylinder, it crosses itself three times in each frame",
                f"sums of signed crossings {sorted(turns)}",
                len(turns) == 1 and abs(turns.copy().pop()) == 3,
            ),
            Claim(
                "two parts of it are never nearer than its thickness",
                f"the smallest distance is {1e3 * least:.3f} mm of {2e3 * ROPE:g} mm",
                least > 1.998 * ROPE,
            ),
            Claim(
                "the knot holds, and squeezes the cylinder by a tenth of its width or more",
                f"{100 * (1 - waist):.1f} %, with {right:.2f} N at the right end",
                waist < 0.9 and right > 0.0,
            ),
            Claim("both ends pull alike within 5 %", f"difference {100 * off:.2g} %", off < 0.05),
            self.no_tet_inverts(),
        ]


KNOT = Demo(
    name="knot",
    summary="a rope is tied around a soft cylinder and pulled",
    explanation=(
        "A rope of 6 mm is tied around a soft cylinder with an overhand knot. Its ends are pulled apart: the knot "
        "tightens, holds by friction, and squeezes the cylinder. The rope is a rod, which stretches, bends and twists; "
        "it touches the cylinder and itself at its radius, and passes through neither."
    ),
    scene=scene,
    solvers={"implicit": Implicit},
    measurement=_Measurement,
    steps=60,
)
