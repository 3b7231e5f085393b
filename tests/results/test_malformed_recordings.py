"""For any contents of the file, the reader returns frames or raises an error of one line."""

import json
import os
import random
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from tests.recordings import set_in_scene

from supple.errors import OutputError
from supple.model.state import Status
from supple.results.export.exporter import export
from supple.results.recording.reader import read_recording


def _scene(where, value):
    return lambda file: set_in_scene(file, where, value)


def _set(path, value):
    def change(file):
        del file[path]
        file[path] = value

    return change


def _claim_many_values(file):
    del file["supple/scene/bodies/0/skin/vertices"]
    file.create_dataset("supple/scene/bodies/0/skin/vertices", (1 << 40,), "f8", chunks=(1 << 16,))


def _claim_many_rows(file):
    del file["supple/scene/bodies/0/mesh/vertices"]
    file.create_dataset("supple/scene/bodies/0/mesh/vertices", (1 << 40, 3), "f8", chunks=(1 << 10, 3))


def _far_triangle(file):
    file["supple/scene/bodies/0/skin/triangles"][0, 0] = 10_000


def _delete(path):
    def change(file):
        del file[path]

    return change


def _of_format(version):
    def change(file):
        file["supple"].attrs["format_version"] = version

    return change


def _in_header(change):
    def rewrite(file):
        tree = json.loads(file["supple/header"][()])
        change(tree["fields"]["scene"]["fields"])
        del file["supple/header"]
        file["supple/header"] = json.dumps(tree)

    return rewrite


def _of_class(part, name):
    return _in_header(lambda scene: scene[part]["tuple"][0].update({"class": name}))


_function = _in_header(lambda scene: scene["obstacles"]["tuple"][0]["fields"].update({"motion": {"function": 7}}))

DAMAGES = {
    "more frames than rows": (_set("supple/frames_written", np.int64(26)), "26 frames need"),
    "no frames": (_set("supple/frames_written", np.int64(0)), "number of frames is 0"),
    "negative frames": (_set("supple/frames_written", np.int64(-3)), "number of frames is -3"),
    "huge count": (_set("supple/frames_written", np.int64(1 << 62)), "frames need"),
    "huge array": (_claim_many_values, "claims more data than the file can contain"),
    "huge rest shape": (_claim_many_rows, "claims more data than the file can contain"),
    "triangle out of range": (_far_triangle, "10000"),
    "no header": (_delete("supple/header"), "supple/header is missing"),
    "header is no JSON": (_set("supple/header", "{"), "its description of the scene"),
    "header is a number": (_set("supple/header", 3.0), "is not a text"),
    "header is deep": (_set("supple/header", '{"tuple": [' * 60 + "]}" * 60), "nested too deeply"),
    "header of another class": (_set("supple/header", '{"class": "System", "fields": {}}'), "'System'"),
    "no scene": (_scene("scene", None), "scene is 'None', not of the type Scene"),
    "no bodies": (_scene("scene/bodies", ()), "bodies are missing"),
    "no time step": (_scene("dt", 0.0), "no time step"),
    "time step of text": (_scene("dt", "1"), "dt is '1', not of the type float"),
    "bodies are no bodies": (_scene("scene/bodies", (1, 2)), "bodies[0] is a int; give a Body or RigidBody"),
    "obstacles are none": (_scene("scene/obstacles", (None,)), "obstacles[0] is a NoneType; give a Obstacle"),
    "obstacles of no known kind": (_of_class("obstacles", "Cone"), "the class 'Cone' is not known here"),
    "obstacles of another kind": (_of_class("obstacles", "Pin"), "Pin has other fields in this version"),
    "obstacles with impossible numbers": (_scene("scene/obstacles/1/radius", -1), "radius"),
    "a function of time without values": (_function, "a function of time without values"),
    "a mesh of integers": (_set("supple/scene/bodies/0/mesh/tets", np.zeros((1, 4), dtype=int)), "with a vertex twice"),
    "an array that is missing": (_delete("supple/scene/bodies/0/mesh/tets"), "mesh/tets is missing"),
    "no points": (_delete("VTKHDF/Points"), "VTKHDF/Points is missing"),
    "points of text": (_set("VTKHDF/Points", "here"), "has shape"),
    "points of integers": (_set("VTKHDF/Points", np.zeros((25 * 54, 3), dtype=int)), "holds int64"),
    "times are not finite": (_set("supple/frames/time", np.full(25, np.nan)), "time is not finite"),
    "unknown status": (_set("supple/frames/status", np.full(25, len(Status), dtype=np.uint8)), "another version"),
    "newer format": (_of_format(99), "another version (format 99, this one reads 9); simulate it again"),
    "earlier format": (_of_format(3), "another version (format 3, this one reads 9); simulate it again"),
    "another program's": (_delete("supple"), "a VTKHDF UnstructuredGrid of another program"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_contents_are_errors_of_one_line(tmp_path, recorded, damage):
    path = tmp_path / "damaged.vtkhdf"
    shutil.copy(recorded[0], path)
    change, reason = DAMAGES[damage]
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(OutputError) as caught:
        read_recording(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert reason in text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("missing.vtkhdf", None, "the file does not exist"),
        ("empty.vtkhdf", b"", "is empty"),
        ("text.vtkhdf", b"solid ascii\n" * 50, "it is not an HDF5 file"),
        ("noise.vtkhdf", random.Random(1).randbytes(5000), "it is not an HDF5 file"),
        ("head.vtkhdf", b"\x89HDF\r\n\x1a\n" + bytes(500), "is damaged"),
    ],
)
def test_files_that_are_not_recordings(tmp_path, name, content, reason):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(OutputError, match=reason):
        read_recording(path)


def test_folders_and_plain_hdf5(tmp_path):
    with pytest.raises(OutputError, match="is a folder"):
        read_recording(tmp_path)
    with h5py.File(tmp_path / "plain.h5", "w") as file:
        file["x"] = 1
    with pytest.raises(OutputError, match="is not a recording of Supple"):
        read_recording(tmp_path / "plain.h5")


def test_files_cut_at_any_position(tmp_path, recorded):
    whole = recorded[0].read_bytes()
    chance = random.Random(3)
    path = tmp_path / "cut.vtkhdf"
    for length in [1, 7, 8, 95, 96, len(whole) - 1, *(chance.randrange(1, len(whole)) for _ in range(40))]:
        path.write_bytes(whole[:length])
        with pytest.raises(OutputError):
            read_recording(path)


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="the superuser may read everything")
def test_files_without_permission_to_read(tmp_path: Path, recorded):
    path = tmp_path / "secret.vtkhdf"
    shutil.copy(recorded[0], path)
    path.chmod(0)
    with pytest.raises(OutputError, match="permission denied"):
        read_recording(path)


def test_a_recording_with_damaged_names_is_not_copied(tmp_path, recorded):
    """The reader does not need this name, so that the file opens; HDF5 reads it when the whole file is copied."""
    data = recorded[0].read_bytes()
    name = b"NumberOfCells\0"
    assert name in data
    (tmp_path / "r.vtkhdf").write_bytes(data.replace(name, b"\xff" * 13 + b"\0"))
    with pytest.raises(OutputError, match=r"^\S*r\.vtkhdf: is damaged: "):
        export(tmp_path / "r.vtkhdf", "vtkhdf")
    assert [path.name for path in tmp_path.iterdir()] == ["r.vtkhdf"]


def test_a_damaged_length_of_the_header_is_refused_before_it_is_read(tmp_path, recorded, monkeypatch):
    path = tmp_path / "damaged.vtkhdf"
    shutil.copy(recorded[0], path)
    with h5py.File(path) as file:
        place = file["supple/header"].id.get_offset()
    data = bytearray(path.read_bytes())
    data[place : place + 4] = (3_500_000_000).to_bytes(4, "little")
    path.write_bytes(data)

    def read(self, where):
        raise AssertionError("HDF5 takes 3.5 GB for this")

    monkeypatch.setattr(h5py.Dataset, "__getitem__", read)
    with pytest.raises(OutputError, match="supple/header is not a text"):
        read_recording(path)
