"""Uploads on the page: files become commands, or messages."""

import html
import threading
from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.controls import upload_controls
from supple.app.viewer.controls.upload_controls import body_name, printable_name
from supple.app.viewer.controls.view.overlay import plain
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import AddMesh
from supple.app.viewer.protocol.snapshots import Timing
from supple.errors import MeshError

PART = 512 * 1024  # of viser's client


@pytest.fixture
def heard(live, server, visitor, monkeypatch):
    """The notifications of the visitor."""
    lines = []
    client = next(iter(server.get_clients().values()))
    monkeypatch.setattr(client, "add_notification", lambda title, text, **_: lines.append(text))
    return lines


@pytest.fixture
def meshed(monkeypatch):
    """The files that reach the mesher, which is replaced."""
    files = []
    box = sp.shapes.box(divisions=(1, 1, 1))

    def mesh(upload, notify, stop):
        files.append(upload)
        return box.vertices, box.tets

    monkeypatch.setattr(upload_controls, "mesh_of_upload", mesh)
    return files


def announce(visitor, live, content, name="ball.stl", **changes):
    fields = {
        "source_component_uuid": live.panel.upload.button._impl.uuid,
        "transfer_uuid": "one",
        "filename": name,
        "mime_type": "",
        "part_count": -(-len(content) // PART),
        "size_bytes": len(content),
    }
    visitor.send("FileTransferStartUpload", **fields | changes)


def give(visitor, live, content, index=0, **changes):
    fields = {
        "source_component_uuid": live.panel.upload.button._impl.uuid,
        "transfer_uuid": "one",
        "part_index": index,
        "content": content[index * PART : (index + 1) * PART],
    }
    visitor.send("FileTransferPart", **fields | changes)


def test_an_upload_becomes_a_command(live, fake, visitor, meshed, heard, until):
    live.controller.snapshot = replace(live.controller.snapshot, timing=Timing())
    visitor.set(live.panel.bodies.size.text, "0.75")
    visitor.set(live.panel.bodies.youngs.handle, 6.0)
    content = bytes(range(256)) * 5000  # three parts
    announce(visitor, live, content, "C:\\things\\my ball.STL")
    for k in range(3):
        give(visitor, live, content, k)
    until(lambda: fake.received)
    [upload], [command] = meshed, fake.received
    assert (upload.name, upload.suffix, upload.size) == ("my ball.STL", ".stl", 0.75)
    assert upload.content == content
    assert isinstance(command, AddMesh)
    assert (command.name, command.youngs) == ("my ball", pytest.approx(1e6))
    assert len(command.tets) == 6
    assert heard == []
    until(lambda: not live.panel.upload._busy.locked())


def test_a_slow_scene_gets_a_file_with_fewer_tets(live, fake, visitor, meshed, heard, until):
    snapshot = live.controller.snapshot
    of_a_tet = 0.01 / snapshot.description.n_tets  # 10 ms in all, of 15 ms that a step may take
    allowed = 0.9 * (1.0 / 60.0) / snapshot.speed
    live.controller.snapshot = replace(snapshot, timing=replace(snapshot.timing, step_ms=10.0))
    announce(visitor, live, b"abc")
    give(visitor, live, b"abc")
    until(lambda: heard)
    assert meshed[0].tets == np.clip(int((allowed - 0.01) / of_a_tet), 300, 2000)
    assert heard == ["ball.stl: 6 tets; a larger scene would be slower than real time"]


def test_an_error_in_a_file_is_displayed_and_the_page_continues(live, fake, visitor, meshed, heard, until, monkeypatch):
    working, go_on = threading.Event(), threading.Event()

    def mesh(upload, notify, stop):
        notify(3.0)
        working.set()
        go_on.wait(20.0)
        raise MeshError("ball.stl: <script>it has a hole</script>")

    monkeypatch.setattr(upload_controls, "mesh_of_upload", mesh)
    announce(visitor, live, b"abc")
    give(visitor, live, b"abc")
    assert working.wait(20.0)
    assert "being meshed, 3 s" in live.panel.upload._message.content
    # Meanwhile all other functions work, except a second upload.
    announce(visitor, live, b"abc", transfer_uuid="two")
    give(visitor, live, b"abc", transfer_uuid="two")
    until(lambda: heard and "another file is being meshed" in heard[0])
    visitor.press(live.panel.time.play)
    fake.show(paused=False)
    until(lambda: fake.received)
    go_on.set()
    until(lambda: len(heard) == 2)
    assert heard[1] == "ball.stl: <script>it has a hole</script>"  # a notification is text, and Markdown is not
    until(lambda: not live.panel.upload._message.visible)
    assert all(not isinstance(command, AddMesh) for command in fake.received)


REFUSED = {
    "another format": ("ball.exe", b"abc", "give a surface as"),
    "no format": ("ball", b"abc", "give a surface as"),
    "nothing": ("ball.stl", b"", "empty"),
    "too large": ("ball.stl", bytes(limits.LARGEST_UPLOAD + 1), "the limit is 16 MiB"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_files_are_checked(live, fake, visitor, meshed, heard, until, name):
    file, content, text = REFUSED[name]
    announce(visitor, live, content, file)
    for k in range(-(-len(content) // PART)):
        give(visitor, live, content, k)
    until(lambda: heard and text in heard[0])
    visitor.press(live.panel.time.play)
    until(lambda: fake.received)
    assert meshed == []


def test_closing_the_page_stops_an_upload(live, visitor, until, monkeypatch):
    ended = threading.Event()

    def mesh(upload, notify, stop):
        stop.wait(20.0)
        ended.set()
        raise MeshError("closed")

    monkeypatch.setattr(upload_controls, "mesh_of_upload", mesh)
    announce(visitor, live, b"abc")
    give(visitor, live, b"abc")
    until(lambda: live.panel.upload._busy.locked())
    live.panel.stop()
    assert ended.is_set()


@pytest.mark.parametrize(
    ("file", "displayed", "body"),
    [
        ("bunny.stl", "bunny.stl", "bunny"),
        ("../../etc/passwd.stl", "passwd.stl", "passwd"),
        ("..\\x.obj", "x.obj", "x"),
        ("a:b*c?.ply", "a:b*c?.ply", "a_b_c_"),
        ("\x1b[31m\n.off", "?[31m?.off", "_[31m_"),
        ("...stl", "...stl", "mesh"),
        ("x" * 300 + ".stl", "x" * 56 + ".stl", "x" * 40),
    ],
)
def test_names_of_files_and_bodies(file, displayed, body):
    assert printable_name(file) == displayed
    assert body_name(displayed) == body
    AddMesh(np.zeros((4, 3)), np.array([[0, 1, 2, 3]], dtype=np.int32), name=body_name(displayed))


@pytest.mark.parametrize(
    "text", ["<script>alert(1)</script>", "{1 + 1}", "![x](http://a.example/x.png)", "**a** `b` | # c"]
)
def test_text_is_escaped_for_markdown(text):
    marked = plain(text)
    assert html.unescape(marked) == text
    assert not set(marked) & set('<>{}[]!*`|"\\_~')
    assert "&#35;" in marked or "#" not in text
