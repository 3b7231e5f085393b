"""A new kind of obstacle needs one class and one call of `register`, and no change of another file."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import pytest
from tests.scenes import converged

import supple as sp
from supple.kinds.validators import POSITIVE
from supple.numerics.geometry.convex_hull import convex_hull
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.obstacles.polyhedra import round_ball
from supple.scene.registry import PARTS, register

RUBBER = sp.StableNeoHookean(youngs=2e4, poisson=0.3, density=1000.0, damping=0.01)


@dataclass(frozen=True, eq=False)
class RoundedCube(Obstacle):
    """A cube with rounded edges and corners.

    Parameters
    ----------
    half : half the edge length, with the rounded parts [m]; rounding : radius of the edges [m]
    """

    half: Annotated[float, POSITIVE] = 0.5
    rounding: Annotated[float, POSITIVE] = 0.1

    kind: ClassVar[str] = "rounded_cube"

    def signed_distance(self, points):
        h = self.half - self.rounding
        off = points - np.clip(points, -h, h)
        length = np.linalg.norm(off, axis=1)
        up = np.copysign(1.0, points[:, 1])[:, None] * np.array([0.0, 1.0, 0.0])
        normals = np.where(length[:, None] > 0.0, off / np.maximum(length, 1e-300)[:, None], up)
        return np.where(length > 0.0, length, np.abs(points[:, 1]) - h) - self.rounding, normals

    def triangles(self):
        ball = self.rounding * round_ball(inscribed=False)[0]
        h = self.half - self.rounding
        corners = [[x, y, z] for x in (-h, h) for y in (-h, h) for z in (-h, h)]
        return convex_hull(np.concatenate([ball + corner for corner in np.array(corners)]))


@pytest.fixture(autouse=True)
def registered():
    register(RoundedCube)
    yield
    PARTS["obstacles"].kinds.remove(RoundedCube)


def falling_cube(**obstacle):
    cube = sp.Body("cube", sp.shapes.box((0.2,) * 3, (2, 2, 2)), RUBBER, position=(0, 0.605, 0))
    return sp.Scene([cube], [RoundedCube(friction=0.4, **obstacle)])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("rounded") / "rounded.vtkhdf"
    lift = sp.Keyframes([0, 1], [[0, 0, 0], [0, 0.1, 0]])
    return path, list(
        sp.simulate(falling_cube(motion=lift), sp.XPBD(substeps=10), 1 / 60, 20, sinks=[sp.Recorder(path)])
    )


@pytest.mark.parametrize("solver", [sp.XPBD(substeps=10), sp.Implicit()], ids=["xpbd", "implicit"])
def test_a_cube_comes_to_rest_on_it(solver):
    frames = converged(sp.simulate(falling_cube(), solver, 1 / 60, 30))
    lowest = [frame.positions["cube"][:, 1].min() for frame in frames]
    assert min(lowest) > 0.5 - 1e-4
    assert lowest[-1] == pytest.approx(0.5, abs=2e-3)
    assert frames[-1].report.kinetic_energy < 1e-2


def test_a_scripted_one_lifts_the_cube(recorded):
    _, frames = recorded
    assert frames[-1].positions["cube"][:, 1].min() == pytest.approx(0.5 + 0.1 / 3, abs=2e-3)
