"""The half of the Blender add-on that runs beside Supple; `make blender` tests the other one, in Blender."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from supple.mesh import shapes
from supple.mesh.primitives.surfaces import sphere_surface
from supple.scene.rotation import rotation_matrix

_FILE = Path(__file__).parents[2] / "blender" / "supple_addon" / "bake.py"
_SPEC = importlib.util.spec_from_file_location("bake", _FILE)
assert _SPEC is not None
assert _SPEC.loader is not None
bake = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(bake)


@pytest.mark.parametrize("guides", [1, 2, 8, 40])
def test_points_go_rigidly_with_what_carries_them(guides: int) -> None:
    rng = np.random.default_rng(2)
    begin = rng.random((guides, 3))
    turns = [rotation_matrix([0.0, 0.0, angle]) for angle in (0.0, 0.4, 1.5, 3.0)]
    # One or two guides do not determine a rotation.
    turns = turns if guides > 2 else [np.eye(3)] * 4
    path = np.array([begin @ R.T + [0.1 * k, 0.0, 2.0] for k, R in enumerate(turns)])
    points = rng.random((5, 3))
    expected = [(points - path[0][0]) @ (R @ turns[0].T).T + x[0] for R, x in zip(turns, path, strict=True)]
    np.testing.assert_allclose(bake.carried(points, path), expected, atol=1e-6)


def job(folder: Path, **changes: object) -> Path:
    """A ball that is held at its top, which turns and rises, above a block that rises and turns."""
    ball = sphere_surface(radius=0.1, edge_length=0.06)
    pinned = ball.vertices[:, 2] > 0.05
    path = [ball.vertices[pinned] @ rotation_matrix([0, 0, 0.1 * k]).T + [0.0, 0.0, 0.01 * k] for k in range(5)]
    np.savez(folder / "a.npz", vertices=ball.vertices, triangles=ball.triangles, pinned=pinned, path=np.array(path))
    block = shapes.box((0.2, 0.2, 0.2), (1, 1, 1)).surface.transformed(translation=(0.0, 0.0, -0.25))
    places = np.array([[0.0, 0.0, 0.01 * k] for k in range(5)])
    turns = np.array([rotation_matrix([0.0, 0.1 * k, 0.2 * k]) for k in range(5)])
    np.savez(folder / "b.npz", vertices=block.vertices, triangles=block.triangles, path=places, turns=turns)
    body = {"name": "ball", "arrays": "a.npz", "youngs": 5e4, "poisson": 0.4, "density": 1e3, "damping": 0.005}
    whole = {
        "frames": 4,
        "dt": 1 / 24,
        "gravity": [0.0, 0.0, -9.81],
        "floor": -1.0,
        "solver": "xpbd",
        "bodies": [{**body, "friction": 0.5, "tets": 200, "repair": False, **changes}],
        "obstacles": [{"name": "block", "arrays": "b.npz", "friction": 0.5}],
    }
    (folder / "job.json").write_text(json.dumps(whole), encoding="utf-8")
    return folder


def test_every_vertex_has_a_position_in_every_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert bake.main(job(tmp_path)) == 0
    with np.load(tmp_path / "a.npz") as arrays:
        vertices, pinned, path = arrays["vertices"], arrays["pinned"], arrays["path"]
    positions = np.load(tmp_path / "positions_0.npy")
    assert positions.shape == (5, *vertices.shape)
    np.testing.assert_allclose(positions[0], vertices, atol=1e-7)
    np.testing.assert_allclose(positions[:, pinned], path, atol=1e-6)
    assert np.abs(positions[4, ~pinned] - vertices[~pinned]).max() > 0.02
    report = json.loads((tmp_path / "report.json").read_text("utf-8"))
    assert report["warnings"] == []
    assert report["summary"].startswith("4 frames of 1 bodies")
    assert capsys.readouterr().out.splitlines()[-1] == "frame 4 of 4"


@pytest.mark.parametrize("solver", ["implicit", "xpbd"])
def test_a_cloth_keeps_its_vertices_and_loose_ones_stay(tmp_path: Path, solver: str) -> None:
    job(tmp_path, role="SHELL", thickness=2e-3)
    sheet = shapes.sheet(0.3, 0.3, 0.05)
    vertices = np.concatenate([[[1.0, 2.0, 3.0]], sheet.vertices[:, [0, 2, 1]]])
    triangles = sheet.triangles[:, ::-1] + 1
    pinned = (vertices[:, 0] < -0.14) | (vertices[:, 0] > 0.9)  # a border, and the loose one
    path = np.array([vertices[pinned] + [0.0, 0.0, 0.01 * k] for k in range(5)])
    np.savez(tmp_path / "a.npz", vertices=vertices, triangles=triangles, pinned=pinned, path=path)
    whole = json.loads((tmp_path / "job.json").read_text("utf-8"))
    (tmp_path / "job.json").write_text(json.dumps({**whole, "solver": solver}), "utf-8")
    assert bake.main(tmp_path) == 0
    positions = np.load(tmp_path / "positions_0.npy")
    np.testing.assert_allclose(positions[0], vertices, atol=1e-7)
    np.testing.assert_allclose(positions[:, pinned], path, atol=1e-6)
    fallen = positions[4, ~pinned] - vertices[~pinned]
    assert fallen[:, 2].min() < -0.02
    assert json.loads((tmp_path / "report.json").read_text("utf-8"))["warnings"] == []


def test_an_obstacle_turns_about_its_own_place(tmp_path: Path) -> None:
    job(tmp_path)
    with np.load(tmp_path / "b.npz") as arrays:
        turns = arrays["turns"]
    obstacle = bake._obstacle({"name": "block", "arrays": "b.npz", "friction": 0.5}, tmp_path, 1 / 24)
    for k in range(5):
        R, t = obstacle.pose(k / 24)
        np.testing.assert_allclose(R, turns[k], atol=1e-12)
        np.testing.assert_allclose(t, [0.0, 0.0, 0.01 * k], atol=1e-12)


def test_what_cannot_be_simulated_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert bake.main(job(tmp_path, youngs=-1.0)) == 2
    error = capsys.readouterr().err
    assert "youngs" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "report.json").exists()
