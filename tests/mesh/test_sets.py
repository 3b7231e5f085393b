"""Named sets of .inp and .msh files, against the geometry of the mesh that they are of."""

import struct

import meshio
import numpy as np
import pytest

import supple as sp
from supple.errors import MeshError

MESH = sp.shapes.box((2, 1, 1), (2, 1, 1))
LEFT = np.flatnonzero(MESH.vertices[:, 0] < -0.99)
BONE = np.flatnonzero(MESH.vertices[MESH.tets].mean(axis=1)[:, 0] > 0)
TRIANGLES = MESH.surface.triangles[(MESH.vertices[MESH.surface.triangles][:, :, 0] < -0.99).all(axis=1)]


def abaqus() -> str:
    """The mesh with numbers that are neither ordered nor without gaps, and a node that belongs to no tet."""
    tag = 1000 - 7 * np.arange(len(MESH.vertices))
    rows = [f"{t}, {x}, {y}, {z}" for t, (x, y, z) in zip(tag, MESH.vertices, strict=True)]
    left, soft = tag[LEFT], np.setdiff1d(np.arange(len(MESH.tets)), BONE)

    def elements(tets):
        return [f"{2 * k + 5}, {', '.join(str(tag[i]) for i in MESH.tets[k])}" for k in tets]

    lines = ["*Heading", "** a comment", "*Node, nset=all", "2000, 9., 9., 9.", *rows]
    lines += ["*Element, type=S3, elset=SKIN", f"900, {left[0]}, {left[1]}, {left[2]}"]
    lines += [
        "*ELEMENT, TYPE=C3D4, ELSET=soft",
        *elements(soft),
        "*ELEMENT, TYPE=C3D4,",
        " ELSET=Bone",
        *elements(BONE),
    ]
    lines += ["*Nset, nset=Left, internal", ", ".join(map(str, left[:2])) + ",", ", ".join(map(str, left[2:]))]
    lines += ["*Nset, nset=Held", "left,", "*Elset, elset=every, generate", f"5, {2 * len(MESH.tets) + 5}, 2"]
    lines += ["*Nset, nset=alone", "2000"]
    return "\n".join(lines) + "\n"


ORDER = [*np.setdiff1d(np.arange(len(MESH.tets)), BONE), *BONE]  # of the tets in that file


def test_sets_of_abaqus(tmp_path):
    path = tmp_path / "a.inp"
    path.write_text(abaqus())
    sets = sp.TetMesh.load(path).sets
    assert sets.tet_count == len(MESH.tets)
    for name in ("Left", "LEFT", "held"):
        np.testing.assert_array_equal(sets.vertices_of(name), LEFT)
    assert len(sets.vertices_of("all")) == len(MESH.vertices)
    assert "alone" not in sets.vertices, "it has no vertex of the mesh"
    assert [ORDER[k] for k in sets.tets_of("bone")] == BONE.tolist()
    assert len(sets.tets_of("every")) == len(MESH.tets)
    np.testing.assert_array_equal(sets.vertices_of("Bone"), np.unique(MESH.tets[BONE]))
    index = sets.regions(["soft", "bone"])
    assert [index[k] for k in range(len(index))] == [2 if ORDER[k] in BONE else 1 for k in range(len(index))]
    assert repr(sets).startswith("MeshSets(vertices: all (12), Left (4), Held (4)")


def gmsh_2(path, binary):
    groups = np.isin(np.arange(len(MESH.tets)), BONE) + 1
    mesh = meshio.Mesh(
        MESH.vertices,
        [("triangle", TRIANGLES), ("tetra", MESH.tets)],
        cell_data={
            "gmsh:physical": [np.full(len(TRIANGLES), 7), groups],
            "gmsh:geometrical": [np.full(len(TRIANGLES), 1), groups],
        },
        field_data={"left": np.array([7, 2]), "soft": np.array([1, 3]), "bone": np.array([2, 3])},
    )
    meshio.write(path, mesh, file_format="gmsh22", binary=binary)


NAMES = '$PhysicalNames\n4\n2 7 "left"\n3 1 "soft"\n3 2 "bone"\n3 3 "inside bone"\n$EndPhysicalNames\n'


def gmsh_41(path, binary):
    """As Gmsh writes it: two volumes, one of which has two groups, and a surface."""
    text = bytearray(f"$MeshFormat\n4.1 {int(binary)} 8\n".encode())
    if binary:
        text += struct.pack("<i", 1) + b"\n"
    text += (
        b'$EndMeshFormat\n$PhysicalNames\n4\n2 7 "left"\n3 1 "soft"\n3 2 "bone"\n3 3 "inside bone"\n$EndPhysicalNames\n'
    )

    def put(kinds: str, *values: float) -> None:
        if binary:
            text.extend(struct.pack("<" + kinds.replace("n", "q"), *values))
        else:
            text.extend((" ".join(map(repr, values)) + "\n").encode())

    text += b"$Entities\n"
    put("nnnn", 1, 0, 1, 2)
    put("idddn", 1, 0.0, 0.0, 0.0, 0)
    put("iddddddnin", 4, *[0.0] * 6, 1, 7, 0)
    put("iddddddninii", 5, *[0.0] * 6, 1, 1, 2, 4, -4)
    put("iddddddniin", 6, *[0.0] * 6, 2, 2, 3, 0)
    text += b"\n$EndEntities\n$Nodes\n" if binary else b"$EndEntities\n$Nodes\n"
    count = len(MESH.vertices)
    put("nnnn", 1, count, 1, count)
    put("iiin", 3, 5, 0, count)
    put("n" * count, *range(1, count + 1))
    put("d" * 3 * count, *MESH.vertices.ravel().tolist())
    text += b"\n$EndNodes\n$Elements\n" if binary else b"$EndNodes\n$Elements\n"
    soft = np.setdiff1d(np.arange(len(MESH.tets)), BONE)
    blocks = [(2, 4, 2, TRIANGLES), (3, 5, 4, MESH.tets[soft]), (3, 6, 4, MESH.tets[BONE])]
    put("nnnn", 3, sum(len(b[3]) for b in blocks), 1, 999)
    at = 1
    for dimension, entity, kind, rows in blocks:
        put("iiin", dimension, entity, kind, len(rows))
        for row in rows.tolist():
            put("n" * (1 + len(row)), at, *(i + 1 for i in row))
            at += 1
    text += b"\n$EndElements\n" if binary else b"$EndElements\n"
    path.write_bytes(bytes(text))


@pytest.mark.parametrize("binary", [False, True], ids=["text", "binary"])
@pytest.mark.parametrize("write", [gmsh_2, gmsh_41])
def test_physical_groups_of_gmsh(tmp_path, write, binary):
    path = tmp_path / "a.msh"
    write(path, binary)
    mesh = sp.TetMesh.load(path)
    sets = mesh.sets
    np.testing.assert_allclose(mesh.vertices, MESH.vertices)
    np.testing.assert_array_equal(sets.vertices_of("left"), LEFT)
    centers = mesh.vertices[mesh.tets].mean(axis=1)
    np.testing.assert_array_equal(sets.tets_of("bone"), np.flatnonzero(centers[:, 0] > 0))
    np.testing.assert_array_equal(sets.tets_of("soft"), np.flatnonzero(centers[:, 0] < 0))
    np.testing.assert_array_equal(sets.vertices_of("bone"), np.unique(mesh.tets[sets.tets_of("bone")]))
    if write is gmsh_41:
        np.testing.assert_array_equal(sets.tets_of("inside bone"), sets.tets_of("bone"))


def test_a_file_without_groups_has_no_sets(tmp_path):
    MESH.save(tmp_path / "a.msh")
    sets = sp.TetMesh.load(tmp_path / "a.msh").sets
    assert (dict(sets.vertices), dict(sets.tets), sets.tet_count) == ({}, {}, len(MESH.tets))
    with pytest.raises(MeshError, match="set of vertices 'left' does not exist; there are: none"):
        sets.vertices_of("left")


GOOD = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT, TYPE=C3D4\n9,1,2,3,4\n"
HEAD = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
MALFORMED = {
    "no tets": ("a.inp", "*NODE\n1,0,0,0\n", "a.inp: it has neither tets nor a surface"),
    "no name": ("a.inp", GOOD + "*NSET\n1\n", "a.inp:8: \\*NSET has no name"),
    "unknown node": ("a.inp", GOOD + "*NSET, NSET=a\n1, 5\n", "node 5 is used, and does not exist"),
    "unknown set": ("a.inp", GOOD + "*NSET, NSET=a\nb\n", "a.inp:9: names the set 'b', which is not defined before"),
    "no number": ("a.inp", GOOD + "*NSET, NSET=a\n1, 1x\n", "a.inp:9: names the set '1x'"),
    "endless": ("a.inp", GOOD + "*NSET, NSET=a, GENERATE\n1, 4000000000000\n", "a.inp:9: a set has more than"),
    "step of zero": ("a.inp", GOOD + "*NSET, NSET=a, GENERATE\n1, 4, 0\n", "a.inp:9: GENERATE needs"),
    "node that is missing": ("a.inp", GOOD.replace("2,1,0,0", "1,1,0,0"), "node 2 is used, and does not exist"),
    "element twice": ("a.inp", GOOD + "9,1,2,3,4\n", "element 9 is given twice"),
    "short element": ("a.inp", GOOD.replace("9,1,2,3,4", "9,1,2,3"), "do not have a number and 4 nodes each"),
    "binary": ("a.inp", GOOD + "\0", "not a text file"),
    "no entities": (
        "a.msh",
        f"{HEAD}{NAMES}$Nodes\n0 0 0 0\n$EndNodes\n",
        r"no \$EndElements",
    ),
    "no nodes": (
        "a.msh",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n$Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n",
        "meshio cannot read: ValueError",
    ),
    "version 3": ("a.msh", "$MeshFormat\n3.0 0 8\n$EndMeshFormat\n", r"no \$EndNodes"),
}


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_files_give_one_line(tmp_path, case):
    name, text, words = MALFORMED[case]
    (tmp_path / name).write_text(text)
    with pytest.raises(MeshError, match=words):
        sp.TetMesh.load(tmp_path / name)


SCENE = """
bodies:
  - name: arm
    mesh: {file: a.msh, scale: 0.1}
    material: {kind: stable_neo_hookean, youngs: 1e4, poisson: 0.3}
    regions: [{set: bone, material: {kind: neo_hookean, youngs: 1e7, poisson: 0.3}}]
    copies: {offsets: [[0, 0, 0], [0, 1, 0]]}
pins: [{body: arm02, set: Left}]
solver: {kind: implicit}
steps: 1
"""


def test_sets_in_a_scene_file(tmp_path):
    gmsh_2(tmp_path / "a.msh", False)
    (tmp_path / "s.yaml").write_text(SCENE)
    scene = sp.load_scene(tmp_path / "s.yaml")
    np.testing.assert_array_equal(scene.pins[0].vertices, LEFT)
    np.testing.assert_array_equal(scene.bodies[0].material.index, np.isin(np.arange(len(MESH.tets)), BONE))
    for old, new, words in (
        ("set: Left", "set: Right", "s.yaml:8: .*set of vertices 'Right' does not exist; there are: left, soft, bone"),
        ("set: Left", "set: Left, vertices: [0]", "s.yaml:8: .*either `vertices`, `box` or `set`"),
        ("set: bone", "set: blood", "s.yaml:6: .*set of tets 'blood' does not exist; there are: soft, bone"),
        ("mesh: {file: a.msh, scale: 0.1}", "shape: {kind: box}", "s.yaml:.*body 'arm' has no file of tets"),
    ):
        (tmp_path / "s.yaml").write_text(SCENE.replace(old, new))
        with pytest.raises(sp.SceneError, match=words):
            sp.load_scene(tmp_path / "s.yaml")
