"""Surfaces of .dae, .gltf and .3mf: placed as their scenes say, in metres, with y up; and damaged or hostile ones."""

import io
import json
import struct
import zipfile
import zlib

import numpy as np
import pytest
import trimesh

import supple as sp
from supple.errors import MeshError

from .test_glb import POINTS, document

BOX = trimesh.creation.box((0.1, 0.2, 0.3))

DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>
    <unit name="centimeter" meter="0.01"/><up_axis>{up}_UP</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array>
      <technique_common><accessor source="#pa" count="4" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    {faces}
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s">
    <node id="n"><translate>100 0 0</translate><rotate>0 0 1 90</rotate><scale>{scale} 2 3</scale>
      <node id="m"><translate>0 0 10</translate><instance_geometry url="#g">{material}</instance_geometry></node></node>
  </visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""
INPUT = '<input semantic="VERTEX" source="#v" offset="0"/>'
TRIANGLES = f'<triangles count="4">{INPUT}<p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>'
POLYGONS = f'<polylist count="4">{INPUT}<vcount>3 3 3 3</vcount><p>0 2 1 0 1 3 0 3 2 1 2 3</p></polylist>'
MATERIAL = (
    '<bind_material><technique_common><instance_material symbol="a" target="#missing"/></technique_common>'
    "</bind_material>"
)


def dae(up="Y", faces=TRIANGLES, scale=1, material=""):
    return DAE.format(up=up, faces=faces, scale=scale, material=material)


def load(path, content, **options):
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return sp.SurfaceMesh.load(path, **options)


@pytest.mark.parametrize("material", ["", MATERIAL], ids=["plain", "material that is missing"])
@pytest.mark.parametrize("faces", [TRIANGLES, POLYGONS], ids=["triangles", "polylist"])
@pytest.mark.parametrize("scale", [1, -1], ids=["", "mirrored"])
def test_collada_places_in_metres(tmp_path, faces, scale, material):
    pytest.importorskip("collada")
    surface = load(tmp_path / "a.dae", dae(faces=faces, scale=scale, material=material))
    # (x, y, z) becomes .01 times (100 - 2 y, s x, 3 (z + 10)): scaled, turned by a quarter about z, moved.
    expected = 0.01 * np.array([[100, 0, 30], [100, scale, 30], [98, 0, 30], [100, 0, 33]])
    order = np.lexsort(expected.T)
    np.testing.assert_allclose(surface.vertices[np.lexsort(surface.vertices.T.round(6))], expected[order], atol=1e-7)
    assert surface.volume == pytest.approx(1e-6, rel=1e-5), "outward, also where a placement mirrors"


def test_the_axis_that_points_up_becomes_y_unless_it_is_kept(tmp_path):
    pytest.importorskip("collada")
    as_written = load(tmp_path / "y.dae", dae("Y")).vertices
    for up, turned in (("Z", as_written[:, [0, 2, 1]] * (1, 1, -1)), ("X", as_written[:, [1, 0, 2]] * (-1, 1, 1))):
        surface = load(tmp_path / f"{up}.dae", dae(up))
        np.testing.assert_allclose(surface.vertices, turned, atol=1e-12)
        assert surface.volume == pytest.approx(1e-6, rel=1e-5)
        kept = sp.SurfaceMesh.load(tmp_path / f"{up}.dae", keep_axes=True)
        np.testing.assert_allclose(kept.vertices, as_written, atol=1e-12)


SCENE = """
bodies: [{{name: a, mesh: {{file: a.dae, scale: 10{more}}}, rigid: {{density: 1000}}}}]
steps: 1
"""


@pytest.mark.parametrize(("more", "height"), [("", 0.3), (", keep_axes: true", 0.1)])
def test_a_scene_file_keeps_axes_where_it_says_so(tmp_path, more, height):
    pytest.importorskip("collada")
    (tmp_path / "a.dae").write_text(dae("Z"))
    (tmp_path / "s.yaml").write_text(SCENE.format(more=more))
    points = sp.load_scene(tmp_path / "s.yaml").bodies[0].surface.vertices
    assert np.ptp(points[:, 1]) == pytest.approx(height)


ROBOT = """<robot name="r"><link name="l"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="a.dae" scale="10 10 10"/></geometry></collision></link></robot>"""


def test_a_robot_ignores_which_axis_points_up(tmp_path):
    """As RViz, Gazebo and MoveIt do: its links are in the coordinates of the file."""
    pytest.importorskip("collada")
    (tmp_path / "a.dae").write_text(dae("Z"))
    (tmp_path / "r.urdf").write_text(ROBOT)
    body = sp.load_scene(tmp_path / "r.urdf").bodies[0]
    points = body.surface.vertices - body.surface.vertices.min(axis=0)
    np.testing.assert_allclose(points.max(axis=0), [0.2, 0.1, 0.3], atol=1e-6)


def test_what_of_collada_is_left_out_is_said(tmp_path, caplog):
    pytest.importorskip("collada")
    strip = f'<tristrips count="1">{INPUT}<p>0 1 2 3</p></tristrips>'
    assert len(load(tmp_path / "a.dae", dae(faces=strip)).triangles) == 2
    skin = '<instance_controller url="#skin"/>'
    load(tmp_path / "b.dae", dae().replace("<instance_geometry", skin + "<instance_geometry"))
    assert "its 1 surfaces with skins or morphs were left out" in caplog.text
    with pytest.raises(MeshError, match="no triangles; its 1 surfaces with skins"):
        load(tmp_path / "c.dae", dae().replace('<instance_geometry url="#g"></instance_geometry>', skin))
    with pytest.raises(MeshError, match=r"no triangles; \d of its parts cannot be read, the first: .*missing"):
        load(tmp_path / "d.dae", dae().replace('url="#g"', 'url="#missing"'))


MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
 <resources><object id="1" type="model"><mesh>
  <vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>
   <vertex x="0" y="1" z="0"/><vertex x="0" y="0" z="1"/></vertices>
  <triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/><triangle v1="0" v2="3" v3="2"/>
   <triangle v1="1" v2="2" v3="3"/></triangles></mesh></object>
  <object id="2"><components><component objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0 5"/></components></object>
 </resources>
 <build><item objectid="1"/><item objectid="2" transform="0 2 0 -2 0 0 0 0 2 10 0 0"/></build>
</model>"""


def zipped(**files):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(name.replace("__", "/").replace("_model", ".model"), text)
    return data.getvalue()


def package(text):
    return zipped(**{"3D__3dmodel_model": text})


@pytest.mark.parametrize(
    ("unit", "metres"),
    [("micron", 1e-6), ("millimeter", 1e-3), ("centimeter", 1e-2), ("inch", 0.0254), ("foot", 0.3048), ("meter", 1.0)],
)
def test_3mf_places_its_items_in_metres(tmp_path, unit, metres):
    pytest.importorskip("lxml")
    pytest.importorskip("networkx")
    surface = load(tmp_path / "a.3mf", package(MODEL.format(unit=unit)))
    assert surface.components.count == 2
    assert surface.volume == pytest.approx(1.5 * metres**3)  # one sixth, and eight times that
    low, high = surface.bounds
    np.testing.assert_allclose([low, high], metres * np.array([[0, 0, 0], [10, 2, 12]]), atol=1e-9 * metres)


def test_a_3mf_without_a_unit_has_millimetres(tmp_path):
    pytest.importorskip("lxml")
    pytest.importorskip("networkx")
    surface = load(tmp_path / "a.3mf", package(MODEL.replace(' unit="{unit}"', "")))
    assert surface.bounds[1][2] == pytest.approx(0.012)


def gltf(tmp_path, name="a.gltf", uri="data/points.bin", **changes):
    (tmp_path / "data").mkdir(exist_ok=True)
    (tmp_path / "data" / "points.bin").write_bytes(POINTS.tobytes())
    buffers = {"buffers": [{"byteLength": 60, "uri": uri}]}
    (tmp_path / name).write_text(json.dumps(document(**{**buffers, **changes})))
    return tmp_path / name


def test_gltf_with_its_buffers_beside_it(tmp_path):
    nodes = [{"mesh": 0, "translation": [1, 2, 3], "scale": [2, 2, 2]}]
    surface = sp.SurfaceMesh.load(gltf(tmp_path, nodes=nodes))
    np.testing.assert_allclose(surface.vertices, 2.0 * POINTS + (1, 2, 3))
    scene = trimesh.Scene(BOX)
    for file, content in scene.export(file_type="gltf").items():
        (tmp_path / file).write_bytes(content)
    assert sp.SurfaceMesh.load(tmp_path / "model.gltf").volume == pytest.approx(0.006, rel=1e-6)


def test_gltf_with_buffers_inside(tmp_path):
    from base64 import b64encode

    uri = "data:application/octet-stream;base64," + b64encode(POINTS.tobytes()).decode()
    np.testing.assert_allclose(sp.SurfaceMesh.load(gltf(tmp_path, uri=uri)).vertices, POINTS)


BOMB = '<!DOCTYPE a [<!ENTITY b "' + 1000 * "x" + '">]>'
DAMAGED = {
    "outside": (lambda path: gltf(path, uri="../secret.bin"), "names the file '../secret.bin', which is outside"),
    "absolute": (lambda path: gltf(path, uri="/etc/hostname"), "names the file '/etc/hostname', which is outside"),
    "of windows": (lambda path: gltf(path, uri="C:\\secret.bin"), "which is outside of its folder"),
    "missing": (lambda path: gltf(path, uri="data/other.bin"), "other.bin: the file does not exist"),
    "no JSON": (lambda path: write(path / "a.gltf", '{"asset": '), "not JSON of glTF"),
    "a list": (lambda path: write(path / "a.gltf", "[1]"), "not JSON of glTF"),
    "deep": (lambda path: write(path / "a.gltf", 100_000 * "["), "not JSON of glTF"),
    "short buffer": (lambda path: gltf(path, accessors=[document()["accessors"][0] | {"count": 9}]), "trimesh cannot"),
    "entities": (lambda path: write(path / "a.dae", dae().replace("<COLLADA", BOMB + "<COLLADA")), "declares entities"),
    "cut": (lambda path: write(path / "a.dae", dae()[:900]), "trimesh cannot read: ParseError"),
    "no scene": (lambda path: write(path / "a.dae", dae().partition("<scene>")[0] + "</COLLADA>"), "no scene"),
    "index": (lambda path: write(path / "a.dae", dae().replace("0 2 1", "0 2 9")), "no triangles|cannot read"),
    "zip": (lambda path: write(path / "a.3mf", zipped(other="x")), "a ZIP archive without a model of 3MF"),
    "not a zip": (lambda path: write(path / "a.3mf", "solid\n"), "not a 3MF file"),
    "cut zip": (lambda path: write(path / "a.3mf", package(MODEL.format(unit="inch"))[:300]), "trimesh cannot read"),
    "no vertices": (
        lambda path: write(path / "a.3mf", package(MODEL.format(unit="inch").replace("<vertex ", "<vortex "))),
        "cannot read|no vertices|names point",
    ),
}


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("case", DAMAGED)
def test_damaged_files_give_one_line(tmp_path, case):
    make, words = DAMAGED[case]
    if case in ("cut", "no scene", "index"):
        pytest.importorskip("collada")
    if case in ("cut zip", "no vertices"):
        pytest.importorskip("lxml")
    (tmp_path.parent / "secret.bin").write_bytes(POINTS.tobytes())
    path = make(tmp_path)
    with pytest.raises(MeshError, match=words) as caught:
        sp.SurfaceMesh.load(path)
    assert str(caught.value).startswith(str(tmp_path))


@pytest.mark.slow
def test_an_archive_that_swells_is_refused(tmp_path):
    """It unpacks to more than the child process may use: one block of zeros, repeated."""
    pytest.importorskip("lxml")
    pack = zlib.compressobj(9, zlib.DEFLATED, -15)
    block = pack.compress(bytes(2**24)) + pack.flush(zlib.Z_FULL_FLUSH)
    body, name = 180 * block + pack.flush(), b"3D/3dmodel.model"
    sizes = struct.pack("<IIIHH", 0, len(body), 180 * 2**24, len(name), 0)
    head = struct.pack("<IHHHHH", 0x04034B50, 20, 0, 8, 0, 0) + sizes + name
    entry = (
        struct.pack("<IHHHHHH", 0x02014B50, 20, 20, 0, 8, 0, 0) + sizes + struct.pack("<HHHII", 0, 0, 0, 0, 0) + name
    )
    end = struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, 1, 1, len(entry), len(head) + len(body), 0)
    with pytest.raises(MeshError, match=r"it needs more than \d+ MiB"):
        load(tmp_path / "bomb.3mf", head + body + entry + end)
