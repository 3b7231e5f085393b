"""Rigid bodies in scene files."""

import json

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import supple as sp
from supple.app.cli.app import main
from supple.app.scene_file.document import json_schema
from supple.app.scene_file.loader import load_run
from supple.app.scene_file.resolved import resolved_scene
from supple.app.scene_file.yaml_files import read_yaml

SCENE = """\
bodies:
  - name: palm
    shape: {kind: box, size: [0.1, 0.1, 0.1], divisions: [1, 1, 1]}
    rigid: {density: 2700}
    position: [0, 0.5, 0]
    friction: 0.4
  - name: stone
    mesh: {file: stone.stl, scale: 0.001}
    rigid: {mass: 2, inertia: [[2, 0, 0], [0, 3, 0], [0, 0, 4]], stiffness: 1e7}
    copies: {offsets: [[1, 0, 0], [2, 0, 0]]}
  - name: jelly
    shape: {kind: box, size: [0.1, 0.1, 0.1], divisions: [1, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.3}
    position: [0, -1, 0]
pins:
  - body: palm
    motion: {times: [0, 1], angles: [0, 1], axis: [0, 1, 0]}
solver: {kind: implicit}
steps: 3
"""


@pytest.fixture
def scene_file(tmp_path):
    sp.shapes.sphere_surface(100.0, 50.0).save(tmp_path / "stone.stl")
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    return path


def test_a_scene_file_describes_rigid_bodies(scene_file):
    run = load_run(scene_file)
    palm, first, second, jelly = run.scene.bodies
    assert palm.properties.mass == pytest.approx(2.7)
    assert palm.friction == 0.4
    assert len(palm.points) == 8
    assert [first.name, second.name] == ["stone01", "stone02"]
    np.testing.assert_allclose(second.properties.inertia, np.diag([2.0, 3.0, 4.0]), atol=1e-14)
    assert (second.kappa, second.properties.mass, second.position[0]) == (1e7, 2.0, 2.0)
    assert np.abs(first.points).max() == pytest.approx(0.1, rel=0.03)
    assert isinstance(jelly, sp.Body)
    frames = list(sp.simulate(run.scene, run.solver, run.dt, run.steps))
    angle = frames[-1].time
    rotation = frames[-1].poses["palm"].rotation
    np.testing.assert_allclose(rotation[0], [np.cos(angle), 0.0, np.sin(angle)], atol=1e-12)


def test_the_schema_and_the_resolved_file_know_them(scene_file, tmp_path):
    assert not list(Draft202012Validator(json_schema()).iter_errors(read_yaml(scene_file).data))
    files = resolved_scene(load_run(scene_file), solver=None, dt=0.01, steps=2)
    copy = tmp_path / "copy"
    copy.mkdir()
    for name, content in files.items():
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        (copy / name).write_bytes(content.encode() if isinstance(content, str) else content.read_bytes())
    again = load_run(copy / "scene.yaml")
    assert [body.name for body in again.scene.bodies] == ["palm", "stone01", "stone02", "jelly"]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("density: 2700", "densty: 2700", "4: bodies[0].rigid.densty: unknown key; did you mean 'density'?"),
        ("{density: 2700}", "{}", "4: bodies[0].rigid: a rigid body needs either `density` or `mass`; give one"),
        ("mass: 2,", "density: 2,", "9: bodies[1].rigid.inertia: rigid body 'stone': inertia needs a mass"),
        ("[0, 0, 4]", "[0, 0, 6]", "9: bodies[1].rigid.inertia: rigid body 'stone': inertia has the principal moments"),
        (
            "    rigid: {density: 2700}\n",
            "",
            "2: bodies[0]: a body needs either `material`, `rigid`, `shell` or `rod`; give one of them",
        ),
        ("    friction: 0.4\n", "    initial: {scale: [1, 2, 1]}\n", "2: bodies[0]: a rigid body has no `initial`"),
        ("body: palm\n", "body: palm\n    vertices: [0]\n", "pin of body 'palm': a rigid body is held as a whole"),
        ("body: palm\n", "body: jelly\n", "pin of body 'jelly': give the vertices by either `vertices` or `box`"),
    ],
)
def test_errors_are_one_line_with_place_and_fault(scene_file, old, new, expected):
    assert SCENE.count(old) == 1
    scene_file.write_text(SCENE.replace(old, new))
    with pytest.raises(sp.SceneError) as caught:
        load_run(scene_file)
    assert expected in str(caught.value)


def test_info_and_run_and_check(scene_file, capsys):
    assert main(["info", str(scene_file)]) in (0, None)
    out = " ".join(capsys.readouterr().out.split())
    assert "rigid, 12 triangles, 0.001 m^3, 2.7 kg, principal moments of inertia 0.0045, 0.0045, 0.0045" in out
    folder = scene_file.parent / "out"
    assert main(["run", str(scene_file), "-o", str(folder), "--quiet"]) in (0, None)
    assert main(["check", str(folder / "recording.vtkhdf"), "--only", "rigidity"]) in (0, None)
    assert "pass" in capsys.readouterr().out
    text = json.dumps(sp.check_recording(folder / "recording.vtkhdf")["rigidity"].message)
    assert "largest error" in text
