"""Scene files read nothing outside their folder where they are confined to it, and run no code."""

import os

import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.scene_file.loader import load_run
from supple.errors import SceneError, SuppleError

SCENE = """
bodies:
  - name: cube
    {source}
    material: {{kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}}
"""


@pytest.fixture
def place(tmp_path):
    """A folder with a scene and meshes inside and outside of it."""
    home = tmp_path / "home"
    (home / "meshes").mkdir(parents=True)
    cube = sp.shapes.box((1, 1, 1), (1, 1, 1))
    cube.save(tmp_path / "outside.msh")
    cube.save(tmp_path / "outside.1.ele")
    cube.save(home / "meshes" / "inside.msh")
    cube.save(home / "family.1.ele")
    cube.surface.save(tmp_path / "outside.stl")
    return home


def load(home, source):
    path = home / "scene.yaml"
    path.write_text(SCENE.format(source=source))
    return load_run(path, confine=True)


@pytest.mark.parametrize(
    "file", ["meshes/inside.msh", "./meshes/../meshes/inside.msh", "family.1.ele", "family.1.node"]
)
def test_files_inside_are_read(place, file):
    assert len(load(place, f"mesh: {{file: {file}}}").scene.body("cube").mesh.tets) == 6


def outward(place):
    (place / "link.msh").symlink_to(place.parent / "outside.msh")
    (place / "folder").symlink_to(place.parent)
    (place / "half.1.ele").write_bytes((place / "family.1.ele").read_bytes())
    (place / "half.1.node").symlink_to(place.parent / "outside.1.node")
    return [
        "../outside.msh",
        "meshes/../../outside.msh",
        str(place.parent / "outside.msh"),
        str(place / "meshes" / "inside.msh"),  # no absolute path, not even to the folder
        "link.msh",
        "folder/outside.msh",
        "half.1.ele",
        "../outside.stl",
        "/etc/passwd",
        "/dev/zero",
        "//etc/passwd",
        "~/.ssh/id_rsa",
    ]


def test_files_outside_are_not_read(place):
    for file in outward(place):
        with pytest.raises(SceneError) as caught:
            load(place, f'mesh: {{file: "{file}"}}')
        assert "outside the scene file's folder" in str(caught.value) or file.startswith("~"), file
        assert "root:" not in str(caught.value)
        with pytest.raises(SceneError):
            load(place, f'shape: {{kind: box}}\n    skin: {{file: "{file}"}}')


def test_a_run_from_the_shell_reads_any_file(place):
    path = place / "scene.yaml"
    path.write_text(SCENE.format(source="mesh: {file: ../outside.msh}"))
    assert load_run(path).scene.body("cube")


ROBOT = (
    '<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
    '<collision><geometry><mesh filename="{file}"/></geometry></collision></link></robot>'
)


def test_a_robot_reads_nothing_outside_its_folder(place):
    (place / "link.stl").symlink_to(place.parent / "outside.stl")
    sp.shapes.box_surface((1, 1, 1), (1, 1, 1)).save(place / "meshes" / "inside.stl")
    path = place / "robot.urdf"
    for file in ("../outside.stl", str(place.parent / "outside.stl"), "link.stl", "package://outside.stl"):
        path.write_text(ROBOT.format(file=file))
        assert len(sp.load_scene(path).body("a").triangles) == 12
        with pytest.raises(SceneError, match=r"robot.urdf:1: link 'a': .*outside the scene file's folder"):
            sp.load_scene(path, confine=True)
    path.write_text(ROBOT.format(file="package://home/meshes/inside.stl"))
    assert len(sp.load_scene(path, confine=True).body("a").triangles) == 12


@pytest.mark.parametrize("command", ["run", "info", "view"])
def test_commands_are_confined(place, command, monkeypatch, capsys):
    """`run` and `info` where they are asked to, `view` where it is not asked not to."""
    shown = []
    monkeypatch.setattr("supple.app.cli.commands.view.serve_page", lambda read, *_, **__: shown.append(read()))
    path = place / "scene.yaml"
    path.write_text(SCENE.format(source="mesh: {file: ../outside.msh}"))
    more = ["-o", str(place / "out"), "--steps", "0", "-q", "--no-page", "--no-plot"] if command == "run" else []
    confined, free = ([], ["--no-confine"]) if command == "view" else (["--confine"], [])
    assert main([command, str(path), *more, *confined]) == 2
    assert (
        "scene.yaml:4: bodies[0].mesh.file: ../outside.msh is outside the scene file's folder"
        in capsys.readouterr().err
    )
    assert main([command, str(path), *more, *free]) in (0, None)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_an_error_without_waiting_for_it(place):
    os.mkfifo(place / "pipe.msh")
    with pytest.raises(SceneError, match="not a regular file"):
        load(place, "mesh: {file: pipe.msh}")


@pytest.mark.parametrize(
    "text",
    [
        "!!python/object/apply:os.system ['touch {marker}']",
        "!!python/object/new:subprocess.Popen [['touch', '{marker}']]",
        "!!python/name:os.system",
        "bodies: !!python/module:os",
        "bodies: &a [*a]",
        "bodies: [{{name: !!python/tuple [1], shape: {{kind: box}}}}]",
        "a: &a [x,x,x,x,x,x,x,x,x]\nb: &b [*a,*a,*a,*a,*a,*a,*a,*a,*a]\nc: &c [*b,*b,*b,*b,*b,*b,*b,*b,*b]\n"
        "d: &d [*c,*c,*c,*c,*c,*c,*c,*c,*c]\ne: &e [*d,*d,*d,*d,*d,*d,*d,*d,*d]\nf: &f [*e,*e,*e,*e,*e,*e,*e,*e]\n"
        "bodies: [*f,*f,*f,*f,*f,*f,*f,*f,*f]",
        "bodies: " + "[" * 100_000,
        "\0\1\2",
    ],
)
def test_hostile_files_are_errors_and_run_no_code(tmp_path, text):
    marker, path = tmp_path / "marker", tmp_path / "scene.yaml"
    path.write_text(text.replace("{marker}", str(marker)))
    with pytest.raises(SuppleError):
        load_run(path, confine=True)
    assert not marker.exists()
