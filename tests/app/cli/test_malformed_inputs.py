"""Malformed input to the shell: one clear line on stderr, exit code 2, no traceback, and no files left.

Readers and scene files have their own cases: tests/mesh/test_malformed_mesh_files.py, tests/app/scene_file.
"""

import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.console import ExitCode

RUBBER = "{kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}"


def scene(top="", mesh="shape: {kind: box, divisions: [1, 1, 1]}", material=RUBBER):
    return f"bodies:\n  - {{name: a, {mesh}, material: {material}}}\n{top}".encode()


def obj(vertices, faces):
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + ["f " + " ".join(str(i + 1) for i in f) for f in faces]
    return "\n".join(lines).encode()


CUBE = sp.shapes.box((1, 1, 1), (1, 1, 1)).surface
POINTS, FACES = CUBE.vertices.tolist(), CUBE.triangles.tolist()
OPEN_CUBE = obj(POINTS, FACES[1:])

NODE = b"4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
ELE = b"1 4 0\n1 1 2 3 4\n"


def tets(node=NODE, ele=ELE):
    return {"t.node": node, "t.ele": ele}


# name: (files, arguments)
CASES = {
    # surfaces
    "no such surface": ({}, ["info", "absent.stl"]),
    "a folder as surface": ({"d.stl/x": b""}, ["info", "d.stl"]),
    "garbage stl": ({"a.stl": bytes(range(256)) * 8}, ["info", "a.stl"]),
    "obj index out of range": ({"a.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"}, ["info", "a.obj"]),
    "no extension": ({"a": b"x"}, ["info", "a"]),
    # meshing
    "meshing what is absent": ({}, ["mesh", "absent.stl", "-o", "o.1.node"]),
    "meshing an open surface": ({"a.obj": OPEN_CUBE}, ["mesh", "a.obj", "-o", "o.1.node", "--mesher", "tetgen"]),
    "meshing to a wrong extension": ({"a.obj": obj(POINTS, FACES)}, ["mesh", "a.obj", "-o", "o.stl"]),
    "meshing into no folder": ({"a.obj": obj(POINTS, FACES)}, ["mesh", "a.obj", "-o", "no/where/o.1.node"]),
    "meshing with a volume that is not a number": (
        {"a.obj": obj(POINTS, FACES)},
        ["mesh", "a.obj", "-o", "o.1.node", "--max-volume", "small"],
    ),
    "meshing with more tets than memory": (
        {"a.obj": obj(POINTS, FACES)},
        ["mesh", "a.obj", "-o", "o.1.node", "--tets", "99999999999"],
    ),
    # tet meshes
    "no ele": ({"t.node": NODE}, ["info", "t.node"]),
    "node with a huge count": (tets(node=NODE.replace(b"4 3 0 0", b"4000000000000 3 0 0")), ["info", "t.node"]),
    "a flat tet": (tets(node=NODE.replace(b"4 0 0 1", b"4 1 1 0")), ["info", "t.node"]),
    # scene files
    "no such scene": ({}, ["run", "absent.yaml"]),
    "a folder as scene": ({"d.yaml/x": b""}, ["run", "d.yaml"]),
    "garbage scene": ({"s.yaml": bytes(range(256))}, ["run", "s.yaml"]),
    "scene with a key twice": ({"s.yaml": scene(top="dt: 0.1\ndt: 0.2\n")}, ["run", "s.yaml"]),
    "scene with an unknown key": ({"s.yaml": scene(top="grvity: [0, 0, 0]\n")}, ["run", "s.yaml"]),
    "scene with code in it": ({"s.yaml": b"bodies: !!python/object/apply:os.system ['true']\n"}, ["run", "s.yaml"]),
    "scene without bodies": ({"s.yaml": b"steps: 3\n"}, ["run", "s.yaml"]),
    "a missing mesh": ({"s.yaml": scene(mesh="mesh: {file: absent.stl}")}, ["run", "s.yaml"]),
    "a shape of a billion cells": (
        {"s.yaml": scene(mesh="shape: {kind: box, divisions: [1000, 1000, 1000]}")},
        ["run", "s.yaml"],
    ),
    "too many steps": ({"s.yaml": scene(top="steps: 1000000000000\n")}, ["run", "s.yaml"]),
    # recordings
    "info of a recording of garbage": ({"r.vtkhdf": bytes(range(256))}, ["info", "r.vtkhdf"]),
    "info of no recording": ({}, ["info", "absent.vtkhdf"]),
    "export of no recording": ({}, ["export", "absent.vtkhdf", "--to", "obj"]),
    "export of an empty file": ({"r.vtkhdf": b""}, ["export", "r.vtkhdf", "--to", "obj"]),
    "plot of garbage": ({"r.vtkhdf": b"\x89HDF\r\n\x1a\n" + bytes(200)}, ["plot", "r.vtkhdf"]),
    # the command line
    "an unknown command": ({}, ["runn", "s.yaml"]),
    "an unknown option": ({"s.yaml": scene()}, ["run", "s.yaml", "--stepz", "3"]),
    "a missing argument": ({}, ["run"]),
    "steps that are no number": ({"s.yaml": scene()}, ["run", "s.yaml", "--steps", "many"]),
    "negative steps": ({"s.yaml": scene()}, ["run", "s.yaml", "--steps", "-3"]),
    "more steps than a scene file may have": ({"s.yaml": scene()}, ["run", "s.yaml", "--steps", "9" * 30]),
    "a new scene of a name that is not in UTF-8": ({}, ["new", "\udcff.yaml"]),
    "a surface of a name that is not in UTF-8": ({}, ["new", "s.yaml", "--surface", "\udcff.stl"]),
    "a scene of a name that is not in UTF-8": ({}, ["run", "\udcff.yaml"]),
    "a recording of a name that is not in UTF-8": ({}, ["plot", "\udcff.vtkhdf"]),
    "dt of zero": ({"s.yaml": scene()}, ["run", "s.yaml", "--dt", "0"]),
    "dt of nan": ({"s.yaml": scene()}, ["run", "s.yaml", "--dt", "nan"]),
    "an unknown solver on the command line": ({"s.yaml": scene()}, ["run", "s.yaml", "--solver", "magic"]),
    "an unknown demo": ({}, ["demo", "squish"]),
    "an unknown solver of a demo": ({}, ["demo", "squash", "--solver", "magic"]),
    "output onto a file": ({"s.yaml": scene(), "out": b""}, ["run", "s.yaml", "-o", "out"]),
    "output below a file": ({"s.yaml": scene(), "out": b""}, ["run", "s.yaml", "-o", "out/deeper"]),
    "schema onto a folder": ({"d/x": b""}, ["schema", "-o", "d"]),
}


def listing(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.mark.parametrize("case", CASES)
def test_a_malformed_input_is_one_line_with_exit_code_2_and_no_files(case, tmp_path, monkeypatch, capfd, caplog):
    files, arguments = CASES[case]
    for name, content in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    monkeypatch.chdir(tmp_path)
    before = listing(tmp_path)
    code = main(arguments)
    out, err = capfd.readouterr()
    assert code == ExitCode.INPUT, err
    assert err.startswith("supple: ")
    assert err.count("\n") == 1, err
    assert err.endswith("\n")
    assert len(err) < 600
    assert "Traceback" not in err
    assert err.strip().isprintable()
    assert out == ""
    assert listing(tmp_path) == before


def test_one_tet_is_a_mesh(tmp_path, monkeypatch, capfd):
    for name, content in tets().items():
        (tmp_path / name).write_bytes(content)
    monkeypatch.chdir(tmp_path)
    assert main(["info", "t.node"]) == ExitCode.OK
    assert "0.166667 m^3" in capfd.readouterr().out


def test_inverted_tets_are_reoriented(tmp_path, monkeypatch, capfd):
    for name, content in tets(ele=b"1 4 0\n1 1 2 4 3\n").items():
        (tmp_path / name).write_bytes(content)
    monkeypatch.chdir(tmp_path)
    assert main(["info", "t.ele"]) == ExitCode.OK
    out = capfd.readouterr().out
    assert [line.split()[-1] for line in out.splitlines() if line.startswith("tets reoriented")] == ["1"]
