"""What stands in a scene file is what Python makes: one of each kind that no other test of files has."""

import pytest
from tests.results.test_recorded_scenes import same

import supple as sp

FILE = """
bodies:
  - {name: bar, shape: {kind: box, size: [0.4, 0.1, 0.1], divisions: [4, 1, 1]}, material: &soft {kind: neo_hookean,
     youngs: 1e5, poisson: 0.3}}
  - {name: shell, shape: {kind: spherical_shell, inner_radius: 0.1, outer_radius: 0.15, edge_length: 0.06},
     material: *soft, position: [0, 2, 0]}
  - {name: palm, shape: {kind: box, size: [0.1, 0.1, 0.1], divisions: [1, 1, 1]}, rigid: {mass: 1},
     position: [-0.25, 0, 0]}
  - {name: stone, shape: {kind: box, size: [0.1, 0.1, 0.1], divisions: [1, 1, 1]}, rigid: {mass: 1},
     position: [3, 0, 0]}
obstacles:
  - {kind: torus, center: [0, -9, 0], axis: [0, 0, 2], radius: 2, tube_radius: 0.5}
loads:
  - {kind: muscle, body: bar, strength: 2e4, direction: [2, 0, 0], activation: {times: [0, 1], values: [0, 1]},
     box: {low: [0, -1, -1], high: [1, 1, 1]}, force_length: {stretches: [0.5, 1], values: [0, 1]}}
  - {kind: growth, body: bar, stretch: {times: [0, 1], values: [1, 1.2]}, direction: [0, 2, 0], tets: [0, 2]}
  - {kind: wind, body: bar, velocity: {times: [0, 1], values: [[0, 0, 0], [9, 0, 0]]}, drag: 1.28, name: gust}
sensors:
  - {kind: force, name: tip, body: bar, box: {low: [-1, 0.04, -1], high: [1, 1, 1]}}
  - {kind: taxels, name: skin, body: bar, corner: [0, 0, 0], first: [0.1, 0, 0], second: [0, 0, 0.1], cells: [3, 2]}
joints:
  - {kind: universal, first: stone, point: [3, 0, 0], axis: [0, 2, 0], second_axis: [0, 0, 1], max_swing: 1, name: u}
  - {kind: planar, first: stone, second: palm}
welds:
  - {body: bar, rigid: palm, max_distance: 1e-4}
cavities:
  - {body: shell, pressure: {times: [0, 0.02], values: [0, 4e3]}, name: lung}
cables:
  - {points: [{body: bar, place: [-0.15, 0.05, 0]}, {body: bar, vertex: 19}, {place: [1, 0, 0]}], tension: 5,
     friction: 0.2}
"""


def in_python():
    return {
        "obstacles": [sp.obstacles.Torus(center=(0, -9, 0), axis=(0, 0, 2), radius=2, tube_radius=0.5)],
        "loads": [
            sp.Muscle(
                "bar", 2e4, (2, 0, 0), sp.Curve([0, 1], [0, 1]), sp.InBox((0, -1, -1), (1, 1, 1)), ([0.5, 1], [0, 1])
            ),
            sp.Growth("bar", sp.Curve([0, 1], [1, 1.2]), (0, 2, 0), [0, 2]),
            sp.Wind("bar", sp.Curve([0, 1], [[0, 0, 0], [9, 0, 0]]), drag=1.28, name="gust"),
        ],
        "sensors": [
            sp.ForceSensor("tip", "bar", region=sp.InBox((-1, 0.04, -1), (1, 1, 1))),
            sp.Taxels("skin", "bar", corner=(0, 0, 0), first=(0.1, 0, 0), second=(0, 0, 0.1), cells=(3, 2)),
        ],
        "joints": [
            sp.UniversalJoint("stone", point=(3, 0, 0), axis=(0, 2, 0), second_axis=(0, 0, 1), max_swing=1, name="u"),
            sp.PlanarJoint("stone", "palm"),
        ],
        "welds": [sp.Weld("bar", "palm", max_distance=1e-4)],
        "cavities": [sp.Cavity("shell", pressure=sp.Curve([0, 0.02], [0, 4e3]), name="lung")],
        "cables": [sp.Cable([("bar", (-0.15, 0.05, 0)), ("bar", 19), (None, (1, 0, 0))], tension=5, friction=0.2)],
    }


def test_a_file_describes_what_python_makes(load):
    read = load(FILE).scene
    made = sp.Scene(read.bodies, **in_python())
    for part in in_python():
        same(getattr(made, part), getattr(read, part), part)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("values: [0, 1]},\n", "values: [0, 1.5]},\n", r":14: .*activation"),
        ("cells: [3, 2]", "cells: [3]", r":20: sensors\[1\].cells"),
        ("second_axis: [0, 0, 1]", "second_axis: [0, 1, 1]", r":22: joints\[0\].axis: joint 'u': .* at 45 degrees"),
        ("1e-4}", "1e-4, vertices: [0]}", r":25: welds\[0\].*give the vertices by one of"),
        ("4e3]}, name", "4e3]}, volume: 1, name", r":27: .*pressure and volume given"),
    ],
)
def test_errors_name_their_line(load, old, new, message):
    assert FILE.count(old) == 1
    with pytest.raises(sp.SceneError, match=message):
        load(FILE.replace(old, new))
