"""Uploaded files become tet meshes or one-line errors, without effect on this process."""

import os
import struct
import subprocess
import threading
import time
import zlib
from base64 import b64encode

import numpy as np
import pytest

import supple as sp
from supple.app.viewer import upload_worker as worker
from supple.app.viewer.protocol import limits
from supple.app.viewer.uploads import Upload, mesh_of_upload
from supple.errors import MeshError, MeshingError, SuppleError
from supple.mesh.primitives.surfaces import sphere_surface


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """The bytes of a coarse ball, by format."""
    folder = tmp_path_factory.mktemp("balls")
    surface = sphere_surface(radius=5.0, edge_length=3.0)
    for suffix in limits.UPLOAD_FORMATS:
        surface.save(folder / f"ball{suffix}")
    return {suffix: (folder / f"ball{suffix}").read_bytes() for suffix in limits.UPLOAD_FORMATS}


def test_a_surface_is_meshed_and_scaled_and_no_file_is_left(ball, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    seconds = []
    arrays = mesh_of_upload(Upload("../../etc/ball.stl", ".stl", ball[".stl"], 0.25), seconds.append)
    mesh = sp.TetMesh(*arrays)
    assert np.ptp(mesh.vertices, axis=0).max() == pytest.approx(0.25, rel=0.04)
    np.testing.assert_allclose(mesh.vertices.min(axis=0), -mesh.vertices.max(axis=0), atol=0.01)
    assert seconds == sorted(seconds)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def read(tmp_path, monkeypatch):
    """The work of the child in this process: the tets of the bytes of a file."""
    monkeypatch.chdir(tmp_path)

    def mesh(suffix, content, triangles=20_000, tets=2000):
        (tmp_path / f"mesh{suffix}").write_bytes(content)
        job = {"file": f"mesh{suffix}", "size": 1.0, "triangles": triangles, "tets": tets}
        job |= {"seconds": 30.0, "memory": None}
        worker._mesh(job)
        with np.load(worker.MESH) as made:
            return sp.TetMesh(made["vertices"], made["tets"])

    return mesh


@pytest.mark.parametrize("suffix", limits.UPLOAD_FORMATS)
def test_every_format_is_read(read, ball, suffix):
    assert read(suffix, ball[suffix]).volume == pytest.approx(np.pi / 6.0, rel=0.15)


def test_a_surface_gets_as_many_tets_as_there_is_time_for(read, tmp_path):
    sphere_surface(radius=1.0, edge_length=0.2).save(tmp_path / "fine.stl")
    fine = (tmp_path / "fine.stl").read_bytes()
    few, many = (len(read(".stl", fine, tets=tets).tets) for tets in (600, 2000))
    assert few < 800
    assert many > 1500


def open_box(text=b"0 0 0"):
    corners = text + b"\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n"
    return b"OFF\n5 4 0\n" + corners + b"3 0 2 1\n3 0 1 4\n3 1 2 4\n3 0 3 2\n"


def test_a_hole_is_closed(read):
    assert read(".off", open_box()).volume > 0.0


HOSTILE = {
    "nothing": (".stl", b"", "empty"),
    "noise": (".stl", bytes(range(256)) * 40, "truncated|neither"),
    "cut short": (".stl", bytes(80) + struct.pack("<I", 1000) + bytes(50 * 7), "announces 1000 triangles"),
    "a count of billions": (".stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(500), "announces 4294967295"),
    "a count of billions in text": (".off", b"OFF\n4000000000 4000000000 0\n0 0 0\n", ""),
    "points by the billion": (
        ".vtk",
        b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 99999999999 float\n",
        "",
    ),
    "vertices by the billion": (
        ".ply",
        b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
        b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" + bytes(100),
        "",
    ),
    "a vertex that is not a number": (".off", open_box(b"nan 0 0"), ""),
    "an infinite vertex": (".off", open_box(b"0 inf 0"), ""),
    "a triangle alone": (".obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "close its holes"),
    "a corner that is not there": (".obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", ""),
    "all in one place": (".obj", b"v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "degenerate"),
    "another file": (".obj", b"mtllib /etc/passwd\ncall ../../secret\n", ""),
    "XML that swells": (
        ".vtp",
        b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY a "aaaaaaaaaa">'
        + b"".join(b'<!ENTITY %c "%s">' % (c + 1, b"&%c;" % c * 10) for c in range(97, 112))
        + b'<!ENTITY f SYSTEM "file:///etc/passwd">]><VTKFile type="PolyData">&p;&f;</VTKFile>',
        "",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_files_without_a_closed_surface_are_refused_in_one_line(read, name):
    suffix, content, message = HOSTILE[name]
    with pytest.raises(SuppleError, match=f"mesh{suffix}.*({message})"):
        read(suffix, content)


def test_too_many_triangles_are_refused(read, ball):
    with pytest.raises(MeshError, match="an upload may have 10; make it coarser"):
        read(".off", ball[".off"], triangles=10)


def swelling_file(size):
    """A .vtp file of a few hundred KiB whose points take `size` bytes."""
    block = zlib.compress(bytes(2**26))
    blocks = size // 2**26
    header = struct.pack(f"<{3 + blocks}I", blocks, 2**26, 0, *[len(block)] * blocks)
    data = b64encode(header) + b64encode(block * blocks)
    return (
        b'<VTKFile type="PolyData" byte_order="LittleEndian" compressor="vtkZLibDataCompressor"><PolyData>'
        b'<Piece NumberOfPoints="3" NumberOfPolys="1"><Points><DataArray type="Float32" NumberOfComponents="3" '
        b'format="binary">' + data + b"</DataArray></Points></Piece></PolyData></VTKFile>"
    )


@pytest.mark.skipif(os.name != "posix", reason="this platform has no memory limit for processes")
def test_a_decompression_bomb_ends_only_its_child(monkeypatch):
    monkeypatch.setattr(limits, "UPLOAD_MEMORY", 600 * 2**20)
    with pytest.raises(SuppleError, match=r"^bomb\.vtp: it needs more memory"):
        mesh_of_upload(Upload("bomb.vtp", ".vtp", swelling_file(2**30), 1.0))


@pytest.mark.skipif(os.name != "posix", reason="looks at groups of processes")
@pytest.mark.parametrize("how", ["time", "stop"])
def test_a_slow_or_cancelled_upload_is_ended_with_its_mesher(ball, monkeypatch, how):
    children = []

    def started(*arguments, **options):
        # Instead of the mesher: a child with a child, which both wait.
        code = "import subprocess, sys, time; subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(99)'])"
        children.append(real([arguments[0][0], "-c", code + "; time.sleep(99)"], **options))
        return children[-1]

    real = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", started)
    monkeypatch.setattr(limits, "LONGEST_UPLOAD", 0.5 if how == "time" else 60.0)
    stop = threading.Event()
    if how == "stop":
        threading.Timer(0.5, stop.set).start()
    with pytest.raises(MeshingError, match="coarser" if how == "time" else "closed"):
        mesh_of_upload(Upload("ball.stl", ".stl", ball[".stl"], 1.0), stop=stop)
    end = time.monotonic() + 30.0
    while True:
        try:
            os.killpg(children[0].pid, 0)  # is anybody there?
        except ProcessLookupError:
            break
        except PermissionError:
            pass
        assert time.monotonic() < end, "a process is left"
        time.sleep(0.05)
