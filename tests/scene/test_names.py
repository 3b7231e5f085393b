"""Names that do not exist get a suggestion; `help` shows plain types; parts are added to a scene."""

import inspect
import pydoc

import pytest

import supple as sp

MESH = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))
RUBBER = sp.StableNeoHookean(youngs=1e4, poisson=0.3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sp.StableNeoHookean(E=1e4, nu=0.3), "StableNeoHookean: the argument 'E' does not exist; .* 'youngs'"),
        (lambda: sp.StableNeoHookean(youngs=1e4, nu=0.3), "the argument 'nu' does not exist; did you mean 'poisson'"),
        (lambda: sp.XPBD(substep=3), "XPBD: the argument 'substep' does not exist; did you mean 'substeps'"),
        (lambda: sp.Pin("b", vertex=[1]), "Pin: the argument 'vertex' does not exist; did you mean 'vertices'"),
        (lambda: sp.Body("b", MESH, RUBBER, positon=(0, 0, 0)), "'positon' does not exist; did you mean 'position'"),
        (lambda: sp.Scene([], obstacle=[]), "'obstacle' does not exist; did you mean 'obstacles'"),
        (lambda: sp.HalfSpace(mu=0.5), "'mu' does not exist; did you mean 'friction'"),
        (
            lambda: sp.Body("b", MESH, RUBBER, (0, 1, 0)),
            "Body takes name, mesh, material without a name, not 4 values; write the others as name=value: .*position",
        ),
    ],
)
def test_an_unknown_argument_names_the_right_one(make, words):
    with pytest.raises(sp.SuppleError, match=words):
        make()


def test_an_unknown_name_at_the_top_names_the_right_one():
    with pytest.raises(AttributeError, match="supple has no name 'StableNeohookean'; did you mean 'StableNeoHookean'"):
        sp.StableNeohookean  # noqa: B018
    assert not hasattr(sp, "__wrapped__")


def test_an_unknown_body_of_a_frame_or_recording_names_the_right_one(tmp_path):
    scene = sp.Scene([sp.Body("bear", MESH, RUBBER), sp.RigidBody("ball", MESH, mass=1, position=(1, 0, 0))])
    solver = sp.XPBD(substeps=1, contact=None)
    *_, frame = sp.simulate(scene, solver, dt=0.01, steps=1, sinks=[sp.Recorder(tmp_path / "r.vtkhdf")])
    for one in (frame, sp.read_recording(tmp_path / "r.vtkhdf")[-1]):
        with pytest.raises(sp.SuppleError, match="body 'baer' does not exist; did you mean 'bear'"):
            one.positions["baer"]
        with pytest.raises(KeyError, match="rigid body 'bal' does not exist; did you mean 'ball'"):
            one.poses["bal"]
        assert one.velocities.get("baer") is None
    with pytest.raises(KeyError, match="joint 'hip' does not exist"):
        frame.report.joints["hip"]


@pytest.mark.parametrize("name", sorted(name for name in sp.__all__ if inspect.isclass(getattr(sp, name))))
def test_help_shows_plain_types(name):
    assert "Annotated[" not in pydoc.render_doc(getattr(sp, name))


def test_a_signature_has_the_names_and_defaults_of_the_fields():
    parameters = inspect.signature(sp.Pin).parameters
    assert list(parameters)[:2] == ["body", "vertices"]
    assert inspect.signature(sp.StableNeoHookean).parameters["density"].default == 1000.0


def test_parts_are_added_to_a_scene():
    scene = sp.Scene([sp.Body("a", MESH, RUBBER)], [sp.HalfSpace()])
    more = scene.with_added(bodies=[sp.Body("b", MESH, RUBBER, position=(0, 1, 0))], pins=[sp.Pin("b", [0])])
    assert [body.name for body in more.bodies] == ["a", "b"]
    assert (len(more.pins), len(more.obstacles), len(scene.bodies)) == (1, 1, 1)
    with pytest.raises(sp.SceneError, match="parts 'bodys' do not exist; did you mean 'bodies'"):
        scene.with_added(bodys=[])
    with pytest.raises(sp.SceneError, match="same name"):
        scene.with_added(bodies=[sp.Body("a", MESH, RUBBER)])
