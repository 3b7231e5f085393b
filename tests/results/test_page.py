"""The page of a recording as a file; `test_page_in_browser.py` plays it."""

import base64
import json
import re
import struct
import threading
import zlib

import numpy as np
import pytest

import supple as sp
from supple.errors import OutputError
from supple.results.page import client as client_module
from supple.results.page import page as page_module
from supple.results.page.packed import Packer, differences, quantized
from supple.results.page.page import write_page
from supple.results.recording.reader import read_recording

TYPES = {"u1": "<u1", "u2": "<u2", "u4": "<u4", "i2": "<i2", "f4": "<f4", "f8": "<f8"}


def read_page(path):
    """The description in a page, and the arrays to which it refers."""
    (text,) = re.findall(r'<script id="data" type="text/plain">([A-Za-z0-9+/=]+)</script>', path.read_text("utf-8"))
    block = zlib.decompress(base64.b64decode(text))
    (length,) = struct.unpack("<I", block[:4])
    assert length % 8 == 4, "arrays do not start at a multiple of 8"

    def array(ref):
        return np.frombuffer(block, TYPES[ref["type"]], ref["count"], 4 + length + ref["at"])

    return json.loads(block[4 : 4 + length]), array


def unfolded(folded):
    """Values (frames, ...) of differences in 8 or 16 bits."""
    folded = folded.astype(np.int64)
    return np.cumsum((folded >> 1) ^ -(folded & 1), axis=0)


def positions_in(path):
    """(frames, points, 3) of a page [m]."""
    told, array = read_page(path)
    upper, lower = array(told["motion"]).astype(np.int64).reshape(2, -1)
    frames = array(told["times"]).size
    steps = unfolded(((upper << 8) | lower).reshape(frames, -1)) % 65536
    steps, x = steps.reshape(frames, 3, -1).transpose(0, 2, 1), np.empty((frames, told["points"], 3))
    for group in told["groups"]:
        rows = slice(group["first"], group["first"] + group["count"])
        x[:, rows] = np.array(group["low"]) + group["step"] * steps[:, rows]
    return x


def test_a_page_is_complete_and_leaves_nothing_behind(tmp_path, recorded, capfd):
    threads = threading.active_count()
    path = write_page(recorded[0], tmp_path / "index.html")
    assert list(tmp_path.iterdir()) == [path]
    text = path.read_text(encoding="utf-8")
    assert "<title>cube, slab · Supple</title>" in text
    assert not re.search(r'(src|href)="|@import|url\("?http', text)
    assert capfd.readouterr().out == ""
    assert threading.active_count() == threads


def test_a_page_has_the_positions_of_the_recording(tmp_path, recorded, recording):
    path = write_page(recorded[0], tmp_path / "index.html")
    told, array = read_page(path)
    x = positions_in(path)
    assert len(x) == len(recording) == 25
    np.testing.assert_array_equal(array(told["times"]), recording.times)
    for frame, shown in zip(recording, x, strict=True):
        for body, group in zip(recording.bodies, told["groups"], strict=False):
            own = frame.state.positions[body.vertices]
            np.testing.assert_allclose(shown[body.vertices], own, atol=0.51 * group["step"])
            assert group["step"] <= np.ptp(np.concatenate([f.positions[body.name] for f in recording]), 0).max() / 6e4


def test_fields_and_readings_are_those_of_the_recording(tmp_path, recorded, recording):
    told, array = read_page(write_page(recorded[0], tmp_path / "index.html"))
    fields = {field["name"]: field for field in told["fields"]}
    assert list(fields) == ["volume ratio J", "von Mises stress", "energy density"]
    low, high = fields["volume ratio J"]["ends"]
    values = unfolded(array(fields["volume ratio J"]["values"]).reshape(25, -1)) % 256
    for k in (0, 7, 24):
        for body in recording.bodies:
            J = recording[k].det_F[body.tets]
            mixed = low + (high - low) * values[k, body.vertices] / 255.0
            assert mixed.min() >= max(low, J.min()) - 0.01 * (high - low)
            assert mixed.max() <= min(high, J.max()) + 0.01 * (high - low)
    plots = {plot["title"]: {one["name"]: array(one["values"]) for one in plot["series"]} for plot in told["plots"]}
    np.testing.assert_allclose(plots["energy [J]"]["kinetic"], recording.series("kinetic_energy"), rtol=1e-6)
    np.testing.assert_allclose(plots["smallest J"]["J"], recording.series("min_det_F"), rtol=1e-6)


def test_recorded_fields_can_be_chosen(tmp_path):
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
    cube = sp.Body("cube", sp.shapes.box((1, 1, 1), (2, 2, 2)), rubber, position=(0, 0.5, 0), velocity=(0, -1, 0))
    ball = sp.RigidBody("ball", sp.shapes.sphere(0.2, edge_length=0.2).surface, density=500, position=(2, 1, 0))
    scene = sp.Scene([cube, ball], obstacles=[sp.HalfSpace()])
    fields = ["contact_force", "principal_stretches", "von_mises", "stress_at_vertices", "plastic_strain"]
    sink = sp.Recorder(tmp_path / "r.vtkhdf", fields=fields)
    list(sp.simulate(scene, sp.XPBD(substeps=8), 0.01, 8, sinks=[sink]))
    told, array = read_page(write_page(tmp_path / "r.vtkhdf", tmp_path / "index.html"))
    shown = {field["name"]: field for field in told["fields"]}
    more = ["contact force", "principal stretches", "stress at vertices", "plastic strain"]
    assert list(shown) == ["volume ratio J", "von Mises stress", "energy density", *more]
    with read_recording(tmp_path / "r.vtkhdf") as recording:
        force = np.linalg.norm(recording[8].contact_force["cube"], axis=1)
    low, high = shown["contact force"]["ends"]
    values = unfolded(array(shown["contact force"]["values"]).reshape(9, -1)) % 256
    assert low == 0.0
    assert force.max() > 0.0
    np.testing.assert_allclose(values[8, : len(force)] / 255.0, np.minimum(force / high, 1.0), atol=0.003)


def test_long_recordings_are_shown_with_fewer_frames(tmp_path, recorded, monkeypatch):
    monkeypatch.setattr(page_module, "_MOST_BYTES", 9 * 5 * 36)
    told, array = read_page(write_page(recorded[0], tmp_path / "thin.html"))
    assert 2 <= len(array(told["times"])) <= 5
    with read_recording(recorded[0]) as recording:
        assert array(told["times"])[[0, -1]].tolist() == recording.times[[0, -1]].tolist()


def test_pages_of_open_recordings_leave_them_open(tmp_path, recorded):
    with read_recording(recorded[0]) as recording:
        write_page(recording, tmp_path / "index.html")
        assert recording[3].report.iterations == 3


def test_names_are_no_markup(tmp_path, recorded):
    name = "</script><script>alert(1)</script><!--<b>&"
    with read_recording(recorded[0]) as recording:
        object.__setattr__(recording.bodies[0].body, "name", name)  # scenes refuse such names; files can be forged
        path = write_page(recording, tmp_path / "page.html")
    assert "alert(1)" not in path.read_text(encoding="utf-8").replace("&lt;script&gt;alert(1)", "")
    assert read_page(path)[0]["bodies"][0]["name"] == name


def test_a_page_that_was_not_built_says_how_to_build_it(tmp_path, recorded, monkeypatch):
    monkeypatch.setattr(client_module, "files", lambda package: tmp_path)
    with pytest.raises(OutputError, match=r"python client/build\.py"):
        write_page(recorded[0], tmp_path / "index.html")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_differences_give_the_values_again(kind):
    values = np.random.default_rng(1).integers(0, np.iinfo(kind).max, (5, 7), endpoint=True).astype(kind)
    values[2] = 0
    values[3] = np.iinfo(kind).max
    packed = differences(values)
    size = values.itemsize
    planes = packed.reshape(size, -1).astype(np.int64)
    folded = planes[0] if size == 1 else (planes[0] << 8) | planes[1]
    np.testing.assert_array_equal(unfolded(folded.reshape(5, 7)) % 2 ** (8 * size), values)


def test_points_that_all_coincide_are_quantized():
    steps, low, step = quantized(np.full((2, 3, 3), 1e6))
    np.testing.assert_array_equal(np.array(low) + step * steps, np.full((2, 3, 3), 1e6))


def test_equal_arrays_are_packed_once():
    packer = Packer()
    first, again, other = (packer.add(values, "f4") for values in ([1, 2, 3], [1, 2, 3], [1, 2, 4]))
    assert first == again == {"type": "f4", "at": 0, "count": 3}
    assert other["at"] == 16
    assert len(packer.block({})) % 8 == 0
