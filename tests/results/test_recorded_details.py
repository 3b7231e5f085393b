"""The solver's details in a recording: typed, of fixed size for each frame, and equal when they are read."""

from dataclasses import dataclass, fields, replace

import h5py
import numpy as np
import pytest
from tests.recordings import set_in_scene

import supple as sp
from supple.errors import OutputError
from supple.model.state import SolverDetails
from supple.results.recording import recorder as recording_module
from supple.results.recording.reader import read_recording
from supple.solvers.implicit.details import ImplicitDetails
from supple.solvers.xpbd.details import XPBDDetails

RUBBER = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)


def touching_scene() -> sp.Scene:
    """A pinned cube, and a free one that falls on a floor and a table."""
    mesh = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    return sp.Scene(
        bodies=[
            sp.Body("held", mesh, RUBBER, position=(0.5, 0.3, 0.0)),
            sp.Body("falling", mesh, RUBBER, position=(0.0, 0.06, 0.0), velocity=(2.0, -0.5, 0.0)),
        ],
        obstacles=[
            sp.HalfSpace(friction=0.5),
            sp.obstacles.Box(name="table", center=(0.2, 0.05, 0.0), size=(0.2, 0.1, 0.2), friction=0.3),
        ],
        pins=[sp.Pin("held", [0, 1], name="nail"), sp.Pin("held", [2])],
    )


@pytest.mark.parametrize("solver", [sp.Implicit(), sp.Implicit(contact=None), sp.XPBD(substeps=4)])
def test_details_of_a_real_run_read_back_equal(tmp_path, monkeypatch, solver):
    """The file has room for fewer frames at first, so that it is copied to larger ones."""
    monkeypatch.setattr(recording_module, "_FIRST_FRAMES", 8)
    scene = touching_scene()
    if getattr(solver, "contact", 0) is None:
        scene = replace(scene, obstacles=())
    path = tmp_path / "run.vtkhdf"
    frames = list(sp.simulate(scene, solver, 1 / 60, 60, sinks=[sp.Recorder(path)]))
    if solver == sp.Implicit():
        assert max(frame.report.details.contacts for frame in frames) > 0
        assert any(np.abs(frame.report.details.friction_forces["table"]).max() > 0 for frame in frames)
        assert all(len(frame.report.details.newton) > 0 for frame in frames)
    with read_recording(path) as recording:
        assert len(recording) == 61
        for recorded, frame in zip(recording[1:], frames, strict=True):
            assert recorded.report.details == frame.report.details
            assert type(recorded.report.details) is type(frame.report.details)
            assert recorded.report.min_distance == frame.report.min_distance
            for field in fields(frame.report.details):
                if field.compare:
                    kept, original = (getattr(d, field.name) for d in (recorded.report.details, frame.report.details))
                    assert type(kept) is type(original), field.name
        start = recording[0].report.details
        assert start.contacts == 0
        if solver == sp.Implicit():
            assert start.contact_forces.keys() == frames[0].report.details.contact_forces.keys()
            assert set(start.reaction_forces) == {
                "pin 'nail' of body 'held'",
                *frames[0].report.details.reaction_forces,
            }


def test_a_recording_grows_only_with_its_frames(tmp_path):
    """The size of a frame does not depend on the number of iterations."""
    path = tmp_path / "run.vtkhdf"
    scene = touching_scene()
    sizes = {}
    for steps in (20, 40):
        list(sp.simulate(scene, sp.Implicit(), 1 / 60, steps, sinks=[sp.Recorder(path)]))
        sizes[steps] = path.stat().st_size
    points, tets = 16, 12
    driven = 7 * (len(scene.obstacles) + len(scene.pins))
    numbers = 3 * (3 + 3 + 2) + 62 + driven  # vectors by name, and single numbers of a report
    assert sizes[40] - sizes[20] <= 20 * 8 * (6 * points + tets + 12 * 2 + numbers + recording_module.MESSAGE_BYTES / 8)


def test_details_with_equal_recorded_fields_are_equal():
    details = ImplicitDetails(contacts=3, dhat=0.1, contact_forces={"a": np.ones(3)}, newton=("row",))
    assert details == replace(details, newton=(), reaction_forces_by_vertex={"pin": np.ones((2, 3))})
    assert details == replace(details, contact_forces={"a": np.ones(3)})
    for change in ({"contacts": 4}, {"dhat": None}, {"contact_forces": {"a": np.zeros(3)}}, {"contact_forces": {}}):
        assert details != replace(details, **change)
    assert SolverDetails(3) != XPBDDetails(3)


@dataclass(frozen=True, eq=False)
class ForeignDetails(XPBDDetails):
    temperature: float = 20.0


def test_details_of_an_unknown_class_are_recorded_as_those_of_the_known_base(tmp_path, tools):
    @dataclass(frozen=True)
    class Foreign(tools.Prescribed):
        def initial_details(self, system, workspace):
            return ForeignDetails()

        def step(self, system, state, dt, workspace):
            state, report = super().step(system, state, dt, workspace)
            return state, replace(report, details=ForeignDetails(7, 0.5, temperature=30.0))

    tools.record(tmp_path / "foreign.vtkhdf", 2, moved_by=Foreign())
    with read_recording(tmp_path / "foreign.vtkhdf") as recording:
        assert recording[-1].report.details == XPBDDetails(7, 0.5)


DAMAGES = {
    "unknown kind": ("details/kind", "os.system", "fields that are not known here"),
    "no fields": ("details/fields", 3, "details/fields is not the tuple"),
    "unknown field": ("details/fields/0/name", "colour", "fields that are not known here"),
    "unknown type": ("details/fields/0/dtype", "O", "dtype is 'O', not one of"),
    "no mapping": ("details", 3, "details is '3', not of the type RecordedDetails"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_description_is_one_line(tmp_path, tools, damage):
    path = tmp_path / "r.vtkhdf"
    tools.record(path, 1)
    where, value, text = DAMAGES[damage]
    with h5py.File(path, "r+") as file:
        set_in_scene(file, where, value)
    with pytest.raises(OutputError, match=text):
        read_recording(path)
