"""Malformed input to the shell: one clear line on stderr, exit code 2, no traceback, and no files left."""

import struct

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.console import ExitCode

RUBBER = "{kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}"


def scene(body_changes="", top="", mesh="shape: {kind: box, divisions: [1, 1, 1]}", material=RUBBER):
    return f"bodies:\n  - {{name: a, {mesh}, material: {material}{body_changes}}}\n{top}".encode()


def stl(triangles, count=None):
    """A binary STL file; its header may have a false number of triangles."""
    triangles = np.asarray(triangles, dtype=np.float32)
    rows = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in triangles)
    return b"\0" * 80 + struct.pack("<I", len(triangles) if count is None else count) + rows


def obj(vertices, faces):
    lines = [f"v {x} {y} {z}" for x, y, z in vertices] + ["f " + " ".join(str(i + 1) for i in f) for f in faces]
    return "\n".join(lines).encode()


CUBE = sp.shapes.box((1, 1, 1), (1, 1, 1)).surface
POINTS, FACES = CUBE.vertices.tolist(), CUBE.triangles.tolist()
CROSSING = POINTS + (CUBE.vertices * 0.5 + [0.5, 0, 0]).tolist()
OPEN_CUBE = obj(POINTS, FACES[1:])
FIN = obj([*POINTS, [3, 3, 3]], [*FACES, [FACES[0][0], FACES[0][1], 8]])
TWO_CUBES_CROSSING = obj(CROSSING, FACES + (np.array(FACES) + 8).tolist())
FLAT = obj([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2], [0, 2, 1], [1, 2, 3]])

NODE = b"4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
ELE = b"1 4 0\n1 1 2 3 4\n"
PLY = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
OFF = b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


def tets(node=NODE, ele=ELE):
    return {"t.node": node, "t.ele": ele}


# name: (files, arguments)
CASES = {
    # surfaces
    "no such surface": ({}, ["info", "absent.stl"]),
    "a folder as surface": ({"d.stl/x": b""}, ["info", "d.stl"]),
    "empty stl": ({"a.stl": b""}, ["info", "a.stl"]),
    "empty obj": ({"a.obj": b""}, ["info", "a.obj"]),
    "garbage stl": ({"a.stl": bytes(range(256)) * 8}, ["info", "a.stl"]),
    "garbage obj": ({"a.obj": bytes(range(256)) * 8}, ["info", "a.obj"]),
    "garbage ply": ({"a.ply": bytes(range(256)) * 8}, ["info", "a.ply"]),
    "garbage off": ({"a.off": bytes(range(256)) * 8}, ["info", "a.off"]),
    "garbage vtp": ({"a.vtp": bytes(range(256)) * 8}, ["info", "a.vtp"]),
    "garbage vtu": ({"a.vtu": bytes(range(256)) * 8}, ["info", "a.vtu"]),
    "garbage vtk": ({"a.vtk": bytes(range(256)) * 8}, ["info", "a.vtk"]),
    "garbage msh": ({"a.msh": bytes(range(256)) * 8}, ["info", "a.msh"]),
    "truncated stl": ({"a.stl": stl(CUBE.vertices[CUBE.triangles])[:-30]}, ["info", "a.stl"]),
    "stl of four billion triangles": (
        {"a.stl": stl([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], 2**32 - 1)},
        ["info", "a.stl"],
    ),
    "nan in stl": ({"a.stl": stl([[[0, 0, 0], [1, 0, np.nan], [0, 1, 0]]])}, ["info", "a.stl"]),
    "stl without area": ({"a.stl": stl([[[1, 1, 1]] * 3])}, ["info", "a.stl"]),
    "obj index out of range": ({"a.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"}, ["info", "a.obj"]),
    "obj index zero": ({"a.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"}, ["info", "a.obj"]),
    "obj with words for numbers": ({"a.obj": b"v 0 zero 0\nf 1 1 1\n"}, ["info", "a.obj"]),
    "obj with infinity": ({"a.obj": b"v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n"}, ["info", "a.obj"]),
    "obj of points only": ({"a.obj": b"v 0 0 0\nv 1 0 0\n"}, ["info", "a.obj"]),
    "ply with a negative count": (
        {"a.ply": PLY.replace(b"vertex 3", b"vertex -3") + b"end_header\n"},
        ["info", "a.ply"],
    ),
    "ply with a huge count": (
        {"a.ply": PLY.replace(b"vertex 3", b"vertex 99999999999999") + b"end_header\n"},
        ["info", "a.ply"],
    ),
    "ply cut off": ({"a.ply": PLY + b"end_header\n0 0 0\n1 0"}, ["info", "a.ply"]),
    "ply without end of header": ({"a.ply": PLY}, ["info", "a.ply"]),
    "off with a wrong index": ({"a.off": OFF.replace(b"3 0 1 2", b"3 0 1 7")}, ["info", "a.off"]),
    "off with a huge count": ({"a.off": OFF.replace(b"3 1 0\n", b"3 9999999999 0\n", 1)}, ["info", "a.off"]),
    "wrong extension": ({"a.jpg": b"\xff\xd8"}, ["info", "a.jpg"]),
    "no extension": ({"a": b"x"}, ["info", "a"]),
    # meshing
    "meshing what is absent": ({}, ["mesh", "absent.stl", "-o", "o.1.node"]),
    "meshing an open surface": ({"a.obj": OPEN_CUBE}, ["mesh", "a.obj", "-o", "o.1.node", "--mesher", "tetgen"]),
    "meshing a non-manifold surface": ({"a.obj": FIN}, ["mesh", "a.obj", "-o", "o.1.node", "--mesher", "tetgen"]),
    "meshing a self-intersecting surface": (
        {"a.obj": TWO_CUBES_CROSSING},
        ["mesh", "a.obj", "-o", "o.1.node", "--mesher", "tetgen"],
    ),
    "meshing a flat surface": ({"a.obj": FLAT}, ["mesh", "a.obj", "-o", "o.1.node", "--mesher", "tetgen"]),
    "meshing to a wrong extension": ({"a.obj": obj(POINTS, FACES)}, ["mesh", "a.obj", "-o", "o.stl"]),
    "meshing into no folder": ({"a.obj": obj(POINTS, FACES)}, ["mesh", "a.obj", "-o", "no/where/o.1.node"]),
    "meshing with a negative volume": (
        {"a.obj": obj(POINTS, FACES)},
        ["mesh", "a.obj", "-o", "o.1.node", "--max-volume", "-1"],
    ),
    "meshing with a volume that is not a number": (
        {"a.obj": obj(POINTS, FACES)},
        ["mesh", "a.obj", "-o", "o.1.node", "--max-volume", "small"],
    ),
    "meshing with nan quality": (
        {"a.obj": obj(POINTS, FACES)},
        ["mesh", "a.obj", "-o", "o.1.node", "--quality", "nan"],
    ),
    "meshing with more tets than memory": (
        {"a.obj": obj(POINTS, FACES)},
        ["mesh", "a.obj", "-o", "o.1.node", "--tets", "99999999999"],
    ),
    "meshing with edges of atoms": (
        {"a.obj": obj(POINTS, FACES)},
        ["mesh", "a.obj", "-o", "o.1.node", "--edge", "1e-300"],
    ),
    "meshing with half a tet": ({"a.obj": obj(POINTS, FACES)}, ["mesh", "a.obj", "-o", "o.1.node", "--tets", "1.5"]),
    # tet meshes
    "no ele": ({"t.node": NODE}, ["info", "t.node"]),
    "no node": ({"t.ele": ELE}, ["info", "t.ele"]),
    "empty node": (tets(node=b""), ["info", "t.node"]),
    "node of words": (tets(node=b"four three 0 0\n"), ["info", "t.node"]),
    "node with a negative count": (tets(node=NODE.replace(b"4 3 0 0", b"-4 3 0 0")), ["info", "t.node"]),
    "node with a huge count": (tets(node=NODE.replace(b"4 3 0 0", b"4000000000000 3 0 0")), ["info", "t.node"]),
    "node in two dimensions": (tets(node=NODE.replace(b"4 3 0 0", b"4 2 0 0")), ["info", "t.node"]),
    "node cut off": (tets(node=NODE[:-8]), ["info", "t.node"]),
    "node with nan": (tets(node=NODE.replace(b"4 0 0 1", b"4 0 0 nan")), ["info", "t.node"]),
    "node with a huge number": (tets(node=NODE.replace(b"4 0 0 1", b"4 0 0 1e200")), ["info", "t.node"]),
    "ele with a wrong index": (tets(ele=b"1 4 0\n1 1 2 3 9\n"), ["info", "t.node"]),
    "ele with a negative index": (tets(ele=b"1 4 0\n1 1 2 3 -4\n"), ["info", "t.node"]),
    "ele with a vertex twice": (tets(ele=b"1 4 0\n1 1 2 3 3\n"), ["info", "t.node"]),
    "ele with a huge count": (tets(ele=b"999999999999 4 0\n1 1 2 3 4\n"), ["info", "t.node"]),
    "ele with nine corners": (tets(ele=b"1 9 0\n1 1 2 3 4\n"), ["info", "t.node"]),
    "ele of garbage": (tets(ele=bytes(range(256))), ["info", "t.node"]),
    "a flat tet": (tets(node=NODE.replace(b"4 0 0 1", b"4 1 1 0")), ["info", "t.node"]),
    "the same tet twice": (tets(ele=b"2 4 0\n1 1 2 3 4\n2 1 2 3 4\n"), ["info", "t.node"]),
    "msh cut off": ({"a.msh": b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4"}, ["info", "a.msh"]),
    # scene files
    "no such scene": ({}, ["run", "absent.yaml"]),
    "a folder as scene": ({"d.yaml/x": b""}, ["run", "d.yaml"]),
    "empty scene": ({"s.yaml": b""}, ["run", "s.yaml"]),
    "garbage scene": ({"s.yaml": bytes(range(256))}, ["run", "s.yaml"]),
    "scene not in UTF-8": ({"s.yaml": b"# caf\xe9\n" + scene()}, ["run", "s.yaml"]),
    "scene with a tab": ({"s.yaml": b"bodies:\n\t- a\n"}, ["run", "s.yaml"]),
    "scene cut off": ({"s.yaml": scene()[:-12]}, ["run", "s.yaml"]),
    "scene with a key twice": ({"s.yaml": scene(top="dt: 0.1\ndt: 0.2\n")}, ["run", "s.yaml"]),
    "scene with an unknown key": ({"s.yaml": scene(top="grvity: [0, 0, 0]\n")}, ["run", "s.yaml"]),
    "scene with code in it": ({"s.yaml": b"bodies: !!python/object/apply:os.system ['true']\n"}, ["run", "s.yaml"]),
    "scene with an alias bomb": (
        {
            "s.yaml": b"a: &a [x,x,x,x,x,x,x,x,x]\n"
            + b"".join(b"%c: &%c [%s]\n" % (c, c, b",".join([b"*%c" % (c - 1)] * 9)) for c in range(98, 108))
        },
        ["run", "s.yaml"],
    ),
    "scene without bodies": ({"s.yaml": b"steps: 3\n"}, ["run", "s.yaml"]),
    "negative density": ({"s.yaml": scene(material=RUBBER[:-1] + ", density: -1}")}, ["run", "s.yaml"]),
    "nan stiffness": ({"s.yaml": scene(material=RUBBER.replace("1e5", ".nan"))}, ["run", "s.yaml"]),
    "incompressible": ({"s.yaml": scene(material=RUBBER.replace("0.4", "0.5"))}, ["run", "s.yaml"]),
    "two bodies of one name": ({"s.yaml": scene() + scene().partition(b"\n")[2]}, ["run", "s.yaml"]),
    "a missing mesh": ({"s.yaml": scene(mesh="mesh: {file: absent.stl}")}, ["run", "s.yaml"]),
    "an open mesh": (
        {"s.yaml": scene(mesh="mesh: {file: a.obj, mesher: tetgen}"), "a.obj": OPEN_CUBE},
        ["run", "s.yaml"],
    ),
    "a shape of a billion cells": (
        {"s.yaml": scene(mesh="shape: {kind: box, divisions: [1000, 1000, 1000]}")},
        ["run", "s.yaml"],
    ),
    "a sphere of dust": ({"s.yaml": scene(mesh="shape: {kind: sphere, edge_length: 1e-9}")}, ["run", "s.yaml"]),
    "a pin beyond the mesh": ({"s.yaml": scene(top="pins: [{body: a, vertices: [99]}]\n")}, ["run", "s.yaml"]),
    "a pin of an unknown body": ({"s.yaml": scene(top="pins: [{body: b, vertices: [0]}]\n")}, ["run", "s.yaml"]),
    "keyframes that go back": (
        {"s.yaml": scene(top="pins: [{body: a, vertices: [0], motion: {times: [1, 0], angles: [0, 1]}}]\n")},
        ["run", "s.yaml"],
    ),
    "too many steps": ({"s.yaml": scene(top="steps: 1000000000000\n")}, ["run", "s.yaml"]),
    "an unknown solver": ({"s.yaml": scene(top="solver: {kind: magic}\n")}, ["run", "s.yaml"]),
    # recordings
    "info of a recording of garbage": ({"r.vtkhdf": bytes(range(256))}, ["info", "r.vtkhdf"]),
    "info of no recording": ({}, ["info", "absent.vtkhdf"]),
    "export of no recording": ({}, ["export", "absent.vtkhdf", "--to", "obj"]),
    "export of garbage": ({"r.vtkhdf": bytes(range(256))}, ["export", "r.vtkhdf", "--to", "obj"]),
    "export of an empty file": ({"r.vtkhdf": b""}, ["export", "r.vtkhdf", "--to", "obj"]),
    "plot of no recording": ({}, ["plot", "absent.vtkhdf"]),
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


def test_there_are_enough_cases():
    assert len(CASES) >= 60


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
