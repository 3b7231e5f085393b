"""Shells are drawn with both sides, half their thickness away from their points, and with rims, and rods as tubes."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import supple as sp
from supple.mesh.closed_surfaces import is_closed
from supple.results.page.described import described_scene
from supple.results.page.packed import Packer
from supple.results.view.beside import sheet, tubes
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.results.view.normals import vertex_normals
from supple.results.view.occlusion import occlusion
from supple.results.view.surfaces import body_surface, has_fields, split_at_creases, surfaces_of

T = 5e-3
MATERIAL = sp.ShellMaterial(youngs=1e5, poisson=0.3, thickness=T)
RADIUS = 0.2


@pytest.fixture
def recording(tmp_path):
    """A sheet that is flat at rest and starts as a quarter of a pipe, a ball of a shell, and a soft cube."""
    surface = sp.shapes.sheet(0.3, 0.2, 0.02)
    flat = surface.vertices
    bent = np.column_stack([RADIUS * np.sin(flat[:, 0] / RADIUS), RADIUS * np.cos(flat[:, 0] / RADIUS), flat[:, 2]])
    bodies = [
        sp.Shell("sheet", surface, MATERIAL),
        sp.Shell("ball", sp.shapes.sphere_surface(0.1, 0.02), MATERIAL, position=(1.0, 0.0, 0.0)),
        sp.Body(
            "cube",
            sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)),
            sp.NeoHookean(youngs=1e5, poisson=0.3),
            position=(2.0, 0.0, 0.0),
        ),
    ]
    path = tmp_path / "shells.vtkhdf"
    scene, solver = sp.Scene(bodies, gravity=(0, 0, 0)), sp.Implicit(contact=None)
    sink = sp.Recorder(path, fields=["von_mises"])
    list(sp.simulate(scene, solver, 1e-9, 1, initial_positions={"sheet": bent}, sinks=[sink]))
    with sp.read_recording(path) as opened:
        yield opened


def test_a_shell_is_a_closed_surface_of_its_thickness(recording):
    model = model_of_recording(recording)
    frame = render_frame_of(model, recording[0])
    bent, ball, cube = (body_surface(model, body) for body in model.bodies)
    for surface, volume in ((bent, 0.3 * 0.2 * T), (ball, 4.0 * np.pi * 0.1**2 * T)):
        assert is_closed(surface.triangles)
        assert surface.hides_its_backs(model)
        assert sp.SurfaceMesh(surface.at(frame), surface.triangles).volume == pytest.approx(volume, rel=0.02)
    assert len(ball.triangles) == 2 * len(recording.bodies[1].boundary)  # it has no rim
    away = np.hypot(*bent.at(frame)[:, :2].T) - RADIUS
    np.testing.assert_allclose(np.abs(away), 0.5 * T, rtol=1e-2)
    assert cube.layers == 1
    assert bent.layers == 2


def test_rims_stay_sharp(recording):
    model = model_of_recording(recording)
    frame, surface = render_frame_of(model, recording[0]), body_surface(model, model.bodies[0])
    creased = surface.creased(model)
    assert len(creased.at(frame)) > len(surface.at(frame))
    x = creased.at(frame)
    normals = vertex_normals(x, creased.triangles)
    radial = x[:, :2] / np.hypot(*x[:, :2].T)[:, None]
    along = np.abs(np.einsum("ij,ij->i", normals[:, :2], radial))
    assert np.all((along > 0.99) | (along < 0.1))  # of a side, or of a rim


def test_branches_and_borders_that_touch_are_closed_too():
    # Two triangles that share one vertex, where two borders meet.
    triangles = np.array([[0, 1, 2], [0, 3, 4]], dtype=np.int32)
    rows, closed, beside = sheet(triangles, T)
    assert is_closed(closed)
    assert rows.tolist() == [0, 1, 2, 3, 4, 0, 1, 2, 3, 4]
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=np.float64)
    np.testing.assert_allclose(beside.offsets(x, rows)[:, 2], np.repeat([0.5 * T, -0.5 * T], 5))


def test_both_sides_of_a_sheet_count_once_where_light_is_kept_off():
    surface = sp.shapes.sheet(1.0, 1.0, 0.05)
    rows, closed, beside = sheet(surface.triangles, 1e-3)
    x = surface.vertices[rows] + beside.offsets(surface.vertices, rows)
    drawn = [(x, closed, vertex_normals(x, closed))]
    middle, triangles = surface.vertices, surface.triangles
    alone = occlusion([(middle, triangles, vertex_normals(middle, triangles))], 1, [1])[0]
    np.testing.assert_allclose(occlusion(drawn, 1, [2])[0][: len(alone)], alone, atol=0.05)
    assert occlusion(drawn, 1, [1])[0][: len(alone)].mean() > alone.mean() + 0.1


def test_files_of_other_programs_have_the_thickness(recording, tmp_path):
    text = (recording.export("obj", tmp_path / "shells") / "frame_00000.obj").read_text(encoding="utf-8")
    own = text.split("\no ")[1].splitlines()
    x = np.array([line.split()[1:] for line in own if line.startswith("v ")], dtype=np.float64)
    assert np.ptp(np.hypot(x[:, 0], x[:, 1])) == pytest.approx(T, rel=0.02)
    glb = recording.export("glb", tmp_path / "shells.glb").read_bytes()
    document = json.loads(glb[20 : 20 + int.from_bytes(glb[12:16], "little")])
    places = [document["accessors"][mesh["primitives"][0]["attributes"]["POSITION"]] for mesh in document["meshes"]]
    assert places[0]["max"][1] == pytest.approx(RADIUS + 0.5 * T, abs=0.1 * T)
    assert not any("doubleSided" in material for material in document["materials"])


def test_a_page_gets_what_it_needs_to_draw_both_sides(recording):
    model, packer = model_of_recording(recording), Packer()
    bent, _, cube = described_scene(model, packer)["bodies"]
    assert cube["beside"] is None
    assert bent["beside"]["axes"] == "normals"
    assert bent["beside"]["cells"]["count"] == 3 * len(recording.bodies[0].boundary)
    assert bent["beside"]["away"]["count"] == bent["corners"]["count"]
    assert bent["closed"]
    assert cube["closed"]  # its edges are sharp: vertices are there once for each side


def test_paraview_sees_shells_as_triangles_beside_tets(recording, tmp_path, tools):
    vtk, to_numpy = tools.vtk()
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(recording.path))
    reader.UpdateInformation()
    reader.SetStep(1)
    reader.Update()
    grid = reader.GetOutput()
    counts = [len(body.boundary) for body in recording.bodies[:2]]
    assert grid.GetNumberOfCells() == 48 + sum(counts)
    assert [grid.GetCellType(k) for k in (0, 47, 48)] == [vtk.VTK_TETRA, vtk.VTK_TETRA, vtk.VTK_TRIANGLE]
    ratios = to_numpy(grid.GetCellData().GetArray("det_F"))
    np.testing.assert_allclose(ratios, 1.0, atol=3e-3)  # triangles of a pipe are chords
    assert np.abs(ratios[48 : 48 + counts[0]] - 1.0).max() > 1e-4
    np.testing.assert_array_equal(to_numpy(grid.GetCellData().GetArray("body")), np.repeat([2, 0, 1], [48, *counts]))
    corners = to_numpy(grid.GetCells().GetConnectivityArray())[4 * 48 :].reshape(-1, 3)
    np.testing.assert_array_equal(corners[: counts[0]], recording.bodies[0].boundary)
    stresses = to_numpy(grid.GetCellData().GetArray("von_mises"))
    assert np.isfinite(stresses[:48]).all()
    assert recording[1].field("von_mises")["cube"].shape == (48,)
    assert recording[1].det_F.shape == (48,)
    assert sp.check_recording(recording.path).ok
    recording.export("glb", tmp_path / "fields.glb")
    recording.export("vtu", tmp_path / "last.vtu")


def test_what_shows_a_field_has_tets(recording):
    model = model_of_recording(recording)
    assert [has_fields(surface) for surface in surfaces_of(model)] == [False, False, True]


def test_a_rod_is_tubes_about_its_edges_that_turn_with_it():
    material = sp.RodMaterial(youngs=1e6, radius=0.01)
    rod = sp.Rod("rod", [[0, 0, 0], [0.1, 0, 0], [0.2, 0.1, 0]], material)
    edges = np.hstack([rod.mesh.line, rod.mesh.material_points])
    rows, triangles, beside = tubes(edges, 0.01)
    R = Rotation.from_rotvec([0.3, 2.0, -1.0]).as_matrix()
    for turn in (np.eye(3), R):
        x = rod.points @ turn.T
        drawn = x[rows] + beside.offsets(x, rows)
        a, b = x[rod.mesh.line[np.repeat([0, 1], len(rows) // 2)]].swapaxes(0, 1)
        share = np.clip(np.einsum("ki,ki->k", drawn - a, b - a) / np.einsum("ki,ki->k", b - a, b - a), 0.0, 1.0)
        np.testing.assert_allclose(np.linalg.norm(drawn - a - share[:, None] * (b - a), axis=1), 0.01, rtol=1e-9)
        assert is_closed(triangles)
        volume = np.pi * 1e-4 * rod.lengths.sum() + 2.0 * 4.0 / 3.0 * np.pi * 1e-6
        assert sp.SurfaceMesh(drawn, triangles).volume == pytest.approx(volume, rel=0.08)
    assert len(split_at_creases(drawn, triangles)[0]) == len(rows)


def test_paraview_sees_rods_as_lines_with_their_stretches(tmp_path, tools):
    rod = sp.Rod("rod", [[0, 0, 0], [0.1, 0, 0], [0.2, 0.1, 0]], sp.RodMaterial(youngs=1e6, radius=0.01))
    cloth = sp.Shell("cloth", sp.shapes.sheet(0.2, 0.2, 0.1), MATERIAL, position=(0.0, -1.0, 0.0))
    x = 1.5 * rod.points
    sink = sp.Recorder(tmp_path / "rod.vtkhdf")
    scene, solver = sp.Scene([rod, cloth], gravity=(0, 0, 0)), sp.Implicit(contact=None)
    list(sp.simulate(scene, solver, 1e-9, 1, initial_positions={"rod": x}, sinks=[sink]))
    vtk, to_numpy = tools.vtk()
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(tmp_path / "rod.vtkhdf"))
    reader.UpdateInformation()
    reader.Update()
    grid = reader.GetOutput()
    kinds = [grid.GetCellType(k) for k in range(grid.GetNumberOfCells())]
    assert kinds == 2 * [vtk.VTK_LINE] + 8 * [vtk.VTK_TRIANGLE]
    np.testing.assert_allclose(to_numpy(grid.GetCellData().GetArray("det_F")), 2 * [1.5] + 8 * [1.0], rtol=1e-6)
    last = sp.read_recording(tmp_path / "rod.vtkhdf").export("vtu", tmp_path / "last.vtu")
    meshio = pytest.importorskip("meshio")
    mesh = meshio.read(last)
    assert {block.type: len(block.data) for block in mesh.cells} == {"line": 2, "triangle": 8}
    ratios = dict(zip([block.type for block in mesh.cells], mesh.cell_data["det_F"], strict=True))
    np.testing.assert_allclose(ratios["line"], 1.5, rtol=1e-6)
