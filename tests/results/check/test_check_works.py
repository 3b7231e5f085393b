"""Works of pins, loads and contact that the check computes anew."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tests.recordings import set_in_scene

import supple as sp
from supple.results.check.checks.works import Works
from supple.results.check.recorded import RecordedTrajectory
from supple.results.check.settings import CheckSettings

RUBBER = sp.StableNeoHookean(youngs=2e4, poisson=0.4, damping=0.02)


def recorded(path, scene, solver, dt, steps, fields=()):
    for _ in sp.simulate(scene, solver, dt, steps, sinks=[sp.Recorder(path, solver=solver, fields=fields)]):
        pass
    return path


@pytest.fixture(scope="module", params=[sp.Implicit(), sp.XPBD(substeps=20)], ids=["implicit", "xpbd"])
def dragged(request, tmp_path_factory):
    """A block that its upper side presses on a rough floor and drags along it."""
    way = sp.Keyframes(times=[0.0, 0.05, 0.2], displacements=[[0, 0, 0], [0, -0.01, 0], [0.2, -0.01, 0]])
    block = sp.Body("block", sp.shapes.box((0.2, 0.1, 0.1), (4, 2, 2)), RUBBER, position=(0, 0.0505, 0))
    pin = sp.Pin("block", sp.InBox((-1, 0.1, -1), (1, 1, 1)), motion=way)
    scene = sp.Scene([block], [sp.HalfSpace(friction=0.5, name="floor")], pins=[pin])
    path = tmp_path_factory.mktemp("works") / "dragged.vtkhdf"
    return recorded(path, scene, request.param, 1 / 60, 12, ["contact_force"])


def checked(path, **options):
    return sp.check_recording(path, only=["balance", "works"], **options)


@pytest.mark.parametrize("name", ["pins", "friction"])
def test_a_work_that_was_changed_together_with_the_numerical_one(dragged, corrupted, name):
    with sp.read_recording(dragged) as recording:
        (names,) = (field.keys for field in recording.details.fields if field.name == "work")
    assert names is not None

    def shift(file, n):
        works = file["supple/frames/details/work"][:]
        works[:, names.index("numerical")] -= works[:, names.index(name)]
        works[:, names.index(name)] *= 2.0
        file["supple/frames/details/work"][:] = works

    report = checked(corrupted(dragged, shift))
    assert [result.name for result in report.failures] == ["works"]
    assert f"work of {'pins' if name == 'pins' else 'contact'}" in report["works"].message


@pytest.mark.parametrize("order", [1, 2])
def test_pins_that_work_against_the_barrier_against_inversion(tmp_path, order):
    """A bar is pressed to a twentieth of its length; no energy of a frame contains the barrier's."""
    soft = sp.StableNeoHookean(youngs=5e3, poisson=0.0)
    bar = sp.Body("bar", sp.shapes.box((0.2, 0.1, 0.1), (2, 1, 1), order=order), soft)
    way = sp.Keyframes(times=[0.0, 0.1], displacements=[[0, 0, 0], [-0.19, 0, 0]])
    ends = [sp.InBox((x - 0.001, -1, -1), (x + 0.001, 1, 1)) for x in (-0.1, 0.1)]
    pins = [sp.Pin("bar", ends[0]), sp.Pin("bar", ends[1], motion=way)]
    scene = sp.Scene([bar], pins=pins, gravity=(0, 0, 0))
    path = recorded(tmp_path / "pressed.vtkhdf", scene, sp.Implicit(), 1 / 60, 6)
    with sp.read_recording(path) as recording:
        assert recording[-1].det_F.min() < 0.1
        assert checked(path).ok


@pytest.mark.parametrize("share", [0.1, 0.9])
def test_a_body_that_hits_the_floor_early_or_late_in_a_frame(tmp_path, corrupted, share):
    """Late, its mean velocity is almost that before: contact, which stops it, does less work than on the whole way."""
    box = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
    body = sp.Body("box", box, sp.EdgesAndVolume(), position=(0, 0.0505 + share * 2 / 60, 0), velocity=(0, -2, 0))
    scene = sp.Scene([body], [sp.HalfSpace()], gravity=(0, 0, 0))
    path = recorded(tmp_path / "hit.vtkhdf", scene, sp.XPBD(substeps=20), 1 / 60, 2, ["contact_force"])
    assert checked(path).ok
    report = checked(with_more_work(path, corrupted, "contact", 20.0))
    assert "work of contact" in report["works"].message


def test_works_need_every_frame(dragged):
    assert checked(dragged).ok
    assert checked(dragged, every=2)["works"].message == "works are computed from one frame to the next only"


def test_a_recording_without_pins_and_contact_forces(free):
    message = checked(free)["works"].message
    assert message.startswith("pins: nothing is pinned; contact: forces on vertices were not recorded")


def test_the_work_of_pins_is_of_second_order(tmp_path):
    """Pins that stretch a bar slowly do the work that it stores."""
    bar = sp.Body("bar", sp.shapes.box((0.2, 0.1, 0.1), (2, 1, 1)), sp.NeoHookean(youngs=2e4, poisson=0.3))
    pull = sp.Keyframes(times=[0, 1], displacements=[[0, 0, 0], [0.1, 0, 0]])
    held = sp.Pin("bar", sp.InBox((-1, -1, -1), (-0.099, 1, 1)))
    moved = sp.Pin("bar", sp.InBox((0.099, -1, -1), (1, 1, 1)), motion=pull)
    scene = sp.Scene([bar], pins=[held, moved], gravity=(0, 0, 0))
    errors = []
    for steps in (3, 6):
        solver = sp.Implicit(integrator="static")
        path = recorded(tmp_path / f"{steps}.vtkhdf", scene, solver, 1.0 / steps, steps)
        with sp.read_recording(path) as recording:
            check = Works(RecordedTrajectory(recording), CheckSettings())
            frames = [check.of.snapshot(k) for k in range(len(recording))]
            for frame in frames:
                check.add(frame)
            work = sum(found[0][0] for found in check.frames)
            stored = [frame.elastic_energy or 0.0 for frame in frames]
            errors.append(abs(work / (stored[-1] - stored[0]) - 1.0))
    assert errors[0] < 0.02
    assert errors[1] == pytest.approx(errors[0] / 4.0, rel=0.2)


def loaded_scene(order=1):
    """A bar on a moving pin, with a load of every kind whose work is computed anew; two of them act on the pin, too."""
    mesh = sp.shapes.box((0.3, 0.1, 0.1), (4, 2, 2), order=order)
    bar = sp.Body("bar", mesh, RUBBER)
    loads = [
        sp.Traction("bar", lambda t: (0, -300 * np.sin(8 * t), 100)),
        sp.Pressure("bar", sp.Curve([0.0, 0.3], [0.0, 2e3]), sp.InBox((0.149, -1, -1), (1, 1, 1))),
        sp.BodyForce((0, 0, 3)),
        sp.Spring(("bar", (0.1, 0, 0)), (None, (0.3, 0.1, 0.1)), stiffness=20.0, rest_length=lambda t: 0.1 + t),
    ]
    pin = sp.Pin("bar", sp.InBox((-1, -1, -1), (-0.149, 1, 1)), motion=lambda t: (0, 0.02 * np.sin(9 * t), 0))
    return sp.Scene([bar], pins=[pin], loads=loads)


LOADS = ["body_forces", "pressures", "springs", "tractions"]


@pytest.fixture(scope="module", params=["implicit", "quadratic", "xpbd"])
def loaded(request, tmp_path_factory):
    solver = sp.XPBD(substeps=20) if request.param == "xpbd" else sp.Implicit()
    scene = loaded_scene(2 if request.param == "quadratic" else 1)
    return recorded(tmp_path_factory.mktemp("works") / "loaded.vtkhdf", scene, solver, 1 / 120, 24)


def driven_scene():
    """A hollow cube on a moving pin, with a cavity, a cable with friction, a muscle and a force."""
    cube = sp.shapes.box((0.12, 0.12, 0.12), (3, 3, 3))
    middle = np.abs(cube.vertices[cube.tets].mean(axis=1)).max(axis=1) < 0.02
    mesh = sp.TetMesh(cube.vertices, cube.tets[~middle])
    loads = [sp.Muscle("cube", 2e3, (0, 1, 0), lambda t: np.sin(9 * t) ** 2, force_length=([0.5, 1.0, 1.5], [0, 1, 0]))]
    points = [("cube", (0.06, y, 0.06)) for y in (-0.06, 0.0)] + [(None, (0.1, 0.15, 0.0))]
    return sp.Scene(
        [sp.Body("cube", mesh, RUBBER)],
        pins=[sp.Pin("cube", sp.InBox((-1, -1, -1), (-0.059, 1, 1)), motion=lambda t: (0, 0.02 * np.sin(9 * t), 0))],
        forces=[sp.Force("cube", sp.InBox((0.059, -1, -1), (1, 1, 1)), lambda t: (0.5 * np.sin(20 * t), 0, 0.3))],
        cavities=[sp.Cavity("cube", pressure=sp.Curve([0.0, 0.2], [0.0, 2e3]))],
        cables=[sp.Cable(points, tension=sp.Curve([0.0, 0.2], [0.0, 1.0]), friction=0.2, name="tendon")],
        loads=loads,
    )


@pytest.fixture(scope="module", params=["implicit", "xpbd"])
def driven(request, tmp_path_factory):
    solver = sp.XPBD(substeps=20, contact=None) if request.param == "xpbd" else sp.Implicit(contact=None)
    return recorded(tmp_path_factory.mktemp("works") / "driven.vtkhdf", driven_scene(), solver, 1 / 120, 24)


def with_more_work(path, corrupted, name, times=0.5):
    """A copy in which the work of a name is half as large again (or more), which is taken from the numerical one."""
    with sp.read_recording(path) as recording:
        (names,) = (field.keys for field in recording.details.fields if field.name == "work")
    assert names is not None

    def shift(file, n):
        works = file["supple/frames/details/work"][:]
        more = times * np.abs(works[:, names.index(name)])
        works[:, names.index("numerical")] -= more
        works[:, names.index(name)] += more
        file["supple/frames/details/work"][:] = works
        for kind, own in (("cavities", "cavity_work"), ("cables", "cable_work")):
            if kind == name:  # otherwise `balance` finds that these no longer add up
                file[f"supple/frames/details/{own}"][:] += more[:, None]

    return corrupted(path, shift)


def test_works_of_loads_agree(loaded):
    report = checked(loaded)
    assert report.ok
    assert report["works"].message.startswith("those of pins, body_forces, pressures, springs and tractions agree")


def test_works_of_what_drives_a_body_agree(driven):
    report = checked(driven)
    assert report.ok
    assert report["works"].message.startswith("those of pins, cables, cavities, forces and muscles agree")


@pytest.mark.parametrize("name", LOADS)
def test_a_changed_work_of_a_load(loaded, corrupted, name):
    report = checked(with_more_work(loaded, corrupted, name))
    assert [result.name for result in report.failures] == ["works"]
    assert f"work of {name}" in report["works"].message


@pytest.mark.parametrize("name", ["cables", "cavities", "forces", "muscles", "pins"])
def test_a_changed_work_of_what_drives_a_body(driven, corrupted, name):
    report = checked(with_more_work(driven, corrupted, name))
    assert [result.name for result in report.failures] == ["works"]
    assert f"work of {name}" in report["works"].message


def test_works_of_loads_converge_to_the_changes_of_their_potentials(tmp_path):
    """-p V of a closed surface, the energy of a spring, and a dead force, along a straight way in 2 and 4 parts."""
    mesh = sp.shapes.box((0.3, 0.1, 0.1), (2, 1, 1))
    ends = mesh.vertices, mesh.vertices + 0.02 * np.random.default_rng(3).normal(size=mesh.vertices.shape)
    loads = [
        sp.Spring(("bar", 4), (None, (-0.3, 0.1, 0.05)), stiffness=30.0, rest_length=0.05),
        sp.Pressure("bar", 4e3),
        sp.Traction("bar", (10.0, 20.0, -30.0)),
    ]
    path = recorded(
        tmp_path / "r.vtkhdf", sp.Scene([sp.Body("bar", mesh, RUBBER)], loads=loads), sp.Implicit(), 0.01, 1
    )
    lengths = [np.linalg.norm(x[4] - [-0.3, 0.1, 0.05]) for x in ends]
    volumes = [sp.TetMesh(x, mesh.tets).volumes.sum() for x in ends]
    corners = mesh.vertices[mesh.surface.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2.0
    moved = (ends[1] - ends[0])[mesh.surface.triangles].mean(axis=1)
    exact = {
        "springs": -15.0 * ((lengths[1] - 0.05) ** 2 - (lengths[0] - 0.05) ** 2),
        "pressures": -4e3 * (volumes[1] - volumes[0]),
        "tractions": areas @ moved @ [10.0, 20.0, -30.0],
    }
    with sp.read_recording(path) as recording:
        start = RecordedTrajectory(recording).snapshot(0)
    errors = []
    for parts in (2, 4):
        places = [ends[0] + t * (ends[1] - ends[0]) for t in np.linspace(0, 1, parts + 1)]
        forces = [replace(start, positions=x).load_forces for x in places]
        moved = (ends[1] - ends[0]) / parts
        works = {name: sum(0.5 * ((a[name] + b[name]) * moved).sum() for a, b in pairwise(forces)) for name in exact}
        errors.append({name: works[name] - exact[name] for name in exact})
    assert errors[1]["tractions"] == pytest.approx(0.0, abs=1e-15)
    for name in ("springs", "pressures"):
        assert abs(errors[0][name]) < 0.1 * abs(exact[name])
        assert errors[0][name] / errors[1][name] == pytest.approx(4.0, rel=0.1)


def test_a_force_of_places_is_not_computed(tmp_path):
    bar = sp.Body("bar", sp.shapes.box((0.3, 0.1, 0.1), (2, 1, 1)), RUBBER)
    scene = sp.Scene([bar], loads=[sp.BodyForce(lambda x, t: -x), sp.BodyForce((0, 0, 1))])
    path = recorded(tmp_path / "r.vtkhdf", scene, sp.Implicit(contact=None), 1 / 60, 3)
    with sp.read_recording(path) as recording:
        first, second = RecordedTrajectory(recording).loads
        assert first == ("body_forces", "a force per mass that depends on the place is not recorded")
        assert second[0] == "body_forces"
    assert checked(path)["works"].message.startswith("pins: nothing is pinned; contact: ")


@pytest.mark.parametrize(("field", "name"), [("cavity_pressure", "cavities"), ("cable_tension", "cables")])
def test_a_doubled_pressure_or_tension(driven, corrupted, field, name):
    """Both do less than a tenth of what the muscle does."""

    def double(file, n):
        file[f"supple/frames/details/{field}"][:] *= 2.0

    report = checked(corrupted(driven, double))
    assert [result.name for result in report.failures] == ["works"]
    assert f"work of {name}" in report["works"].message


def test_a_doubled_small_pressure_on_a_surface(loaded, corrupted):
    def double(file, n):
        set_in_scene(file, "scene/loads/1/pressure/values", np.array([0.0, 4e3]))

    report = checked(corrupted(loaded, double))
    assert "works" in [result.name for result in report.failures]
    assert "work of pressures" in report["works"].message


def test_a_doubled_function_of_time(loaded, corrupted):
    """The traction is the second function of the scene; a recording has its values in each frame."""

    def double(file, n):
        file["supple/frames/functions/1"][:] *= 2.0

    report = checked(corrupted(loaded, double))
    assert [result.name for result in report.failures] == ["works"]


def test_forces_that_differ_from_vertex_to_vertex_and_springs_of_the_length_at_the_start(tmp_path, corrupted):
    bar = sp.Body("bar", sp.shapes.box((0.3, 0.1, 0.1), (2, 1, 1)), RUBBER)
    turn = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0], [0, -1, 1]])
    force = sp.Force("bar", [0, 3, 5, 7], lambda t: (1.0 + t) * turn)
    spring = sp.Spring(("bar", 2), (None, (-0.4, 0, 0)), stiffness=50.0)
    scene, solver = sp.Scene([bar], forces=[force], loads=[spring], gravity=(0, 0, 0)), sp.Implicit(contact=None)
    path, later = tmp_path / "r.vtkhdf", tmp_path / "later.vtkhdf"
    start = {"bar": bar.mesh.vertices * [1.05, 1, 1]}
    options = {"initial_positions": start, "sinks": [sp.Recorder(path, solver=solver)]}
    *_, half = sp.simulate(scene, solver, dt=1 / 120, steps=6, **options)
    report = checked(path)
    assert report.ok, str(report)
    assert report["works"].message.startswith("those of forces and springs agree")
    for name in ("forces", "springs"):
        report = checked(with_more_work(path, corrupted, name))
        assert f"work of {name}" in report["works"].message
    list(sp.simulate(scene, solver, dt=1 / 120, steps=6, start=half, sinks=[sp.Recorder(later, solver=solver)]))
    report = checked(later)
    assert report.ok, str(report)
    assert "without springs: a length at the start is not in a recording that begins later" in report["works"].message


@pytest.mark.parametrize("solver", [sp.Implicit(), sp.XPBD(substeps=20)], ids=["implicit", "xpbd"])
def test_loads_on_rigid_and_soft_bodies_together(tmp_path, solver):
    """Also several of one kind, and muscles in tets that grow: each force follows from the declared load."""
    box = sp.shapes.box((0.2, 0.1, 0.1), (3, 2, 2))
    block = sp.shapes.box_surface((0.1, 0.1, 0.1), (2, 2, 2))
    bodies = [
        sp.Body("soft", box, RUBBER, position=(0, 0.5, 0)),
        sp.Body("other", box, RUBBER, position=(0, 1, 0), rotation=(0.2, 0.3, 0.1)),
        sp.RigidBody("rigid", block, mass=0.8, position=(0.5, 0.5, 0), rotation=(0.4, 0, 0.2)),
    ]
    loads = [
        sp.Traction("rigid", lambda t: (30 * np.sin(9 * t), 40, -20)),
        sp.Traction("soft", (0, 50, 20), sp.InBox((0.09, -1, -1), (0.2, 1, 1))),
        sp.Spring(("soft", 3), ("rigid", (0.02, 0, 0.01)), stiffness=15.0),
        sp.Spring(("other", (0.05, 0, 0)), ("soft", (0, 0.01, 0)), stiffness=5.0, rest_length=lambda t: 0.4 + t),
        sp.Wind("other", (3.0, 0, 1), drag=1.0),
        sp.BodyForce((0, 1, 2), "other"),
        sp.BodyForce((0.5, 0, 0)),
        sp.Growth("other", lambda t: 1 + 0.5 * t, direction=(1, 0, 0)),
        sp.Muscle("other", 2e3, (1, 0, 0), lambda t: np.sin(9 * t) ** 2),
    ]
    forces = [
        sp.Force("rigid", [0, 3, 5], lambda t: (0, 4 + t, 0)),
        sp.Force("soft", [0, 7], [[0, 0.3, 0], [0.1, 0, 0]]),
    ]
    points = [("soft", 2), ("rigid", (0, 0.04, 0)), (None, (1, 1, 0))]
    cables = [sp.Cable(points, tension=sp.Curve([0.0, 0.2], [0.0, 2.0]))]
    scene = sp.Scene(bodies, loads=loads, forces=forces, cables=cables)
    path = recorded(tmp_path / "r.vtkhdf", scene, solver, 1 / 120, 10)
    report = checked(path)
    assert report.ok, str(report)
    names = "body_forces, cables, forces, muscles, springs, tractions and wind"
    assert report["works"].message.startswith(f"those of {names} agree")
