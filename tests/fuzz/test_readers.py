"""Every reader of files, on damaged files: it returns what it reads, or raises one clear line; never anything else.

`make fuzz` runs many more examples; so does the environment variable SUPPLE_FUZZ_EXAMPLES.
"""

import hashlib
import itertools
import logging
import os
import shutil
import struct
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

import supple as sp
from supple.app.runs.contents import RunPaths
from supple.app.runs.journal import read_journal
from supple.app.runs.run_writer import frame_of
from supple.app.scene_file.loader import load_run
from supple.app.studies.run_case import read_result
from supple.mesh import shapes
from supple.mesh.io.mesh_files import SURFACE_WRITERS
from supple.results.checkpoint.file import read_checkpoint

EXAMPLES = int(os.environ.get("SUPPLE_FUZZ_EXAMPLES", "25"))
# Of `make fuzz`: an example of a time out of all proportion is an error there. The suite asserts no time.
SECONDS = 10 if "SUPPLE_FUZZ_EXAMPLES" in os.environ else None
LARGEST_GROWTH = 1_000_000_000  # of the memory of this process, over all examples of a reader [bytes]

SCENE = """\
bodies:
  - name: cube
    mesh: {file: cube.vtu}
    material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}
    copies: {grid: [2, 1, 1], spacing: [2, 2, 2]}
  - {name: box, shape: {kind: box, divisions: [1, 2, 1]}, material: {kind: arap, youngs: 1e4, poisson: 0.1}}
obstacles: [{kind: sphere, radius: 0.5, motion: {times: [0, 1], angles: [0, 1]}}]
pins: [{body: box, vertices: [0, 1]}]
solver: {kind: implicit, integrator: bdf2, contact: {dhat: 1e-3}}
gravity: [0, -9.81, 0]
dt: 1/60
"""
STUDY = """\
scene: scene.yaml
factors: {dt: [0.1, 0.2], bodies.box.material.youngs: {loguniform: [1e3, 1e5], count: 2}}
design: {kind: latin_hypercube, samples: 4, seed: 1}
measures: {tip: {quantity: position, body: box, axis: y, over: max, vertices: [0]}}
"""
RESULT = '{"status": "done", "measures": {"y": 1.5}, "simulated": true}'
SETS = (
    "*NODE, NSET=all\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT, TYPE=C3D4, ELSET=e\n9,1,2,3,4\n"
    "*NSET, NSET=b\nall, 2\n*ELSET, ELSET=g, GENERATE\n1, 9, 2\n"
)
ASSEMBLY = """\
*PART, NAME=P
*SYSTEM
1, 0, 0, 1, 1, 0
*NODE, SYSTEM=C
1, 0, 0, 0
3, 2, 0, 0
*NGEN, NSET=low
1, 3
*NCOPY, OLD SET=low, CHANGE NUMBER=10, SHIFT, NEW SET=side
-1, 0, 0
0, 0, 0, 1, 0, 0, 5
*NFILL
low, side, 1, 10
*NCOPY, OLD SET=low, CHANGE NUMBER=100, SHIFT
0, 0, 1
*NCOPY, OLD SET=side, CHANGE NUMBER=100, SHIFT
0, 0, 1
*ELEMENT, TYPE=C3D8R
1, 1, 2, 12, 11, 101, 102, 112, 111
*ELGEN, ELSET=all
1, 2, 1, 1
*END PART
*ASSEMBLY, NAME=A
*INSTANCE, NAME=a, PART=P
*END INSTANCE
*INSTANCE, NAME=b, PART=P
9, 0, 0
0, 0, 0, 0, 0, 1, 30
*END INSTANCE
*NSET, NSET=held, INSTANCE=b
low
*END ASSEMBLY
"""
MEDIT = (
    "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0 1\n0 0 1 1\n"
    "Pyramids\n1\n1 2 3 4 5 1\nEnd\n"
)
GROUPS = """\
$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
1
3 2 "bone"
$EndPhysicalNames
$Entities
0 0 0 1
5 0 0 0 1 1 1 1 2 0
$EndEntities
$Nodes
1 4 1 4
3 5 0 4
1 2 3 4
0 0 0 1 0 0 0 1 0 0 0 1
$EndNodes
$Elements
1 1 1 1
3 5 4 1
1 1 2 3 4
$EndElements
"""
CUBE = shapes.box_surface((1, 1, 1), (1, 1, 1))
BODY = shapes.box((1.0, 0.1, 1 / 3), (3, 1, 2))


@dataclass(frozen=True)
class Reader:
    """A reader, and how a good file for it is made in a folder; `damaged` is the file that is damaged."""

    make: Callable[[Path], object]
    damaged: str
    read: Callable[[Path], object]


def text_file(name: str, text: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_text(text, encoding="utf-8")


def record(folder: Path) -> None:
    body = sp.Body("box", BODY, sp.EdgesAndVolume())
    sinks = [sp.Recorder(folder / "r.vtkhdf")]
    for _ in sp.simulate(sp.Scene([body]), sp.XPBD(substeps=1, contact=None), 0.01, 3, sinks=sinks):
        pass


def read_whole_recording(path: Path) -> None:
    with sp.read_recording(path) as recording:
        for frame in recording:
            _ = frame.report, frame.positions, frame.velocities, frame.det_F, frame.obstacle_poses, frame.index


def make_scene(folder: Path) -> None:
    BODY.save(folder / "cube.vtu")
    (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")


def make_study(folder: Path) -> None:
    make_scene(folder)
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")


def bricks(path: Path) -> None:
    points = np.array(list(itertools.product(range(2), repeat=3)), dtype=np.float64)
    meshio.write(path, meshio.Mesh(points, [("hexahedron", [[0, 4, 6, 2, 1, 5, 7, 3]])]), binary=False)


def make_gltf(folder: Path) -> None:
    scene = trimesh.Scene(trimesh.Trimesh(CUBE.vertices, CUBE.triangles))
    for name, content in scene.export(file_type="gltf").items():
        (folder / name).write_bytes(content)


SOLVER = sp.XPBD(substeps=1)


def small_scene() -> sp.Scene:
    """Two cubes that touch, so that a checkpoint has a memory of contact."""
    cube = shapes.box((1, 1, 1), (1, 1, 1))
    soft = sp.StableNeoHookean(youngs=1e4, poisson=0.3)
    bodies = [sp.Body(name, cube, soft, position=(0, y, 0)) for name, y in (("low", 0.5), ("high", 1.5))]
    return sp.Scene(bodies, obstacles=[sp.HalfSpace()], pins=[sp.Pin("high", [0], sp.MotionInput("hand"))])


def keep_run(folder: Path) -> None:
    """A run with two checkpoints; the latest one, and what its checksum is of, beside it."""
    kept = sp.RunFolder(folder / "run", SOLVER, checkpoint_every=2)
    list(sp.simulate(small_scene(), SOLVER, 0.01, 2, sinks=[kept]))
    latest = RunPaths(folder / "run").checkpoints()[0]
    shutil.copy(latest, folder / "latest.checkpoint")
    (folder / "content").write_bytes(latest.read_bytes().split(b"\n", 2)[2])


def read_checkpoint_and_go_on(path: Path) -> None:
    """Where the file is accepted, it does not describe the scene, or the run goes on, or is refused."""
    checkpoint = read_checkpoint(path)
    with suppress(sp.SceneError):
        frame = frame_of(checkpoint, small_scene(), SOLVER)
        if frame is not None:
            list(sp.simulate(frame.system.scene, SOLVER, 0.01, 1, start=frame))


def read_content(path: Path) -> None:
    """A checkpoint whose checksum is right for whatever its content is."""
    content = path.read_bytes()
    first = (path.parent / "latest.checkpoint").read_bytes().split(b"\n", 1)[0]
    made = path.parent / "made.checkpoint"
    made.write_bytes(first + b"\n" + hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
    read_checkpoint_and_go_on(made)


READERS = {
    **{
        f"surface {kind}": Reader(
            lambda folder, kind=kind: CUBE.save(folder / f"s{kind}"), f"s{kind}", sp.SurfaceMesh.load
        )
        for kind in SURFACE_WRITERS
    },
    "sets .inp": Reader(text_file("s.inp", SETS), "s.inp", sp.TetMesh.load),
    "sets .msh": Reader(text_file("s.msh", GROUPS), "s.msh", sp.TetMesh.load),
    "deck with instances": Reader(text_file("a.inp", ASSEMBLY), "a.inp", sp.TetMesh.load),
    "tets .mesh": Reader(text_file("s.mesh", MEDIT), "s.mesh", sp.TetMesh.load),
    "bricks .vtk": Reader(lambda folder: bricks(folder / "b.vtk"), "b.vtk", sp.TetMesh.load),
    "bricks .vtu": Reader(lambda folder: bricks(folder / "b.vtu"), "b.vtu", sp.TetMesh.load),
    "surface .gltf": Reader(make_gltf, "model.gltf", sp.SurfaceMesh.load),
    "buffer of .gltf": Reader(
        make_gltf, "gltf_buffer_0.bin", lambda path: sp.SurfaceMesh.load(path.parent / "model.gltf")
    ),
    **{
        f"surface .{kind}": Reader(
            lambda folder, kind=kind: trimesh.Trimesh(CUBE.vertices, CUBE.triangles).export(folder / f"s.{kind}"),
            f"s.{kind}",
            sp.SurfaceMesh.load,
        )
        for kind, package in (("dae", "collada"), ("3mf", "lxml"))
        if find_spec(package)
    },
    "surface .glb": Reader(
        lambda folder: trimesh.Trimesh(CUBE.vertices, CUBE.triangles).export(folder / "s.glb"),
        "s.glb",
        sp.SurfaceMesh.load,
    ),
    **{
        f"tets {kind}": Reader(lambda folder, kind=kind: BODY.save(folder / f"t{kind}"), f"t{kind}", sp.TetMesh.load)
        for kind in (".msh", ".vtu", ".vtk", ".inp", ".usda")
    },
    **{
        f"TetGen's {kind}": Reader(
            lambda folder: BODY.save(folder / "t.1.node"),
            f"t.1{kind}",
            lambda path: sp.TetMesh.load(path.with_suffix(".node")),
        )
        for kind in (".node", ".ele", ".edge", ".face")
    },
    "scene": Reader(make_scene, "scene.yaml", load_run),
    "study": Reader(make_study, "study.yaml", sp.studies.load_study),
    "result of a case": Reader(text_file("result.json", RESULT), "result.json", lambda path: read_result(path.parent)),
    "recording": Reader(record, "r.vtkhdf", read_whole_recording),
    "journal": Reader(keep_run, "run/run/run.json", read_journal),
    "checkpoint": Reader(keep_run, "latest.checkpoint", read_checkpoint_and_go_on),
    "content of a checkpoint": Reader(keep_run, "content", read_content),
}

NUMBERS = [b"-1", b"0", b"1e999", b"nan", b"4000000000", b"99999999999999999999", b"1e-320", b"0x10", b".5.", b"1/0"]
TEXTS = [
    b"\n",
    b"\r",
    b"\t",
    b" ",
    b"\0",
    b"\xff",
    b"<",
    b">",
    b"[",
    b"]",
    b"{",
    b"}",
    b":",
    b"- ",
    b"&a ",
    b"*a",
    b'"',
]
BINARY = [struct.pack(form, number) for form in ("<I", ">I", "<q") for number in (0, 1, 2**31 - 1)] + [b"\xff" * 8]
PIECES = st.one_of(st.sampled_from(NUMBERS + TEXTS + BINARY), st.binary(max_size=12))


@st.composite
def damages(draw, size: int):
    """A function of the file's bytes: pieces are inserted, replaced, repeated or exchanged, or the end is cut off."""
    place = st.integers(0, size)
    changes = [
        (
            draw(st.sampled_from(["replace", "insert", "repeat", "cut", "exchange"])),
            draw(place),
            draw(place),
            draw(PIECES),
        )
        for _ in range(draw(st.integers(1, 4)))
    ]

    def damaged(data: bytes) -> bytes:
        for kind, first, second, piece in changes:
            low, high = sorted((first, second))
            if kind == "replace":
                data = data[:first] + piece + data[first + len(piece) :]
            elif kind == "insert":
                data = data[:first] + piece + data[first:]
            elif kind == "repeat":
                data = data[:high] + data[low:high] + data[high:]
            elif kind == "exchange":
                data = (
                    data[:low]
                    + data[high : high + 16]
                    + data[low + 16 : high]
                    + data[low : low + 16]
                    + data[high + 16 :]
                )
            elif second % 4 == 0:  # not too often, because little of the file is left
                data = data[:first]
        return data

    return damaged


@pytest.mark.parametrize("name", READERS)
def test_damaged_files_are_read_or_refused_in_one_line(name, tmp_path, capfd, caplog):
    reader = READERS[name]
    caplog.set_level(logging.CRITICAL)
    reader.make(tmp_path)
    path = tmp_path / reader.damaged
    original = path.read_bytes()
    reader.read(path)  # the good file
    before = peak_memory()

    @settings(
        max_examples=EXAMPLES,
        deadline=None if SECONDS is None else 1000 * SECONDS,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink],
    )
    @given(damages(len(original)))
    def read_damaged(damage):
        path.write_bytes(damage(original))
        try:
            reader.read(path)
        except sp.SuppleError as error:
            text = str(error)
            assert "\n" not in text
            assert len(text) < 600
            assert str(tmp_path) in text

    read_damaged()
    assert peak_memory() - before < LARGEST_GROWTH
    assert capfd.readouterr().out == ""


def peak_memory() -> int:
    """Of this process so far [bytes]; 0 on systems that do not tell."""
    try:
        import resource
    except ImportError:
        return 0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
