"""Abaqus decks: parts and instances, systems of coordinates, generated nodes and elements, included files."""

import itertools

import numpy as np
import pytest

import supple as sp
from supple.errors import MeshError

TET = "*NODE{more}\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4, ELSET=e\n1, 1, 2, 3, 4\n"
PLAIN = TET.format(more=", NSET=n")
ASSEMBLY = "*PART, NAME=P\n{part}*END PART\n*ASSEMBLY, NAME=A\n{instances}*END ASSEMBLY\n"


def load(tmp_path, text, **others):
    for name, content in others.items():
        path = tmp_path / name.replace("__", "/").replace("_inp", ".inp")
        path.parent.mkdir(exist_ok=True)
        path.write_text(content)
    (tmp_path / "deck.inp").write_text(text)
    return sp.TetMesh.load(tmp_path / "deck.inp")


def assembly(instances, part=PLAIN):
    return ASSEMBLY.format(part=part, instances=instances)


def instance(name, *lines, part="P", inside=""):
    return (
        f"*INSTANCE, NAME={name}, PART={part}\n" + "".join(f"{line}\n" for line in lines) + inside + "*END INSTANCE\n"
    )


def test_instances_are_moved_then_turned(tmp_path):
    text = assembly(
        instance("plain") + instance("moved", "10, 0, 0") + instance("turned", "20, 0, 0", "20, 0, 0, 20, 0, 1, 90")
    )
    mesh = load(tmp_path, text)
    assert mesh.components.count == 3
    own = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    turned = own[:, [1, 0, 2]] * (-1, 1, 1) + (20, 0, 0)
    np.testing.assert_allclose(mesh.vertices, np.vstack([own, own + np.array([10, 0, 0]), turned]), atol=1e-12)
    assert mesh.volume == pytest.approx(0.5)
    assert mesh.sets.tets_of("moved.e").tolist() == [1]
    assert mesh.sets.vertices_of("turned.n").tolist() == [8, 9, 10, 11]


def test_one_instance_keeps_the_names_of_sets(tmp_path):
    mesh = load(tmp_path, assembly(instance("only", "0, 0, 5", "0, 0, 0, 0, 0, 1, 0")))
    assert mesh.sets.tets_of("e").tolist() == [0]
    assert mesh.vertices[:, 2].min() == 5.0


def test_sets_of_the_assembly(tmp_path):
    sets = (
        "*NSET, NSET=tips, INSTANCE=a\n4\n*NSET, NSET=tips, INSTANCE=b\n3, 4\n*NSET, NSET=dots\na.n, b.1\n"
        "*ELSET, ELSET=both, INSTANCE=a\ne\n*ELSET, ELSET=both, INSTANCE=b, GENERATE\n1, 1\n"
    )
    mesh = load(tmp_path, assembly(instance("a") + instance("b", "5, 0, 0") + sets))
    assert mesh.sets.vertices_of("tips").tolist() == [3, 6, 7]
    assert mesh.sets.vertices_of("dots").tolist() == [0, 1, 2, 3, 4]
    assert mesh.sets.tets_of("both").tolist() == [0, 1]
    with pytest.raises(MeshError, match=r"deck.inp:\d+: the instance 'c' does not exist"):
        load(tmp_path, assembly(instance("a") + "*NSET, NSET=x, INSTANCE=c\n1\n"))


def test_an_instance_may_define_its_own_mesh(tmp_path):
    mesh = load(tmp_path, assembly(instance("a", "1, 2, 3", inside=PLAIN), part=""))
    np.testing.assert_allclose(mesh.vertices[0], (1, 2, 3))


def test_parts_without_instances_are_placed_once(tmp_path, caplog):
    mesh = load(
        tmp_path, f"*PART, NAME=P\n{PLAIN}*END PART\n*PART, NAME=Q\n{PLAIN.replace('2, 1, 0', '2, 9, 0')}*END PART\n"
    )
    assert len(mesh.tets) == 2
    assert "its parts have no *INSTANCE; each was placed once" in caplog.text


def test_cylindrical_and_spherical_coordinates(tmp_path, caplog):
    text = PLAIN.replace("*NODE", "*NODE, SYSTEM=C").replace("3, 0, 1, 0", "3, 1, 90, 0")
    np.testing.assert_allclose(load(tmp_path, text).vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-15)
    text = (
        PLAIN.replace("*NODE", "*NODE, SYSTEM=S")
        .replace("3, 0, 1, 0", "3, 1, 90, 0")
        .replace("4, 0, 0, 1", "4, 1, 0, 90")
    )
    np.testing.assert_allclose(load(tmp_path, text).vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-15)
    assert "SYSTEM=S: the second angle is taken as that above the plane" in caplog.text
    with pytest.raises(MeshError, match=r"deck.inp:1: SYSTEM=Q is not R, C or S"):
        load(tmp_path, TET.format(more=", SYSTEM=Q"))


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ("1, 2, 3", [[1, 2, 3], [2, 2, 3], [1, 3, 3], [1, 2, 4]]),
        ("1, 2, 3, 1, 5, 3", [[1, 2, 3], [1, 3, 3], [0, 2, 3], [1, 2, 4]]),  # x along y; z stays
        ("0, 0, 0, 0, 0, 2\n0, 5, 1", [[0, 0, 0], [0, 0, 1], [0, 1, 0], [-1, 0, 0]]),  # x along z, y stays
        ("", [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    ],
)
def test_a_local_system(tmp_path, lines, expected):
    text = f"*SYSTEM\n{lines}\n" + PLAIN
    np.testing.assert_allclose(load(tmp_path, text).vertices, expected, atol=1e-12)


def test_a_system_ends_with_its_part(tmp_path):
    parts = f"*PART, NAME=P\n*SYSTEM\n5, 0, 0\n{PLAIN}*END PART\n*PART, NAME=Q\n{PLAIN}*END PART\n"
    mesh = load(tmp_path, parts + "*ASSEMBLY, NAME=A\n" + instance("p") + instance("q", part="Q") + "*END ASSEMBLY\n")
    assert mesh.vertices[:, 0].tolist() == [5, 6, 5, 5, 0, 1, 0, 0]


def block(n=(3, 2, 2)):
    """A block of bricks from eight corners by *NGEN, *NFILL and *ELGEN."""
    a, b, c = n
    return f"""*NODE
1, 0, 0, 0
{1 + a}, {a}, 0, 0
{1 + 10 * b}, 0, {b}, 0
{1 + a + 10 * b}, {a}, {b}, 0
*NGEN, NSET=low
1, {1 + a}
*NGEN, NSET=high
{1 + 10 * b}, {1 + a + 10 * b}, 1
*NFILL, NSET=bottom
low, high, {b}, 10
*NCOPY, OLD SET=bottom, CHANGE NUMBER={100 * c}, SHIFT, NEW SET=top
0, 0, {c}
*NFILL
bottom, top, {c}, 100
*ELEMENT, TYPE=C3D8R
1, 1, 2, 12, 11, 101, 102, 112, 111
*ELGEN, ELSET=all
1, {a}, 1, 1, {b}, 10, 10, {c}, 100, 100
"""


def test_a_block_of_generated_bricks(tmp_path):
    mesh = load(tmp_path, block())
    assert mesh.volume == pytest.approx(12.0)
    assert len(mesh.tets) == 6 * 12
    expected = set(itertools.product(range(4), range(3), range(3)))
    assert {tuple(x) for x in mesh.vertices.astype(int).tolist()} == expected
    assert len(mesh.sets.tets_of("all")) == 72
    assert len(mesh.sets.vertices_of("bottom")) == 12
    assert len(mesh.sets.vertices_of("top")) == 12


def test_elements_are_copied_with_turned_nodes(tmp_path):
    text = PLAIN + (
        "*NCOPY, CHANGE NUMBER=10, OLD SET=n, NEW SET=m, SHIFT\n0, 0, 2\n0, 0, 0, 0, 0, 1, 90.\n"
        "*ELCOPY, ELEMENT SHIFT=5, OLD SET=e, SHIFT NODES=10, NEW SET=f\n"
    )
    mesh = load(tmp_path, text)
    np.testing.assert_allclose(mesh.vertices[4:], [[0, 0, 2], [0, 1, 2], [-1, 0, 2], [0, 0, 3]], atol=1e-12)
    assert mesh.sets.tets_of("f").tolist() == [1]
    assert mesh.sets.vertices_of("m").tolist() == [4, 5, 6, 7]


def test_included_files(tmp_path):
    """Of the deck's folder and folders below; an included file may begin with data of the keyword above it."""
    nodes = "1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1.0D+00\n"
    elements = "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n"
    for text in (
        "*NODE\n*INCLUDE, INPUT=parts/nodes.inp\n" + elements,
        "*NODE, INPUT=parts/nodes.inp\n*INCLUDE, INPUT=parts\\elements.inp\n",
        "*Include, input=parts/both.inp\n",
        "*NODE, INPUT=parts/nodes.inp\n*ELEMENT, TYPE=C3D4, INPUT=parts/one.inp\n",
    ):
        mesh = load(
            tmp_path, text, parts__nodes_inp=nodes, parts__elements_inp=elements, parts__one_inp="1, 1, 2, 3, 4\n",
            parts__both_inp="*NODE\n" + nodes + "*INCLUDE, INPUT=parts/elements.inp\n",
        )  # fmt: skip
        assert mesh.volume == pytest.approx(1 / 6)


def test_fields_that_are_left_out_are_zero(tmp_path):
    text = PLAIN.replace("3, 0, 1, 0", "3, , 1").replace("4, 0, 0, 1", "4,,, 1.")
    np.testing.assert_array_equal(load(tmp_path, text).vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def test_of_a_node_given_twice_the_last_counts(tmp_path, caplog):
    mesh = load(tmp_path, PLAIN + "*NODE\n4, 0, 0, 2\n")
    assert mesh.volume == pytest.approx(2 / 6)
    assert "1 nodes are given more than once; the last place counts" in caplog.text


@pytest.mark.parametrize(
    "lines",
    [
        "*ELEMENT, TYPE=SPRINGA\n7, 1, 2\n",
        "*ELEMENT, TYPE=MASS, ELSET=m\n7, 1\n*MASS, ELSET=m\n1.\n",
        "*ELEMENT, TYPE=S4R\n7, 1, 2, 3, 4\n",
        "*ELEMENT, TYPE=B31\n7, 1, 2\n*ELEMENT, TYPE=COH3D8\n8, 1, 2, 3, 4, 1, 2, 3, 4\n",
    ],
)
def test_what_has_no_volume_is_left_out(tmp_path, caplog, lines):
    mesh = load(tmp_path, PLAIN + lines)
    assert len(mesh.tets) == 1
    kind = lines.split("=")[1].split(",")[0].strip()
    assert f"elements without a volume were left out: {kind.splitlines()[0]}" in caplog.text


@pytest.mark.parametrize(
    ("kind", "nodes", "volume"),
    [
        ("C3D5", "1, 2, 3, 4, 9", 1 / 3),
        ("C3D6", "1, 2, 3, 5, 6, 7", 1 / 2),
        ("C3D8", "1, 2, 3, 4, 5, 6, 7, 8", 1),
        ("C3D8RH", "1, 2, 3, 4, 5, 6, 7, 8", 1),
        ("DC3D8", "1, 2, 3, 4, 5, 6, 7, 8", 1),
        ("SC8R", "1, 2, 3, 4, 5, 6, 7, 8", 1),
        ("C3D15", "1, 2, 3, 5, 6, 7, 11, 12, 13, 14, 15,\n16, 17, 18, 19", 1 / 2),
        ("C3D20R", "1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 13, 14, 15, 16, 17,\n18, 19, 20, 21, 22", 1),
    ],
)
def test_kinds_of_solids(tmp_path, kind, nodes, volume):
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1), (0.5, 0.5, 1)]
    rows = [f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(corners, start=1)]
    rows += [f"{k}, .5, .5, .5" for k in range(11, 23)]  # middle nodes, which are not used
    text = "*NODE\n" + "\n".join(rows) + f"\n*ELEMENT, TYPE={kind}\n7, {nodes}\n"
    assert load(tmp_path, text).volume == pytest.approx(volume)


def test_a_surface_in_a_deck(tmp_path):
    body = sp.shapes.box_surface((1, 1, 1), (2, 2, 2))
    text = "*NODE\n" + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(body.vertices, start=1))
    text += "*ELEMENT, TYPE=STRI3\n" + "".join(
        f"{k}, {', '.join(str(i + 1) for i in row)}\n" for k, row in enumerate(body.triangles, start=1)
    )
    (tmp_path / "deck.inp").write_text(text)
    assert sp.SurfaceMesh.load(tmp_path / "deck.inp").volume == pytest.approx(1.0)
    with pytest.raises(MeshError, match=r"a surface of 48 cells, and no tets; fill it with them: supple mesh deck.inp"):
        sp.TetMesh.load(tmp_path / "deck.inp")


def test_a_set_of_the_nodes_of_elements(tmp_path):
    assert load(tmp_path, PLAIN + "*NSET, NSET=a, ELSET=e\n").sets.vertices_of("a").tolist() == [0, 1, 2, 3]


REFUSED = {
    "mapped": ("*NMAP, NSET=n\n0, 0, 0\n", r"deck.inp:8: \*NMAP changes the mesh, and is not read"),
    "imperfect": ("*IMPERFECTION, FILE=a\n", r"\*IMPERFECTION changes the mesh"),
    "imported": ("*IMPORT, STATE=NO\n", r"\*IMPORT changes the mesh"),
    "revolved": ("*SYMMETRIC MODEL GENERATION, REVOLVE\n", "changes the mesh"),
    "arc": ("*NGEN, LINE=C\n1, 4, 1, , 0, 0, 0\n", r"deck.inp:8: \*NGEN, LINE=C changes the mesh, and is not read"),
    "mirrored": ("*NCOPY, OLD SET=n, CHANGE NUMBER=5, REFLECT=MIRROR\n", r"\*NCOPY, REFLECT=MIRROR changes the mesh"),
    "several": ("*NCOPY, OLD SET=n, CHANGE NUMBER=5, SHIFT, MULTIPLE=3\n1, 0, 0\n", r"\*NCOPY, MULTIPLE=3 changes"),
    "biased": ("*NFILL, BIAS=.5\nn, n, 2, 1\n", r"\*NFILL, BIAS=.5 changes the mesh"),
    "library": ("*ASSEMBLY\n*INSTANCE, NAME=a, LIBRARY=old\n", r"deck.inp:9: \*INSTANCE, LIBRARY=old changes the mesh"),
    "no part": ("*ASSEMBLY\n*INSTANCE, NAME=a, PART=X\n", "deck.inp:9: the part 'X' does not exist"),
    "parameter": ("*PARAMETER\na = 2\n*NODE\n9, <a>, 0, 0\n", r"deck.inp:11: a node is a value of \*PARAMETER"),
    "ends": ("*NGEN\n1, 40, 1\n", "deck.inp:9: node 40 is used, and does not exist"),
    "increment": ("*NGEN\n1, 4, 2\n", r"deck.inp:9: the numbers between the ends of \*NGEN do not fit"),
    "no set": ("*NCOPY, OLD SET=x, CHANGE NUMBER=5, SHIFT\n", "deck.inp:8: names the set 'x', which is not defined"),
    "no master": ("*ELGEN\n9, 2\n", r"deck.inp:9: element 9, which \*ELGEN copies, does not exist"),
    "missing nodes": ("*ELGEN\n1, 3, 1\n", "node 5 is used, and does not exist"),
    "axis": ("*NCOPY, OLD SET=n, CHANGE NUMBER=5, SHIFT\n1,0,0\n0,0,0,0,0,0,9\n", "deck.inp:10: the two points of"),
    "system": ("*SYSTEM\n0, 0, 0, 1, 0, 0\n2, 0, 0\n", r"the points of \*SYSTEM lie on one line"),
    "file": ("*INCLUDE, INPUT=other.inp\n", "other.inp: the file does not exist"),
    "no input": ("*INCLUDE\n", r"deck.inp:8: \*INCLUDE has no INPUT"),
    "above": ("*INCLUDE, INPUT=../other.inp\n", "deck.inp:8: it names the file '../other.inp', which is outside"),
    "absolute": ("*NODE, INPUT=/etc/passwd\n", "deck.inp:8: it names the file '/etc/passwd', which is outside"),
    "drive": ("*NODE, INPUT=C:\\other.inp\n", "which is outside of its folder"),
    "itself": ("*INCLUDE, INPUT=deck.inp\n", "includes itself|too many files"),
    "many nodes": ("*NODE\n2000000001, 9, 9, 9\n*NGEN\n1, 2000000001, 1\n", "deck.inp:11: it asks for more than"),
    "many elements": ("*ELGEN\n1, 2000000000, 0\n", "deck.inp:9: it asks for more than"),
    "instance twice": ("*ASSEMBLY\n" + instance("a") + instance("A"), "the part 'P' does not exist"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_applied_is_refused_by_its_name(tmp_path, case):
    more, words = REFUSED[case]
    with pytest.raises(MeshError, match=words) as caught:
        load(tmp_path, PLAIN + more)
    assert str(caught.value).startswith(str(tmp_path))


def test_an_error_in_an_included_file_names_it(tmp_path):
    with pytest.raises(MeshError, match=r"deck.inp:more.inp:2: a node's number is 'x'"):
        load(tmp_path, "*INCLUDE, INPUT=more.inp\n", more_inp="*NODE\nx, 1, 2, 3\n")


def test_files_that_include_each_other_twice_end(tmp_path):
    """Each includes the next one twice: 2^40 files."""
    for k in range(40):
        (tmp_path / f"f{k}.inp").write_text(2 * f"*INCLUDE, INPUT=f{k + 1}.inp\n")
    (tmp_path / "f40.inp").write_text("** nothing\n")
    with pytest.raises(MeshError, match="it includes too many files"):
        load(tmp_path, "*INCLUDE, INPUT=f0.inp\n")


def test_many_instances_of_a_large_part_are_refused(tmp_path):
    many = "".join(f"*INSTANCE, NAME=i{k}, PART=P\n*END INSTANCE\n" for k in range(2000))
    with pytest.raises(MeshError, match="it asks for more than 50,000,000 numbers of nodes and elements"):
        load(tmp_path, assembly(many, part=block((9, 9, 40)).replace("10", "10")))


def test_a_link_to_another_folder_is_not_followed(tmp_path):
    (tmp_path / "secret.inp").write_text(PLAIN)
    folder = tmp_path / "folder"
    folder.mkdir()
    try:
        (folder / "link.inp").symlink_to(tmp_path / "secret.inp")
    except OSError:
        pytest.skip("no links on this system")
    with pytest.raises(MeshError, match="which is outside of its folder"):
        load(folder, "*INCLUDE, INPUT=link.inp\n")
