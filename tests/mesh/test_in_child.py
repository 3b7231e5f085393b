"""Files that a library reads in a child process: what its limits do, and what is left behind."""

import tempfile

import pytest

import supple as sp
from supple.errors import MeshError
from supple.mesh.io import in_child

pytestmark = pytest.mark.usefixtures("own_interpreters")
BOX = sp.shapes.box((1, 1, 1), (1, 1, 1))


@pytest.fixture
def path(tmp_path):
    BOX.save(tmp_path / "a.msh")
    return tmp_path / "a.msh"


def refused(path, message):
    with pytest.raises(MeshError, match=message) as caught:
        sp.TetMesh.load(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_a_library_that_takes_too_long_is_stopped(path, monkeypatch):
    monkeypatch.setattr(in_child, "_SECONDS", 0.01)
    refused(path, "meshio did not read it within 0 s: it is damaged")


def test_a_folder_for_temporary_files_that_is_not_there(path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(path.parent / "missing"))
    refused(path, "meshio cannot work in .*missing: No such file or directory; make room there")


def test_nothing_is_left_behind(path, tmp_path, monkeypatch):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    assert sp.TetMesh.load(path).volume == pytest.approx(1.0)
    path.write_bytes(path.read_bytes().replace(b"$Nodes", b"$Noses"))
    refused(path, "meshio cannot read")
    assert not list(scratch.iterdir())


def test_a_glb_that_names_another_file_reads_nothing(tmp_path):
    """trimesh gets the bytes, not the path."""
    document = b'{"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":"secret.bin"}],"scenes":[{"nodes":[]}]}'
    document += b" " * (-len(document) % 4)
    size = len(document)
    head = (
        b"glTF" + (2).to_bytes(4, "little") + (20 + size).to_bytes(4, "little") + size.to_bytes(4, "little") + b"JSON"
    )
    (tmp_path / "a.glb").write_bytes(head + document)
    (tmp_path / "secret.bin").write_bytes(b"1234")
    with pytest.raises(MeshError, match="trimesh cannot read"):
        sp.SurfaceMesh.load(tmp_path / "a.glb")
