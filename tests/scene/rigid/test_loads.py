"""Loads, sensors and fields of scenes with rigid and soft bodies."""

import numpy as np
import pytest

import supple as sp
from supple.errors import SceneError
from supple.model.system import build_system, initial_state

CUBE = sp.shapes.box_surface((0.2, 0.2, 0.2))
SOFT = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000, damping=0.02)


def wrench(system, load, time=0.0):
    """Force and moment about the origin of a load at the start."""
    x = initial_state(system.scene).positions
    forces = np.zeros_like(x)
    load.add_forces(x, time, forces)
    return np.concatenate([forces.sum(axis=0), np.cross(x, forces).sum(axis=0)])


def test_loads_on_points_of_a_rigid_body_have_their_force_and_moment():
    body = sp.RigidBody("cube", CUBE, density=500, position=(1, 2, 0), rotation=(0.3, 0, 0.5))
    corner = body.place(body.points)[3]
    outside = body.place(np.array([[0.0, 0.4, 0.0]]))[0]
    pulled = np.array([1.0, 5.0, 0.0]) - outside
    loads = [
        sp.Traction("cube", (0, -100, 30)),
        sp.BodyForce((0, 0, 3)),
        sp.Spring(("cube", (0, 0.4, 0)), (None, (1, 5, 0)), stiffness=7.0, rest_length=0.0),
    ]
    force = sp.Force("cube", vertices=[3], force=(2, 0, 1))
    system = build_system(sp.Scene([body], loads=loads, forces=[force]))
    mass, area, center = 500 * 0.2**3, 6 * 0.2**2, np.array([1.0, 2, 0])
    expected = [
        (corner, np.array([2.0, 0, 1])),
        (center, area * np.array([0.0, -100, 30])),
        (center, mass * np.array([0.0, 0, 3])),
        (outside, 7.0 * pulled),
    ]
    for load, (place, total) in zip(system.loads, expected, strict=True):
        np.testing.assert_allclose(wrench(system, load), np.concatenate([total, np.cross(place, total)]), atol=1e-10)


def test_pressure_on_a_rigid_body_is_refused():
    body = sp.RigidBody("cube", CUBE, density=500)
    with pytest.raises(SceneError, match="body 'cube': body 'cube' is rigid"):
        build_system(sp.Scene([body], loads=[sp.Pressure("cube", 100.0)]))


def test_sensors_and_fields_of_a_rigid_body_on_a_soft_one(tmp_path):
    palm = sp.RigidBody("palm", CUBE, mass=2.0, position=(0, 0.23, 0))
    pad = sp.Body("pad", sp.shapes.box((0.3, 0.1, 0.3), (2, 1, 2)), SOFT, position=(0, 0.06, 0))
    scene = sp.Scene([pad, palm], [sp.HalfSpace()], sensors=[sp.ForceSensor("under", "palm")])
    recorder = sp.Recorder(tmp_path / "run.vtkhdf", fields=["contact_force", "von_mises"])
    frame = list(sp.simulate(scene, sp.Implicit(), 1 / 60, 60, sinks=[recorder]))[-1]
    weight = 2.0 * 9.81
    assert frame.contact_force["palm"].shape == (len(CUBE.vertices), 3)
    assert frame.contact_force["palm"].sum(axis=0)[1] == pytest.approx(weight, rel=0.02)
    assert frame.sensors["under"].force[1] == pytest.approx(weight, rel=0.02)
    assert frame.contacts.force_between("palm", "pad")[1] == pytest.approx(weight, rel=0.02)
    assert frame.contact_pressure["palm"].max() > 0.0
    with pytest.raises(SceneError, match="'palm' is rigid"):
        frame.stress["palm"]
    recorded = sp.read_recording(tmp_path / "run.vtkhdf")[-1]
    np.testing.assert_allclose(recorded.contact_force["pad"], frame.contact_force["pad"], rtol=1e-6, atol=1e-6)
    with pytest.raises(SceneError, match="'palm' is rigid"):
        recorded.contact_force["palm"]
    np.testing.assert_allclose(recorded.von_mises["pad"], frame.von_mises["pad"], rtol=1e-9)
