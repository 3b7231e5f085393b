"""Quadratic tets in recordings: cells, readings, skins, exports, and the check, which finds what is wrong."""

import shutil

import h5py
import meshio
import numpy as np
import pytest

import supple as sp
from supple.errors import OutputError
from supple.results.check.checker import check_recording
from supple.results.export.exporter import export

JELLY = sp.NeoHookean(youngs=1e4, poisson=0.45)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A curved quadratic bar with a skin, and a linear cube."""
    bar = sp.shapes.box((0.6, 0.2, 0.2), (3, 1, 1), order=2)
    x = bar.vertices + 0.01 * np.sin(7.0 * bar.vertices[:, [1, 2, 0]])
    bar = sp.TetMesh(x, bar.nodes)
    skin = sp.shapes.sphere_surface(0.09, 0.06)
    bodies = [
        sp.Body("cube", sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1)), JELLY, position=(0, 1, 0)),
        sp.Body("bar", bar, JELLY, skin=skin),
    ]
    scene = sp.Scene(bodies, pins=[sp.Pin("bar", np.flatnonzero(x[:, 0] < -0.28))])
    path = tmp_path_factory.mktemp("quadratic") / "recording.vtkhdf"
    frames = list(sp.simulate(scene, sp.Implicit(), 0.02, 4, sinks=[sp.Recorder(path)]))
    return path, frames, bar


def test_cells_are_those_of_vtk(made):
    path, _, bar = made
    m = len(bar.tets)
    with h5py.File(path) as file:
        grid = file["VTKHDF"]
        assert grid["Types"][:].tolist() == [10] * 6 + [24] * m
        ends = np.array([4 * k for k in range(7)] + [24 + 10 * k for k in range(1, m + 1)])
        np.testing.assert_array_equal(grid["Offsets"][:], ends)
        assert grid["NumberOfConnectivityIds"][0] == ends[-1] == len(grid["Connectivity"])
        np.testing.assert_array_equal(grid["Connectivity"][24:].reshape(m, 10), bar.nodes + 8)


def test_readings_are_those_of_the_simulation(made):
    path, frames, bar = made
    with sp.read_recording(path) as recording:
        for frame, read in zip(frames[-2:], recording[-2:], strict=True):
            np.testing.assert_array_equal(read.det_F, frame.det_F)
            for name in ("stress", "von_mises", "energy_density", "first_piola", "principal_stretches"):
                ours, theirs = getattr(frame, name), getattr(read, name)
                np.testing.assert_array_equal(theirs["bar"], ours["bar"])
                np.testing.assert_array_equal(theirs.at_vertices["bar"], ours.at_vertices["bar"])
                assert np.isfinite(ours.at_vertices["bar"]).all()
        density = frame.energy_density
        energy = sum(density[body.name] @ body.mesh.volumes for body in frame.system.scene.bodies)
        assert energy == pytest.approx(frame.report.elastic_energy, rel=1e-12)
        ratio = bar.transformed().volumes
        moved = sp.TetMesh(frame.positions["bar"], bar.nodes).volumes
        np.testing.assert_allclose(frame.det_F[6:], moved / ratio, rtol=1e-12)


def test_the_skin_follows_the_curved_tets(made):
    path, _, bar = made
    with sp.read_recording(path) as recording:
        body = recording.body("bar")
        assert body.skin.corners.shape[1] == 10
        surface = sp.shapes.sphere_surface(0.09, 0.06).compact()
        np.testing.assert_allclose(body.skin.positions(bar.vertices), surface.vertices, atol=1e-9)


def test_exports_have_the_ten_nodes(made, tmp_path):
    path, _, bar = made
    with sp.read_recording(path) as recording:
        export(recording, "vtu", tmp_path / "last.vtu")
        kinds = {block.type: len(block.data) for block in meshio.read(tmp_path / "last.vtu").cells}
        assert kinds == {"tetra": 6, "tetra10": len(bar.tets)}
        export(recording, "vtkhdf", tmp_path / "copy.vtkhdf")
        export(recording, "glb", tmp_path / "scene.glb")
    with sp.read_recording(tmp_path / "copy.vtkhdf") as copy:
        np.testing.assert_array_equal(copy.body("bar").body.mesh.nodes, bar.nodes)
        assert copy.body("cube").body.mesh.nodes.shape == (6, 4)


def test_the_check_passes(made):
    report = check_recording(made[0])
    assert report.ok, str(report)
    assert report["records"].worst < 1e-9


def changed(made, tmp_path, change):
    path = tmp_path / "changed.vtkhdf"
    shutil.copy(made[0], path)
    with h5py.File(path, "r+") as file:
        change(file)
    return path


def test_the_check_finds_a_fold_between_positive_corners(made, tmp_path):
    """A middle node is moved so that J is negative inside an element whose corners make a positive tet."""
    _, frames, bar = made

    def fold(file):
        row = 8 + int(bar.nodes[4, 9]) + 3 * len(frames[0].state.positions)
        x = file["VTKHDF/Points"]
        x[row] = x[row] + np.array([0.0, 0.12, 0.0])

    report = check_recording(changed(made, tmp_path, fold))
    failed = {result.name for result in report.failures}
    assert {"inversion", "records"} <= failed
    with sp.read_recording(tmp_path / "changed.vtkhdf") as recording:
        x = recording[3].state.positions
        edges = x[recording.tets][:, 1:] - x[recording.tets][:, :1]
        assert (np.linalg.det(edges) > 0.0).all()


@pytest.mark.parametrize(
    ("name", "change", "expected"),
    [
        ("tets", lambda nodes: nodes + 1000, "but vertex indices run from 0 to"),
        ("tets", lambda nodes: nodes[:, [0, 1, 2, 3, 5, 4, 6, 7, 8, 9]], "node"),
        ("tets", lambda nodes: nodes[:, [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]], "are inverted at rest"),
    ],
)
def test_contradictory_nodes_are_refused(made, tmp_path, name, change, expected):
    def contradict(file):
        data = file[f"supple/scene/bodies/1/mesh/{name}"]
        data[...] = change(data[...])

    with pytest.raises(OutputError, match=expected):
        sp.read_recording(changed(made, tmp_path, contradict))
