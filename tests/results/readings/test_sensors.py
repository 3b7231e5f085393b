"""Force sensors and taxels: balance with the weight, parts of a surface, directions, recordings, and bad input."""

import csv

import numpy as np
import pytest

import supple as sp
from supple.model.state import ContactPoints
from supple.model.system import build_system
from supple.results.export.exporter import export
from supple.results.readings.sensor_readings import sensor_readings

RUBBER = sp.StableNeoHookean(youngs=5e4, poisson=0.3, density=1000.0, damping=0.02)
MESH = sp.shapes.box((0.2, 0.1, 0.2), (4, 1, 4))
G, ANGLE = 9.81, 0.3
WEIGHT = G * 1000.0 * 0.004
IMPLICIT = sp.Implicit(force_tolerance=1e-8, tolerance=1e-9)
SOLVERS = {"implicit": (IMPLICIT, 0.1, 20, 1e-6), "xpbd": (sp.XPBD(substeps=20), 1 / 60, 45, 1e-2)}
SURFACE = MESH.vertices[MESH.surface.triangles]
BOTTOM = np.flatnonzero(np.isclose(SURFACE[:, :, 1], -0.05).all(axis=1))
LEFT = BOTTOM[SURFACE[BOTTOM].mean(axis=1)[:, 0] < 0.0]
GRID = {"corner": (-0.1, -0.05, -0.1), "first": (0.2, 0, 0), "second": (0, 0, 0.2), "cells": (4, 3)}
SENSORS = [
    sp.ForceSensor("all", "block"),
    sp.ForceSensor("bottom", "block", region=BOTTOM),
    sp.ForceSensor("left", "block", region=LEFT),
    sp.ForceSensor("right", "block", region=np.setdiff1d(BOTTOM, LEFT)),
    sp.ForceSensor("top", "block", region=sp.InBox((-1, 0.09, -1), (1, 1, 1))),
    sp.Taxels("skin", "block", **GRID, region=BOTTOM),
    sp.Taxels("half", "block", **{**GRID, "first": (0.1, 0, 0), "cells": (2, 3)}, region=BOTTOM),
]


def flat_scene():
    body = sp.Body("block", MESH, RUBBER, position=(0, 0.0505, 0))
    return sp.Scene([body], [sp.HalfSpace(name="floor")], sensors=SENSORS)


@pytest.fixture(scope="module", params=SOLVERS)
def resting(request, tmp_path_factory):
    solver, dt, steps, tolerance = SOLVERS[request.param]
    path = tmp_path_factory.mktemp("sensors") / "r.vtkhdf"
    *_, frame = sp.simulate(flat_scene(), solver, dt=dt, steps=steps, sinks=[sp.Recorder(path)])
    return frame, tolerance, path


def test_force_sensors_add_up_to_the_weight(resting):
    frame, tolerance, _ = resting
    feel = frame.sensors
    # The sides bulge over the floor, so that a little of the force at the edges belongs to them.
    for name, share in (("all", tolerance), ("bottom", tolerance + 1e-3)):
        np.testing.assert_allclose(feel[name].force, [0, WEIGHT, 0], atol=share * WEIGHT)
        assert feel[name].normal == pytest.approx(WEIGHT, rel=0.01)
        np.testing.assert_allclose(feel[name].center, [0, 0, 0], atol=0.002)
    both = feel["left"].force + feel["right"].force
    np.testing.assert_allclose(both, feel["bottom"].force, atol=1e-12 * WEIGHT)
    assert feel["left"].normal == pytest.approx(0.5 * WEIGHT, rel=0.02)
    assert feel["left"].center[0] < -0.03
    assert not feel["top"].force.any()
    assert np.isnan(feel["top"].center).all()


def test_sensors_of_two_bodies_on_one_floor_feel_each_its_own():
    bodies = [sp.Body(f"block {k}", MESH, RUBBER, position=(k, 0.0505, 0)) for k in (0, 1)]
    sensors = [sp.ForceSensor(f"foot {k}", f"block {k}", by="floor") for k in (0, 1)]
    scene = sp.Scene(bodies, [sp.HalfSpace(name="floor")], sensors=sensors)
    *_, frame = sp.simulate(scene, IMPLICIT, 0.1, 10)
    for k in (0, 1):
        np.testing.assert_allclose(frame.sensors[f"foot {k}"].force, [0, WEIGHT, 0], atol=1e-2 * WEIGHT)


def test_taxels_add_up_to_the_weight(resting):
    frame, _, _ = resting
    skin, half = frame.sensors["skin"], frame.sensors["half"]
    assert skin.normal.shape == (4, 3)
    assert skin.shear.shape == (4, 3, 2)
    assert skin.normal.sum() == pytest.approx(frame.sensors["bottom"].normal, rel=1e-12)
    assert (skin.normal > 0.0).all()
    np.testing.assert_allclose(half.normal, skin.normal[:2], rtol=1e-12)
    np.testing.assert_allclose(skin.normal.sum(axis=1), skin.normal.sum(axis=1)[::-1], rtol=0.05)


def test_recordings_and_tables_have_the_sensors(resting, tmp_path):
    frame, _, path = resting
    with sp.read_recording(path) as recording:
        last = recording[-1].sensors
        assert list(last) == [*(sensor.name for sensor in SENSORS), "floor"]
        for name, reading in frame.sensors.items():
            np.testing.assert_array_equal(last[name].numbers(), reading.numbers())
        assert not recording[0].sensors["all"].force.any()
    with export(path, "csv", tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        row = list(csv.DictReader(file))[-1]
    bottom, skin = frame.sensors["bottom"], frame.sensors["skin"]
    assert [float(row[f"sensors.bottom.{axis}"]) for axis in "xyz"] == bottom.force.tolist()
    assert float(row["sensors.bottom.normal"]) == bottom.normal
    assert float(row["sensors.bottom.center.x"]) == bottom.center[0]
    assert row["sensors.top.center.x"] == ""
    assert float(row["sensors.skin.normal"]) == skin.normal.sum()
    assert float(row["sensors.skin.max"]) == skin.normal.max()


def test_shear_is_along_the_grid_on_a_slope():
    up = np.array([-np.sin(ANGLE), np.cos(ANGLE), 0.0])
    body = sp.Body("block", MESH, RUBBER, position=0.0505 * up, rotation=(0, 0, ANGLE))
    turned = {**GRID, "first": (0, 0, 0.2), "second": (0.2, 0, 0), "cells": (2, 2)}
    sensors = [SENSORS[5], sp.Taxels("turned", "block", **turned, region=BOTTOM)]
    scene = sp.Scene([body], [sp.HalfSpace(normal=up, friction=0.6)], sensors=sensors)
    *_, frame = sp.simulate(scene, IMPLICIT, dt=0.1, steps=20)
    skin, other = frame.sensors["skin"], frame.sensors["turned"]
    # The first side points up the slope, where friction pulls.
    sums = [skin.normal.sum(), *skin.shear.sum(axis=(0, 1))]
    expected = np.array([np.cos(ANGLE), np.sin(ANGLE), 0.0]) * WEIGHT
    np.testing.assert_allclose(sums, expected, atol=0.02 * WEIGHT)
    np.testing.assert_allclose(other.shear.sum(axis=(0, 1)), [sums[2], sums[1]], atol=0.005 * WEIGHT)


def test_no_force_is_lost_where_a_vertex_is_pulled():
    """The mean force over a frame may pull at all triangles of a vertex that turned far in it."""
    system = build_system(sp.Scene([sp.Body("block", MESH, RUBBER)], [sp.HalfSpace(name="floor")], sensors=SENSORS[:1]))
    corner = int(np.argmin(MESH.vertices.sum(axis=1)))
    row = np.flatnonzero(system.points.single == corner)
    for force in ([-3.0, -2.0, -1.0], [3.0, 2.0, 1.0]):
        forces, numbers = np.array([force]), np.zeros(1, dtype=np.int32)
        where = (np.zeros(1, dtype=np.int64), row.astype(np.int32), np.ones(1))
        others = (0.1 * forces, np.zeros(1), numbers, numbers + 1, ("block", "floor"))
        contacts = ContactPoints(np.zeros((1, 3)), forces / np.linalg.norm(forces), forces, *others, *where)
        felt = sensor_readings(system, system.rest_positions, contacts)["all"]
        np.testing.assert_allclose(felt.numbers()[:3], 1.1 * forces[0], rtol=1e-12)


def test_scenes_without_contact_feel_nothing():
    scene = sp.Scene([sp.Body("block", MESH, RUBBER)], sensors=SENSORS[:1] + SENSORS[5:6])
    (frame,) = sp.simulate(scene, sp.XPBD(substeps=1), dt=0.001, steps=1)
    assert not frame.sensors["all"].force.any()
    assert not frame.sensors["skin"].normal.any()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: [sp.ForceSensor("a", "brick")], "force sensor 'a': body 'brick' does not exist"),
        (lambda: [sp.ForceSensor("a", "block", [10**6])], "force sensor 'a': triangle 1000000 does not exist"),
        (lambda: [sp.ForceSensor("a", "block", sp.InBox((5, 5, 5), (6, 6, 6)))], "holds no triangle of the surface"),
        (lambda: [sp.ForceSensor("a", "block", [])], "region must be a non-empty list"),
        (lambda: [sp.ForceSensor("", "block")], "name is ''; give a non-empty text"),
        (lambda: [sp.ForceSensor("a", "block"), sp.ForceSensor("a", "block")], "another sensor has this name"),
        (lambda: [sp.Taxels("a", "block", **{**GRID, "second": (1, 0, 0)})], "first and second are parallel"),
        (lambda: [sp.Taxels("a", "block", **{**GRID, "cells": (0, 1)})], "cells is .0, 1.; give"),
        (lambda: [sp.Taxels("a", "block", **{**GRID, "corner": (0, np.nan, 0)})], "corner is .* it must be finite"),
        (lambda: ["a"], "sensors.0. is a str; give a Sensor"),
    ],
)
def test_bad_sensors_are_one_line(make, message):
    with pytest.raises(sp.SceneError, match=message):
        sp.Scene([sp.Body("block", MESH, RUBBER)], sensors=make())


ALUMINIUM = 2700.0
TURN = sp.Keyframes(times=[0.0, 1.0], angles=[0.0, 0.3], axis=(0, 0, 1))


def test_angles_and_distances_are_those_of_the_motion():
    plate = sp.RigidBody("plate", sp.shapes.box((0.2, 0.02, 0.2), (1, 1, 1)), density=ALUMINIUM, rotation=(0, 0.5, 0))
    block = sp.Body("block", MESH, RUBBER, position=(1, 0, 0))
    right = sp.InBox((1.09, -1, -1), (2, 1, 1))
    sensors = [
        sp.AngleSensor("about z", "plate", axis=(0, 0, -2)),
        sp.AngleSensor("about y", "plate", axis=(0, 1, 0)),
        sp.AngleSensor("any", "plate"),
        sp.AngleSensor("end", "block", right),
        sp.DistanceSensor("gap", ("plate", (0, 0, 0)), (None, (3, 4, 0))),
        sp.DistanceSensor("width", ("block", 0), ("block", (0.1, -0.05, -0.1))),
    ]
    pins = [sp.Pin("plate", motion=TURN, name="turner"), sp.Pin("block", np.arange(len(MESH.vertices)))]
    scene = sp.Scene([plate, block], pins=pins, sensors=sensors, gravity=(0, 0, 0))
    *_, frame = sp.simulate(scene, sp.XPBD(substeps=2), dt=0.5, steps=2)
    feel = frame.sensors
    angles = [feel[name].angle for name in ("about z", "about y", "any", "end")]
    np.testing.assert_allclose(angles, [-0.3, 0.0, 0.3, 0.0], atol=1e-7)
    assert feel["gap"].distance == pytest.approx(5.0, rel=1e-9)
    assert feel["width"].distance == pytest.approx(0.2, rel=1e-12)
    assert feel["turner"].angle == pytest.approx(0.3, abs=1e-7)
    assert feel["block.pin"].angle == 0.0


@pytest.mark.parametrize("solver", [sp.Implicit(integrator="static"), sp.XPBD(substeps=60)])
def test_a_pad_that_is_pressed_has_its_force_displacement_and_work(solver, tmp_path):
    """The table's force is that of the floor, and the work what the pad stores, for an obstacle and for a pin."""
    pad = sp.Body("pad", MESH, RUBBER, position=(0, 0.0501, 0))
    down = sp.Keyframes(times=[0.0, 0.7], displacements=[[0, 0, 0], [0, -0.004, 0]])
    top = sp.Pin("pad", sp.InBox((-1, 0.1, -1), (1, 1, 1)), motion=down, name="grip")
    scene = sp.Scene(
        [pad], [sp.HalfSpace(name="floor")], [top], (0, 0, 0), sensors=[sp.ForceSensor("pair", "pad", by="floor")]
    )
    sink = sp.Recorder(tmp_path / "r.vtkhdf")
    *_, frame = sp.simulate(scene, solver, dt=0.1, steps=10, sinks=[sink])
    with sp.read_recording(sink.path) as recording:
        table = export(recording, "csv")
        recording.plot("grip.displacement", ["grip.force", "pair.normal"]).save(tmp_path / "curve.svg")
        with pytest.raises(sp.OutputError, match=r"no column 'grip\.forse' of numbers; did you mean 'grip\.force'\?"):
            recording.plot("time", "grip.forse").save(tmp_path / "curve.svg")
    rows = list(csv.DictReader(table.open()))
    values = {name: float(rows[-1][name]) for name in rows[0] if name.startswith(("grip", "floor", "sensors"))}
    assert values["grip.displacement"] == pytest.approx(0.004)
    assert values["grip.force"] == pytest.approx(values["floor.force.y"], rel=0.02)
    assert values["sensors.pair.y"] == pytest.approx(values["floor.force"], rel=1e-9)
    assert values["floor.force.y"] == frame.sensors["floor"].force[1]
    assert values["grip.work"] == pytest.approx(frame.report.elastic_energy, rel=0.1)
    svg = (tmp_path / "curve.svg").read_text()
    assert "grip.displacement [m]" in svg
    assert "sensors.pair.normal" in svg


@pytest.mark.parametrize(
    ("sensor", "reason"),
    [
        (sp.ForceSensor("a", "block", by="flor"), "body or obstacle 'flor' does not exist; did you mean 'floor'"),
        (sp.AngleSensor("a", "block", [0, 1]), "2 vertices are on one line"),
        (sp.AngleSensor("a", "block"), "give the vertices"),
        (
            sp.DistanceSensor("a", ("block", 9999), (None, (0, 0, 0))),
            "first: vertex 9999 of body 'block' does not exist",
        ),
    ],
)
def test_sensors_that_do_not_fit_the_scene(sensor, reason):
    with pytest.raises(sp.SceneError, match=reason):
        sp.Scene([sp.Body("block", MESH, RUBBER)], [sp.HalfSpace(name="floor")], sensors=[sensor])
    with pytest.raises(sp.SceneError, match="by is its own body, 'block'"):
        sp.ForceSensor("a", "block", by="block")
