"""Surfaces of binary glTF, compared with what trimesh writes, and damaged ones."""

import json
import struct

import numpy as np
import pytest
import trimesh

import supple as sp
from supple.errors import MeshError
from supple.results.export.exporter import export

TURN = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3), (0.1, 0.0, 0.2))
MIRROR = np.diag([-2.0, 1.0, 1.0, 1.0])


def scene_of_two():
    """A box that is turned, and below it in the tree a mirrored ball."""
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.box((0.1, 0.2, 0.3)), node_name="box", transform=TURN)
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.05)
    scene.add_geometry(ball, node_name="ball", parent_node_name="box", transform=MIRROR)
    return scene


def test_every_mesh_is_where_its_nodes_place_it(tmp_path):
    scene = scene_of_two()
    (tmp_path / "two.glb").write_bytes(scene.export(file_type="glb"))
    surface = sp.SurfaceMesh.load(tmp_path / "two.glb")
    assert surface.check().component_count == 2
    expected = scene.to_mesh()
    low, high = surface.bounds
    np.testing.assert_allclose([low, high], expected.bounds, atol=1e-7)
    assert surface.area == pytest.approx(expected.area, rel=1e-6)
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.05)
    assert surface.volume == pytest.approx(0.1 * 0.2 * 0.3 + 2 * ball.volume, rel=1e-5), "the mirror is outward, too"


def test_an_exported_recording_reads_back(tmp_path):
    body = sp.Body("box", sp.shapes.box((0.1, 0.2, 0.3), (1, 1, 1)), sp.EdgesAndVolume(), position=(1, 2, 3))
    sinks = [sp.Recorder(tmp_path / "r.vtkhdf")]
    list(sp.simulate(sp.Scene([body], gravity=(0, 0, 0)), sp.XPBD(substeps=1, contact=None), 0.1, 1, sinks=sinks))
    surface = sp.SurfaceMesh.load(export(tmp_path / "r.vtkhdf", "glb"))
    assert surface.volume == pytest.approx(0.006, rel=1e-5)
    np.testing.assert_allclose(np.mean(surface.bounds, axis=0), (1, 2, 3), atol=1e-5)


POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 0.5, 0]], dtype="<f4")


def file_of(document, version=2):
    binary = POINTS.tobytes()
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, version, 12 + len(chunks)) + chunks


def document(**changes):
    """One mesh of points without indices, a strip."""
    return {
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 5}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 5}],
        "bufferViews": [{"buffer": 0, "byteLength": 60}],
        "buffers": [{"byteLength": 60}],
    } | changes


def test_a_strip(tmp_path):
    (tmp_path / "a.glb").write_bytes(file_of(document()))
    surface = sp.SurfaceMesh.load(tmp_path / "a.glb")
    assert surface.triangles.tolist() == [[0, 1, 2], [3, 2, 1], [2, 3, 4]]
    np.testing.assert_array_equal(surface.vertices, POINTS)


ACCESSOR = document()["accessors"][0]
DAMAGED = {
    "a fan": (
        file_of(document(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}])),
        "fans of triangles",
    ),
    "text glTF": (b'{"asset": {"version": "2.0"}, "scenes": []}', "trimesh cannot read"),
    "version 1": (file_of(document(), version=1), "only GLTF 2"),
    "cut": (file_of(document())[:-9], "chunk was not expected length"),
    "no triangles": (file_of(document(nodes=[{}])), "has no triangles"),
    "no JSON": (file_of("scene"), "trimesh cannot read"),
    "compressed": (file_of(document(extensionsRequired=["KHR_draco_mesh_compression"])), "export it without"),
    "another mesh": (file_of(document(nodes=[{"mesh": 1}])), "has no triangles"),
    "a circle": (
        file_of(document(scenes=[{"nodes": [0]}], nodes=[{"children": [0]}])),
        "has no triangles",
    ),
    "many paths": (
        file_of(document(scenes=[{"nodes": [0]}], nodes=[{"children": [k + 1] * 9} for k in range(9)] + [{}])),
        "has no triangles",
    ),
    "a child that is an object": (file_of(document(nodes=[{"children": [{}]}])), "trimesh cannot read"),
    "beyond the end": (file_of(document(accessors=[ACCESSOR | {"count": 6}])), "trimesh cannot read"),
    "huge count": (file_of(document(accessors=[ACCESSOR | {"count": 10**30}])), "trimesh cannot read"),
    "negative offset": (file_of(document(accessors=[ACCESSOR | {"byteOffset": -4}])), "trimesh cannot read"),
    "stride of zero": (
        file_of(document(bufferViews=[{"buffer": 0, "byteLength": 60, "byteStride": 0}])),
        "trimesh cannot read",
    ),
    "another file": (file_of(document(buffers=[{"uri": "../secret.bin"}])), "trimesh cannot read"),
    "kind of numbers": (file_of(document(accessors=[ACCESSOR | {"type": "VEC2"}])), "three coordinates each"),
    "number that is none": (file_of(document(nodes=[{"mesh": 0, "scale": [1, 2, "3x"]}])), "trimesh cannot read"),
    "number too large": (file_of(document(nodes=[{"mesh": 0, "scale": [1, 2, 10**400]}])), "trimesh cannot read"),
    "place without end": (file_of(document(nodes=[{"mesh": 0, "translation": [1e999, 0, 0]}])), "not finite|inf"),
}


@pytest.mark.parametrize("case", DAMAGED)
def test_damaged_files_give_one_line(tmp_path, case):
    content, words = DAMAGED[case]
    path = tmp_path / "a.glb"
    path.write_bytes(content)
    with pytest.raises(MeshError, match=words) as caught:
        sp.SurfaceMesh.load(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.filterwarnings("error")
def test_a_scale_beyond_all_numbers_gives_no_warning_of_numpy(tmp_path):
    (tmp_path / "s.glb").write_bytes(file_of(document(nodes=[{"mesh": 0, "scale": [1e308] * 3}])))
    with pytest.raises(MeshError):
        sp.SurfaceMesh.load(tmp_path / "s.glb")
