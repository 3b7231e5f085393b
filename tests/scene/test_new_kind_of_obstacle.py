"""A new kind of obstacle needs one class and one call of `register`, and no change of another file."""

import shutil
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Annotated, ClassVar

import h5py
import numpy as np
import pytest
from tests.scenes import converged

import supple as sp
from supple.app.viewer.engine.describe import contact_points, describe
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.simulation_loop import SimulationLoop
from supple.app.viewer.from_snapshot import MomentBuilder
from supple.app.viewer.protocol.command_queue import CommandQueue
from supple.app.viewer.protocol.live_source import LiveSource
from supple.kinds.forms import POSITIVE
from supple.numerics.geometry.convex_hull import convex_hull
from supple.results.view.from_recording import model_of_recording, moment_of_frame
from supple.results.view.layers.surfaces import ObstacleView
from supple.results.view.surfaces import obstacle_surfaces
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


def test_a_recording_restores_it(recorded, tmp_path):
    path, _ = recorded
    with sp.read_recording(path) as recording:
        (found,) = recording.obstacles
        assert isinstance(found, RoundedCube)
        assert (found.half, found.rounding, found.friction) == (0.5, 0.1, 0.4)
        np.testing.assert_allclose(recording[20].obstacle_poses[0, :, 3], [0, 0.1 / 3, 0], atol=1e-12)
        (drawn,) = obstacle_surfaces(model_of_recording(recording))
        assert drawn.vertices[:, 0].max() == pytest.approx(0.5, abs=2e-3)
    elsewhere = tmp_path / "elsewhere.vtkhdf"
    shutil.copy(path, elsewhere)
    with h5py.File(elsewhere, "r+") as file:
        text = file["supple/header"][()].decode().replace('"RoundedCube"', '"AnotherCube"')
        del file["supple/header"]
        file["supple/header"] = text
    with pytest.raises(sp.OutputError, match="the class 'AnotherCube' is not known here; import the module"):
        sp.read_recording(elsewhere)


def test_the_checker_finds_penetration_and_containment(recorded, tmp_path):
    path, _ = recorded
    only = ["obstacles", "containment"]
    report = sp.check_recording(path, only=only)
    assert report["containment"].verdict == "pass"
    assert report["obstacles"].worst > -1e-4
    copy = tmp_path / "copy.vtkhdf"
    copy.write_bytes(path.read_bytes())
    with h5py.File(copy, "r+") as file:
        n = int(file["VTKHDF/NumberOfPoints"][0])
        x = file["VTKHDF/Points"][3 * n : 4 * n]
        file["VTKHDF/Points"][3 * n : 4 * n] = x - [0.0, 0.05, 0.0]
        file["VTKHDF/Points"][5 * n : 6 * n] = 20 * (x - x.mean(axis=0))
    report = sp.check_recording(copy, only=only)
    assert report["obstacles"].first_failure == 3
    assert report["containment"].where == "RoundedCube 1 in cube"


@pytest.mark.parametrize("kind", ["obj", "glb", "html"])
def test_exports_contain_it(recorded, tmp_path, kind):
    path, _ = recorded
    output = tmp_path / ("rounded" if kind == "obj" else f"rounded.{kind}")
    with sp.read_recording(path) as recording:
        recording.export(kind, output)
    files = sorted(output.iterdir()) if output.is_dir() else [output]
    assert b"RoundedCube" in files[0].read_bytes() or kind == "html"
    assert files[0].stat().st_size > 10_000


class Stage:
    """Records what is drawn on a page."""

    def add_mesh_simple(self, name, vertices, triangles, **options):
        self.name, self.vertices, self.options = name, vertices, options
        return SimpleNamespace(**options)


def test_pages_draw_it(recorded):
    path, _ = recorded
    with sp.read_recording(path) as recording:
        model = model_of_recording(recording)
        begins, ends = (moment_of_frame(model, recording[k]) for k in (0, 20))
        stage = Stage()
        view = ObstacleView(stage, begins)
        assert stage.name == "/obstacles/0 RoundedCube 1"
        assert np.abs(stage.vertices).max() == pytest.approx(0.5, abs=2e-3)
        handle, *_ = view.nodes
        view.update(ends)
        np.testing.assert_allclose(handle.position, [0, 0.1 / 3, 0], atol=1e-12)


def test_a_running_scene_draws_it():
    live = LiveScene(LiveSource("rounded", falling_cube(), sp.XPBD(substeps=4), 1 / 60))
    loop = SimulationLoop(live, CommandQueue(), None)
    moment = MomentBuilder().moment(replace(loop.snapshot(0.0), description=describe(live)))
    assert moment.model.obstacles[0].summary() == live.system.obstacles[0].summary()
    assert not len(contact_points(live))
    for _ in range(20):
        live.step()
    assert len(contact_points(live)) >= 3
