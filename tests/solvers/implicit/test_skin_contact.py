"""Soft bodies that touch with a fine skin, which their tets carry."""

import numpy as np
import pytest
from tests.scenes import converged

import supple as sp

G = 9.81
CAGE = sp.shapes.box((0.3, 0.3, 0.3), (2, 2, 2))
BALL = sp.shapes.sphere_surface(0.1, 0.04)
MATERIAL = sp.StableNeoHookean(youngs=1e5, poisson=0.3)
FLOOR = sp.HalfSpace(friction=0.3, name="floor")


def ball(name="ball", **values):
    return sp.Body(name, CAGE, MATERIAL, **({"skin": BALL, "collide": "skin", "friction": 0.3} | values))


def run(scene, dt, steps, **more):
    return converged(sp.simulate(scene, sp.Implicit(), dt, steps, **more))


def test_a_body_rests_on_its_skin_and_its_tets_reach_through_the_floor(tmp_path):
    path = tmp_path / "skin.vtkhdf"
    scene = sp.Scene([ball(position=(0, 0.102, 0))], obstacles=[FLOOR])
    frames = run(scene, 1 / 60, 30, sinks=[sp.Recorder(path, solver=sp.Implicit(), fields=["contact_force"])])
    frame = frames[-1]
    assert frame.positions["ball"].shape == (27, 3)
    assert frame.positions["ball"][:, 1].min() < -0.03
    forces, weight = frame.contact_force["ball"], CAGE.volume * 1000 * G
    assert forces.shape == (len(BALL.vertices), 3)
    details = frame.report.details
    total = details.contact_forces["ball"] + details.friction_forces["ball"]
    np.testing.assert_allclose(forces.sum(axis=0), total, atol=1e-9 * weight)
    pushes = np.mean([f.report.details.contact_forces["ball"][1] for f in frames[10:]])
    assert pushes == pytest.approx(weight, rel=0.1)
    with sp.read_recording(path) as recording:
        (body,) = recording.bodies
        skin = body.skin.positions(recording[-1].state.positions)
        assert 0.0 < skin[:, 1].min() < 1e-3
        assert body.body.touches_with_skin
        assert not body.rigid
        assert np.isnan(recording[-1].contact_force["ball"]).all()  # there are no fields of skins
    report = sp.check_recording(path)
    assert report.ok, report.failures
    assert report["distance"].worst > 0.0


@pytest.mark.parametrize("order", [1, 2])
def test_a_skin_on_the_surface_of_the_tets_touches_as_they_do(order):
    """The same contact by combinations of vertices."""
    mesh = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1), order=order)
    skin = sp.SurfaceMesh(mesh.vertices, mesh.surface.triangles)
    ends = []
    for collide in ("tets", "skin"):
        values = {
            "skin": skin,
            "collide": collide,
            "friction": 0.3,
            "position": (0, 0.053, 0),
            "velocity": (1, 0, 0),
        }
        ends.append(run(sp.Scene([sp.Body("cube", mesh, MATERIAL, **values)], obstacles=[FLOOR]), 0.005, 12)[-1])
    np.testing.assert_allclose(ends[0].positions["cube"], ends[1].positions["cube"], atol=1e-6)
    pushes = [end.report.details.contact_forces["cube"] for end in ends]
    assert pushes[0][1] > 1.0
    np.testing.assert_allclose(pushes[1], pushes[0], rtol=1e-3, atol=1e-3)


CORNERS = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1))


def test_skins_touch_skins_and_rigid_bodies_and_keep_momentum():
    stone = sp.RigidBody("stone", CORNERS, mass=3.0, position=(-0.152, 0.01, 0), velocity=(1, 0, 0), friction=0.3)
    bodies = [ball(), ball("other", position=(0.202, 0, 0.01)), stone]
    frames = run(sp.Scene(bodies, gravity=(0, 0, 0)), 0.005, 16)
    momenta = np.array([frame.report.linear_momentum for frame in frames])
    np.testing.assert_allclose(momenta, np.tile([3.0, 0, 0], (16, 1)), atol=1e-9)
    pushes = [frame.report.details.contact_forces for frame in frames]
    assert max(push["other"][0] for push in pushes) > 0.1
    assert all(np.abs(sum(push.values())).max() < 1e-9 for push in pushes)
    assert frames[-1].poses["stone"].velocity[0] < 0.9


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: ball(skin=None), "body 'ball': collide is 'skin', and it has no skin"),
        (lambda: ball(collide="cage"), "body 'ball': collide is 'cage'; give 'tets' or 'skin'"),
        (lambda: ball(skin=sp.SurfaceMesh(BALL.vertices, BALL.triangles[1:])), "body 'ball': skin: "),
        (lambda: ball(skin=BALL.flipped()), "body 'ball': skin: its surface is inside out"),
        (
            lambda: sp.Scene([ball()], sensors=[sp.ForceSensor("pad", "ball")]),
            "body 'ball' touches with its skin, which cannot carry sensors",
        ),
        (
            lambda: sp.Scene(
                [ball(), sp.RigidBody("stone", CORNERS, mass=1.0, position=(0, 0.2, 0))],
                welds=[sp.Weld("ball", "stone", max_distance=0.1)],
            ),
            "which cannot carry welds; give it collide='tets'",
        ),
        (
            lambda: sp.simulate(sp.Scene([ball()]), sp.XPBD(), 0.01, 1),
            "XPBD: body 'ball' touches with its skin; simulate it with Implicit",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(make, problem):
    with pytest.raises(sp.SuppleError) as error:
        make()
    assert problem in str(error.value)


def test_a_scene_file_chooses_what_touches(tmp_path):
    (tmp_path / "scene.yaml").write_text(
        "bodies:\n"
        "  - name: cube\n"
        "    shape: {kind: box, size: [0.1, 0.1, 0.1], divisions: [1, 1, 1]}\n"
        "    material: {kind: stable_neo_hookean, youngs: 1.0e5, poisson: 0.3}\n"
        "    skin: {file: skin.stl}\n"
        "    collide: skin\n"
    )
    CORNERS.save(tmp_path / "skin.stl")
    assert sp.load_scene(tmp_path / "scene.yaml").bodies[0].touches_with_skin
