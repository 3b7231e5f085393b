"""Rods with what acts on them: clamps that turn, forces, springs, cables, welds, stitches, starts, senseless loads."""

from typing import Any

import numpy as np
import pytest

import supple as sp

R = 0.002
ROPE = sp.RodMaterial(youngs=1e7, poisson=0.3, radius=R, density=1000.0, damping=0.002)
SOFT = sp.StableNeoHookean(youngs=1e5, poisson=0.4, density=1000.0)
STATIC = sp.Implicit(integrator="static", contact=None)


def rope(count=8, length=0.16, name="rope", **more):
    return sp.Rod(name, np.linspace([0.0, 0.0, 0.0], [length, 0.0, 0.0], count + 1), ROPE, **more)


def last(scene, steps=1, solver=None, dt=1 / 60):
    for frame in sp.simulate(scene, sp.Implicit() if solver is None else solver, dt=dt, steps=steps):
        assert frame.report.status == "converged", frame.report.message
    return frame


def test_clamped_ends_that_turn_twist_a_rod_and_feel_its_torque():
    count, length, angle = 8, 0.16, 0.8
    turn = sp.Keyframes([0.0, 1.0], angles=[0.0, angle], axis=(1, 0, 0))
    pins = [sp.Pin("rope", [0, 1], name="still"), sp.Pin("rope", [count - 1, count], name="turned", motion=turn)]
    frame = last(sp.Scene([rope(count, length)], gravity=(0, 0, 0), pins=pins), solver=STATIC, dt=1.0)
    free = length * (count - 2) / count  # between the clamped edges
    torque = ROPE.twisting_stiffness * 2.0 * np.tan(0.5 * angle / (count - 1)) * (count - 1) / free
    own = frame.system.pins[1]
    details: Any = frame.report.details
    forces = details.reaction_forces_by_vertex[own.label]
    assert np.cross(frame.positions["rope"][own.vertices], forces)[:, 0].sum() == pytest.approx(torque, rel=0.01)
    middle = frame.positions["rope"][: count + 1]
    np.testing.assert_allclose(middle[:, 1:], 0.0, atol=1e-9)


def test_ends_that_turn_dynamically_keep_the_clamps():
    count = 6
    turn = sp.Keyframes([0.0, 0.5], angles=[0.0, 4.0], axis=(1, 0, 0))
    pins = [sp.Pin("rope", [0, 1]), sp.Pin("rope", [count - 1, count], motion=turn)]
    frame = last(sp.Scene([rope(count)], gravity=(0, 0, 0), pins=pins), steps=10)
    x = frame.positions["rope"]
    assert np.linalg.norm(x[-2] - x[-1]) == pytest.approx(2.0 * R, rel=1e-9)
    assert frame.report.elastic_energy > 5e-4


@pytest.mark.parametrize("kind", ["force", "target", "body force", "spring", "cable"])
def test_forces_act_on_points_of_rods(kind):
    load, k = 1e-3, 50.0
    more = {
        "force": {"forces": [sp.Force("rope", [8], force=(0, load, 0))]},
        "target": {"soft_targets": [sp.SoftTarget("rope", [8], stiffness=k, motion=lambda t: (0.0, 0.002, 0.0))]},
        "body force": {"loads": [sp.BodyForce((0.0, 1.0, 0.0), "rope")]},
        "spring": {"loads": [sp.Spring(("rope", 8), ("post", 0), stiffness=k, rest_length=0.03)]},
        "cable": {"cables": [sp.Cable([("rope", 8), ("post", 0)], stiffness=k, length=0.03)]},
    }[kind]
    bodies, pins = [rope()], [sp.Pin("rope", [0, 1])]
    if kind in ("spring", "cable"):
        bodies.append(rope(2, name="post", position=(0.16, 0.04, 0.0)))
        pins.append(sp.Pin("post", [0, 1, 2]))
    frame = last(sp.Scene(bodies, gravity=(0, 0, 0), pins=pins, **more), solver=STATIC, dt=1.0)
    assert 1e-4 < frame.positions["rope"][8, 1] < 0.02
    if kind == "force":
        deflection = load * 0.14**3 / (3.0 * ROPE.bending_stiffness)
        assert frame.positions["rope"][8, 1] == pytest.approx(deflection, rel=0.05)


def test_a_rod_that_is_welded_to_a_rigid_body_is_clamped_by_it():
    box = sp.RigidBody("box", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), density=1000.0)
    rod = rope(position=(0.0, 0.05 + 1.5 * R, 0.0))
    weld = sp.Weld("rope", "box", vertices=[0, 1])
    scene = sp.Scene([rod, box], gravity=(0, 0, 0), welds=[weld], forces=[sp.Force("rope", [8], force=(0, 1e-3, 0))])
    frame = last(scene, steps=20)
    x, pose = frame.positions["rope"], frame.poses["box"]
    inside = (x - pose.translation) @ pose.rotation
    np.testing.assert_allclose(inside[[0, 1]], rod.place(rod.points)[[0, 1]], atol=1e-6)
    np.testing.assert_allclose(inside[9:11], rod.place(rod.points)[9:11], atol=1e-6)  # the first edge's material points


@pytest.mark.parametrize("other", ["body", "shell"])
def test_a_point_of_a_rod_is_stitched_to_a_triangle(other):
    if other == "body":
        second, high = sp.Body("other", sp.shapes.box((0.1, 0.02, 0.1), (4, 1, 4)), SOFT), 0.01
    else:
        shell = sp.ShellMaterial(youngs=1e6, poisson=0.3, thickness=1e-3, density=1000.0)
        second, high = sp.Shell("other", sp.shapes.sheet(0.1, 0.1, 0.025), shell), 5e-4
    rod = rope(position=(0.011, high + 2.0 * R, 0.013))
    stitch = sp.SoftVertexTriangleStitch("rope", "other", max_distance=high + 4 * R, youngs=1e6, poisson=0.4)
    scene = sp.Scene([rod, second], stitches=[stitch], pins=[sp.Pin("rope", [7, 8])])
    frame = last(scene, steps=20)
    assert frame.positions["other"][:, 1].min() > -0.2  # it hangs from the rope, and does not fall 0.54 m


@pytest.mark.parametrize("kind", [sp.VertexEdgeStitch, sp.VertexVertexStitch])
def test_two_rods_are_stitched(kind):
    rods = [rope(), rope(4, 0.08, "hanging", position=(0.0, -0.01, 0.0))]
    stitch = kind("hanging", "rope", max_distance=0.012, stiffness=100.0)
    assert len(rods[0].mesh.surface.edges) == 8  # and none from a point to itself
    frame = last(sp.Scene(rods, stitches=[stitch], pins=[sp.Pin("rope", [0, 8])]), steps=15)
    assert frame.positions["hanging"][:, 1].min() > -0.15


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ({"loads": [sp.Pressure("rope", 100.0)]}, r"pressure .*rod 'rope' is edges, which have no triangles; give"),
        ({"loads": [sp.Traction("rope", (0, 1, 0))]}, r"traction .*rod 'rope' is edges, which have no triangles; give"),
        ({"loads": [sp.Wind("rope", (1, 0, 0))]}, r"wind .*rod 'rope' is edges, which have no triangles; give"),
        ({"loads": [sp.Growth("rope", 1.1)]}, r"growth .*rod 'rope' has no tets"),
        ({"loads": [sp.Muscle("rope", 1e3, (1, 0, 0))]}, r"muscle .*rod 'rope' has no tets"),
        (
            {"cavities": [sp.Cavity("rope", pressure=10.0)]},
            "cavity .*rod 'rope' is edges, which have no triangles; give a body of tets",
        ),
        (
            {"sensors": [sp.Taxels("t", "rope", corner=(0, 0, 0), first=(1, 0, 0), second=(0, 1, 0), cells=(2, 2))]},
            r"'t'.*rod 'rope' is edges, which have no triangles; give a ForceSensor",
        ),
    ],
)
def test_what_makes_no_sense_for_a_rod_is_refused(more, text):
    with pytest.raises(sp.SceneError, match=text):
        sp.Scene([rope()], **more)


def test_nothing_is_stitched_to_triangles_of_a_rod():
    stitch = sp.SoftVertexTriangleStitch("box", "rope", max_distance=0.05, youngs=1e5, poisson=0.4)
    box = sp.Body("box", sp.shapes.box((0.02, 0.02, 0.02), (1, 1, 1)), SOFT, position=(0.05, 0.015, 0.0))
    with pytest.raises(sp.SceneError, match="'rope' is edges without triangles; give a VertexEdgeStitch"):
        last(sp.Scene([box, rope()], stitches=[stitch]))


@pytest.mark.parametrize(
    ("above", "below", "names"),
    [(1.5 * R, 1.5 * R, "'rope' and body 'other'"), (2.5 * R, 0.5 * R, "'rope' and obstacle 'floor'")],
)
def test_rods_that_start_nearer_than_their_radii_are_an_error(above, below, names):
    other = rope(2, name="other", position=(0.02, above, 0.01), rotation=(0.0, 1.0, 0.0))
    floor = sp.HalfSpace(point=(0.0, -below, 0.0), name="floor")
    with pytest.raises(sp.SolverError, match=rf"body {names} are nearer .* thickness of shells and rods, by 0.001 m"):
        last(sp.Scene([rope(), other], obstacles=[floor]))


@pytest.mark.parametrize("other", ["soft", "rigid", "box", "sphere", "shell"])
def test_a_rod_that_starts_through_something_is_an_error(other):
    rod = sp.Rod("rope", [[-0.2, 0.01, 0.013], [0.2, 0.012, 0.014]], ROPE)
    box = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
    sheet = sp.shapes.sheet(0.1, 0.1, 0.025)
    shell = sp.ShellMaterial(youngs=1e6, poisson=0.3, thickness=1e-3, density=1000.0)
    bodies, obstacles = {
        "soft": ([sp.Body("other", box, SOFT)], []),
        "rigid": ([sp.RigidBody("other", box, density=1000.0)], []),
        "box": ([], [sp.obstacles.Box(size=(0.1, 0.1, 0.1), name="other")]),
        "sphere": ([], [sp.obstacles.Sphere(center=(0, 0, 0), radius=0.05, name="other")]),
        "shell": ([sp.Shell("other", sheet, shell, rotation=(0, 0, 80))], []),
    }[other]
    with pytest.raises(sp.SceneError, match=r"'rope' overlaps .* 'other' at the start"):
        last(sp.Scene([rod, *bodies], obstacles=obstacles))


@pytest.mark.parametrize("other", ["soft", "shell"])
def test_the_check_sees_an_edge_of_a_rod_through_a_triangle(tmp_path, other):
    rod = sp.Rod("rope", [[0.011, -0.05, 0.012], [0.012, 0.05, 0.013]], ROPE)
    if other == "soft":
        second = sp.Body("other", sp.shapes.box((0.1, 0.02, 0.1), (4, 1, 4)), SOFT)
    else:
        shell = sp.ShellMaterial(youngs=1e6, poisson=0.3, thickness=1e-3, density=1000.0)
        second = sp.Shell("other", sp.shapes.sheet(0.1, 0.1, 0.025), shell)
    scene, path = sp.Scene([rod, second], gravity=(0, 0, 0)), tmp_path / "through.h5"
    for _ in sp.simulate(scene, sp.Implicit(contact=None), 1 / 60, 1, sinks=[sp.Recorder(path)]):
        pass
    assert "intersection" in [one.name for one in sp.check_recording(path).failures]


def test_sensors_feel_what_carries_a_rod():
    rod = rope(position=(0.0, 1.1 * R, 0.0))
    sensors = [sp.ForceSensor("all", "rope"), sp.ForceSensor("begin", "rope", region=[0, 1, 2, 3])]
    scene = sp.Scene([rod], obstacles=[sp.HalfSpace()], sensors=sensors)
    frame = last(scene, steps=25)
    weight = rod.lumped_masses().sum() * 9.81
    readings: Any = frame.sensors
    whole, half = readings["all"], readings["begin"]
    assert whole.force[1] == pytest.approx(weight, rel=0.05)
    assert whole.normal == pytest.approx(whole.force[1], rel=1e-6)
    assert half.force[1] == pytest.approx(0.5 * whole.force[1], rel=0.05)
    np.testing.assert_allclose(whole.center[[0, 2]], [0.08, 0.0], atol=1e-3)


def test_frequencies_of_a_rod_are_those_of_euler_bernoulli():
    count, length = 20, 1.0
    x = np.linspace(-length / count, length, count + 2)
    material = sp.RodMaterial(youngs=1e9, poisson=0.3, radius=0.005)
    rod = sp.Rod("rod", np.column_stack([x, 0.0 * x, 0.0 * x]), material)
    first, _, second, _ = sp.modes(sp.Scene([rod], pins=[sp.Pin("rod", [0, 1])]), 4).frequencies
    unit = np.sqrt(material.bending_stiffness / (material.density * material.area)) / (2.0 * np.pi * length**2)
    assert first == pytest.approx(1.8751**2 * unit, rel=0.005)
    assert second == pytest.approx(4.6941**2 * unit, rel=0.01)
