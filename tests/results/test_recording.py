"""Recordings: all numbers read back equal, and VTK reads them."""

import h5py
import numpy as np
import pytest

import supple as sp
from supple.errors import OutputError
from supple.kinds.kind import declared
from supple.model.state import Status
from supple.results.recording import recorder as recording_module
from supple.results.recording.reader import read_recording
from supple.results.recording.recorder import Recorder
from supple.simulate import simulate


def test_frames_and_reports_read_back_equal(recorded, recording):
    _, frames = recorded
    assert len(recording) == len(recording.frames) == len(frames) + 1
    np.testing.assert_allclose(recording.times, np.arange(25) / 30, atol=1e-12)
    for recorded_frame, frame in zip(recording[1:], frames, strict=True):
        assert recorded_frame.index == frame.index
        assert recorded_frame.time == frame.time
        for name in ("cube", "slab"):
            np.testing.assert_array_equal(recorded_frame.positions[name], frame.positions[name])
            np.testing.assert_array_equal(recorded_frame.velocities[name], frame.velocities[name])
        np.testing.assert_array_equal(recorded_frame.det_F, frame.det_F)
        for key, value in vars(frame.report).items():
            np.testing.assert_array_equal(getattr(recorded_frame.report, key), value, err_msg=key)
        for pose, obstacle in zip(recorded_frame.obstacle_poses, frame.system.obstacles, strict=True):
            np.testing.assert_array_equal(pose[:, :3], obstacle.pose(frame.time)[0])
            np.testing.assert_array_equal(pose[:, 3], obstacle.pose(frame.time)[1])
    start = recording[0]
    assert start.time == 0.0
    assert start.report.min_distance is None
    np.testing.assert_array_equal(start.positions["cube"][0], [0.0, 1.0, 0.0])


def test_the_scene_reads_back_equal(recorded, recording):
    system = recorded[1][0].system
    np.testing.assert_array_equal(recording.rest_positions, system.rest_positions)
    np.testing.assert_array_equal(recording.masses, system.masses)
    np.testing.assert_array_equal(recording.tets, system.tets)
    np.testing.assert_array_equal(recording.rest_volumes, system.rest_volumes)
    np.testing.assert_array_equal(recording.gravity, [0.0, -9.81, 0.0])
    assert [(b.name, b.vertices, b.tets) for b in recording.bodies] == [
        (b.name, b.vertices, b.tets) for b in system.bodies
    ]
    cube, slab = recording.bodies
    np.testing.assert_array_equal(slab.boundary, system.bodies[1].body.mesh.surface.triangles)
    assert cube.body.material.youngs == 1e4
    assert slab.skin is None
    skin = system.bodies[0].body.skin
    np.testing.assert_allclose(cube.skin.positions(recording.rest_positions[cube.vertices]), skin.vertices, atol=1e-12)
    assert [type(o).__name__ for o in recording.obstacles] == ["HalfSpace", "Sphere", "Box", "TriangleObstacle"]
    assert recording.scene_text == "bodies: []\n"
    assert recording.solver == "Prescribed()"
    assert recording.supple_version == sp.__version__
    assert recording.dt == pytest.approx(1 / 30)


def test_the_solver_of_the_simulation_is_recorded(tmp_path, tools):
    path, solver = tmp_path / "r.vtkhdf", tools.Prescribed()
    list(simulate(tools.small_scene(), solver, 1 / 30, 1, sinks=[Recorder(path)]))
    with sp.read_recording(path) as recording:
        assert recording.solver == str(solver)


def test_every_kind_of_obstacle_reads_back_equal(tmp_path, tools):
    obstacles = [
        sp.HalfSpace(name="floor", point=(0.1, -1, 0), normal=(0.1, 1, 0.2), friction=0.3),
        sp.obstacles.Box(center=(9, 0, 0), size=(1, 2, 3), rotation=(0.3, -0.2, 0.1)),
        sp.obstacles.Box(size=(99, 99, 99), inside=True),
        sp.obstacles.Sphere(center=(0, 9, 0), radius=0.3),
        sp.obstacles.Capsule(start=(0, 0, 9), end=(0.1, 0.2, 9.3), radius=0.2),
        sp.obstacles.Cylinder(start=(0, 0, -9), end=(1, 0.2, -9), radius=0.7, friction=0.1),
        sp.obstacles.TriangleObstacle(surface=tools.octahedron(0.2, (2.0, 2.0, 9.5))),
    ]
    scene = sp.Scene([sp.Body("cube", tools.box(), sp.EdgesAndVolume(density=1000.0))], obstacles)
    path = tmp_path / "kinds.vtkhdf"
    list(simulate(scene, tools.Prescribed(), 1 / 30, 1, sinks=[Recorder(path)]))
    with read_recording(path) as recording:
        found = recording.obstacles
    for one, other in zip(found, scene.obstacles, strict=True):
        assert type(one) is type(other)
        assert (one.name, one.summary()) == (other.name, other.summary())
        for field in declared(type(one)):
            if field not in ("surface", "motion", "name"):
                np.testing.assert_array_equal(getattr(one, field), getattr(other, field))
    np.testing.assert_array_equal(found[-1].triangles()[0], obstacles[-1].triangles()[0])


def test_a_simulation_starts_from_a_recorded_frame(recording, tools):
    state = recording[10].state
    frame = next(iter(simulate(tools.small_scene(), tools.Prescribed(), 1 / 30, 1, start=state)))
    np.testing.assert_allclose(frame.positions["cube"], recording[11].positions["cube"], atol=1e-12)


def test_vtk_reads_every_step(recorded, tools):
    path, frames = recorded
    vtk, to_numpy = tools.vtk()
    reader = vtk.vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 25
    times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    np.testing.assert_allclose(times, np.arange(25) / 30, atol=1e-12)
    for frame in (frames[0], frames[7], frames[23]):
        reader.SetStep(frame.index)
        reader.Update()
        grid = reader.GetOutput()
        assert grid.GetClassName() == "vtkUnstructuredGrid"
        np.testing.assert_array_equal(to_numpy(grid.GetPoints().GetData()), frame.state.positions)
        np.testing.assert_array_equal(to_numpy(grid.GetPointData().GetArray("velocities")), frame.state.velocities)
        np.testing.assert_array_equal(to_numpy(grid.GetCellData().GetArray("det_F")), frame.det_F)
        cells = to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4)
        np.testing.assert_array_equal(cells, frame.system.tets)
        bodies = to_numpy(grid.GetCellData().GetArray("body"))
        assert np.count_nonzero(bodies == 1) == len(frame.system.bodies[1].body.mesh.tets)
        assert grid.GetCellType(0) == vtk.VTK_TETRA


def test_a_recording_is_readable_while_it_is_written(tmp_path, tools):
    """VTK, which has no count of complete frames, reads the first frame until the simulation ends."""
    path = tmp_path / "live.vtkhdf"
    vtk, _ = tools.vtk()
    first = None
    for frame in simulate(tools.small_scene(), tools.Prescribed(), 1 / 30, 5, sinks=[Recorder(path)]):
        with read_recording(path) as live:
            assert len(live) == frame.index + 1
            np.testing.assert_array_equal(live[-1].positions["slab"], frame.positions["slab"])
            first = live[0].state.positions[0]
        reader = vtk.vtkHDFReader()
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        assert reader.GetNumberOfSteps() == 1
        reader.Update()
        assert reader.GetOutput().GetPoint(0) == tuple(first)
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 6


def test_a_simulation_that_stops_early_leaves_no_unused_room(tmp_path, tools):
    path = tmp_path / "blocked.vtkhdf"
    solver = tools.Prescribed(stop_at=3, message="vertex 7 is held — «wall»")
    assert len(tools.record(path, 500, moved_by=solver)) == 3
    with read_recording(path) as recording:
        assert len(recording) == 4
        assert recording[-1].report.status == Status.BLOCKED
        assert recording[-1].report.message == "vertex 7 is held — «wall»"
    with h5py.File(path) as file:
        assert file["VTKHDF/Steps"].attrs["NSteps"] == 4
        assert len(file["VTKHDF/Steps/Values"]) == 4
        assert len(file["VTKHDF/Points"]) == 4 * int(file["VTKHDF/NumberOfPoints"][0])
    assert [p.name for p in tmp_path.iterdir()] == ["blocked.vtkhdf"]


@pytest.mark.parametrize("message", ["", "x" * 512])
def test_room_grows_when_it_is_used_up(tmp_path, tools, monkeypatch, message):
    monkeypatch.setattr(recording_module, "_FIRST_FRAMES", 2)
    path = tmp_path / "grown.vtkhdf"
    frames = tools.record(path, 9, moved_by=tools.Prescribed(message=message))
    with read_recording(path) as recording:
        assert len(recording) == 10
        for recorded, frame in zip(recording[1:], frames, strict=True):
            np.testing.assert_array_equal(recorded.positions["cube"], frame.positions["cube"])
            assert recorded.report.message == message
            assert recorded.report.details == frame.report.details
    assert [p.name for p in tmp_path.iterdir()] == ["grown.vtkhdf"]


def test_a_long_message_is_cut(tmp_path, tools):
    tools.record(tmp_path / "long.vtkhdf", 2, moved_by=tools.Prescribed(message="é" * 300))
    with read_recording(tmp_path / "long.vtkhdf") as recording:
        assert recording[1].report.message == "é" * 254 + "…"


def test_compressed_recordings_are_smaller_and_equal(tmp_path, tools, recorded):
    path = tmp_path / "small.vtkhdf"
    frames = tools.record(path, 24, compress=True)
    assert path.stat().st_size < recorded[0].stat().st_size
    with read_recording(path) as recording:
        np.testing.assert_array_equal(recording[24].positions["slab"], frames[-1].positions["slab"])
        np.testing.assert_array_equal(recording[24].det_F, frames[-1].det_F)
    vtk, to_numpy = tools.vtk()
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.SetStep(24)
    reader.Update()
    np.testing.assert_array_equal(to_numpy(reader.GetOutput().GetPoints().GetData()), frames[-1].state.positions)


def test_a_recording_of_no_steps_has_the_start(tmp_path, tools):
    tools.record(tmp_path / "start.vtkhdf", 0)
    with read_recording(tmp_path / "start.vtkhdf") as recording:
        assert len(recording) == 1


def test_the_same_recorder_replaces_an_older_recording(tmp_path, tools):
    path = tmp_path / "again.vtkhdf"
    tools.record(path, 6)
    tools.record(path, 2)
    with read_recording(path) as recording:
        assert len(recording) == 3


def test_unusable_paths_are_errors(tmp_path, tools):
    (tmp_path / "file").write_text("x")
    (tmp_path / "folder.vtkhdf").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        Recorder(tmp_path / "folder.vtkhdf")
    with pytest.raises(OutputError, match=r"name it recording\.vtkhdf"):
        Recorder(tmp_path / "recording")
    with pytest.raises(OutputError, match=r"file: is not a folder, and must be one"):
        tools.record(tmp_path / "file" / "recording.vtkhdf", 1)
    assert (tmp_path / "file").read_text() == "x"


def test_write_before_begin_is_an_error(tmp_path, recorded):
    with pytest.raises(OutputError, match="before begin"):
        Recorder(tmp_path / "r.vtkhdf").write(recorded[1][0])
