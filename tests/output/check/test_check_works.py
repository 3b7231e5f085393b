"""Works of pins and of contact that the check computes anew."""

import pytest

import supple as sp
from supple.output.check.checks.works import Works
from supple.output.check.snapshot import Scene, Snapshot

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
    return sp.check_recording(path, sp.CheckSettings(only=["balance", "works"], **options))


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

    assert checked(dragged).ok
    report = checked(corrupted(dragged, shift))
    assert [result.name for result in report.failures] == ["works"]
    assert f"work of {'pins' if name == 'pins' else 'contact'}" in report["works"].message


def test_works_need_every_frame(dragged):
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
            check = Works(Scene(recording), sp.CheckSettings())
            frames = [Snapshot.of(check.scene, frame) for frame in recording]
            for frame in frames:
                check.see(frame)
            work = sum(found[0][0] for found in check.frames)
            stored = [frame.elastic_energy or 0.0 for frame in frames]
            errors.append(abs(work / (stored[-1] - stored[0]) - 1.0))
    assert errors[0] < 0.02
    assert errors[1] == pytest.approx(errors[0] / 4.0, rel=0.2)
