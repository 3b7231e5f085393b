"""`supple info` on files of every kind."""

import re

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.console import ExitCode
from supple.results.recording.recorder import Recorder


@pytest.fixture
def rows_of(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def rows(file, *options):
        assert main(["info", file, *options]) == ExitCode.OK
        lines = capsys.readouterr().out.splitlines()[1:]
        rows = {}
        for line in lines:
            name, _, value = line.rstrip().partition("  ")
            rows[name] = value.strip()
        return rows

    return rows


def test_a_surface_with_a_hole(rows_of, tmp_path):
    box = sp.shapes.box_surface((1, 2, 3), (1, 1, 1))
    sp.SurfaceMesh(box.vertices, box.triangles[1:]).save("open.stl")
    rows = rows_of("open.stl")
    assert (rows["kind"], rows["vertices"], rows["triangles"]) == ("surface", "8", "11")
    assert rows["size"] == "1 x 2 x 3 m"
    assert rows["volume"] == "none, the surface is open"
    assert "hole" in rows["problems"]
    assert rows["as a shell"] == "possible: supple view open.stl --shell"
    wing = [*box.triangles[0, :2], len(box.vertices)]
    wing = sp.SurfaceMesh([*box.vertices, (9, 9, 9)], [*box.triangles, wing])
    wing.save("twice.obj")
    (tmp_path / "cloth.yaml").write_text(
        "bodies: [{name: c, mesh: {file: open.stl}, shell: {youngs: 1e5, poisson: 0.3, thickness: 0.01}}]",
        encoding="utf-8",
    )
    scene = rows_of("cloth.yaml")
    assert (scene["tets"], scene["triangles"]) == ("0", "11 of shells")
    assert scene["body c"].startswith("neo_hookean shell 0.01 m thick")
    assert "not possible: the edge" in rows_of("twice.obj")["as a shell"]


@pytest.mark.parametrize("name", ["box.1.node", "box.msh", "box.vtu", "box.vtk"])
def test_a_tet_mesh(rows_of, name):
    sp.shapes.box((1, 2, 3), (1, 1, 1)).save(name)
    rows = rows_of(name)
    assert (rows["kind"], rows["vertices"], rows["tets"]) == ("tetrahedral mesh", "8", "6")
    assert rows["volume"] == "6 m^3"


def test_a_surface_in_a_file_that_may_hold_tets(rows_of):
    sp.shapes.sphere_surface(0.5, 0.2).save("ball.vtk")
    assert rows_of("ball.vtk")["kind"] == "surface"


def test_a_scene(rows_of, tmp_path):
    (tmp_path / "s.yaml").write_text(
        "bodies: [{name: cube, shape: {kind: box, size: [1, 1, 2]}, "
        "material: {kind: arap, youngs: 1e4, poisson: 0.2, density: 500}}]\n"
        "obstacles: [{kind: half_space, name: floor}]\npins: [{body: cube, vertices: [0, 1]}]\n"
        "loads: [{kind: growth, body: cube, stretch: 1.1},"
        " {kind: body_force, name: wind, body: cube, force: [1, 0, 0]}]\n"
        "sensors: [{kind: force, name: foot, body: cube}]\n"
        "solver: {kind: xpbd, substeps: 3}\ndt: 0.5\nsteps: 4\n"
    )
    rows = rows_of("s.yaml")
    assert rows["kind"] == "scene"
    assert rows["body cube"] == "ARAP, 384 tets, 2 m^3, 1000 kg"
    assert rows["obstacles"] == "floor (HalfSpace)"
    assert rows["pins"] == "pin of body 'cube': 2 vertices"
    assert rows["time"] == "4 steps of 0.5 s: 2 s"
    assert rows["memory"].startswith("about ")
    assert rows["place of cube"] == "(-0.5, -0.5, -1) to (0.5, 0.5, 1) m"
    assert rows["intersections"].startswith("body 'cube' overlaps obstacle 'floor' at the start")
    assert rows["each frame"].startswith("--time simulates")
    assert rows["loads"] == "growth on body 'cube', body force 'wind'"
    assert rows["sensors"] == "force sensor 'foot'"


def test_welded_faces_that_touch_do_not_intersect(rows_of, tmp_path):
    """A soft cube welded to the face of a rigid one; another rigid one is inside of the soft one or beside it."""
    scene = """bodies:
  - {name: pad, shape: {kind: box, size: [1, 1, 1], divisions: [2, 2, 2]}, position: [0, 1, 0],
     material: {kind: stable_neo_hookean, youngs: 1e4, poisson: 0.3}}
  - {name: plate, rigid: {density: 1000}, shape: {kind: box, size: [1, 1, 1], divisions: [1, 1, 1]}}
  - {name: other, rigid: {density: 1000}, shape: {kind: box, size: [1, 1, 1], divisions: [1, 1, 1]},
     position: [PLACE, 1.3, 0]}
welds: [{body: pad, rigid: plate, max_distance: 1e-6}]
dt: 0.01
steps: 1
"""
    (tmp_path / "apart.yaml").write_text(scene.replace("PLACE", "1.5"))
    (tmp_path / "inside.yaml").write_text(scene.replace("PLACE", "0.8"))
    problem = rows_of("apart.yaml")["intersections"]
    assert problem == "none at the start; things that are stitched or welded to each other are not compared"
    assert rows_of("inside.yaml")["intersections"].startswith("body 'pad' overlaps body 'other' at the start")


def test_a_scene_whose_frames_are_timed(rows_of, tmp_path):
    (tmp_path / "s.yaml").write_text(
        "bodies: [{name: cube, shape: {kind: box, divisions: [1, 1, 1]}, position: [0, 0.6, 0], "
        "material: {kind: stable_neo_hookean, youngs: 1e4, poisson: 0.2}}]\nobstacles: [{kind: half_space}]\n"
        "solver: {kind: xpbd, substeps: 2}\ndt: 0.01\nsteps: 40\n"
    )
    rows = rows_of("s.yaml", "--time")
    assert rows["intersections"] == "none at the start"
    assert re.fullmatch(r"[\d.e+-]+ ms at the start; 40 steps take about [\d.e+-]+ s .*", rows["each frame"])


def test_a_recording(rows_of):
    cube = sp.Body("cube", sp.shapes.box((1, 1, 1), (1, 1, 1)), sp.StableNeoHookean(youngs=1e5, poisson=0.3))
    frames = list(sp.simulate(sp.Scene([cube]), sp.XPBD(substeps=2), 0.01, 3, sinks=[Recorder("r.vtkhdf")]))
    rows = rows_of("r.vtkhdf")
    assert rows["kind"] == "recording"
    assert rows["frames"] == "4 to t = 0.03 s, dt = 0.01 s"
    assert (rows["vertices"], rows["tets"], rows["mass"]) == ("8", "6", "1000 kg")
    assert rows["body cube"] == "StableNeoHookean, 6 tets, 1 m^3, 1000 kg"
    assert rows["place of cube"] == "(-0.5, -0.5, -0.5) to (0.5, 0.5, 0.5) m"
    assert (rows["ended"], rows["problems"]) == ("converged", "none")
    assert float(rows["smallest J"].split()[0]) == pytest.approx(min(1.0, *(f.report.min_det_F for f in frames)), 1e-5)
    assert np.isfinite(frames[-1].time)


def test_stitches_of_a_scene(rows_of, tmp_path):
    body = (
        "shape: {kind: box, size: [1, 1, 1], divisions: [1, 1, 1]}, material: {kind: arap, youngs: 1e4, poisson: 0.3}"
    )
    (tmp_path / "scene.yaml").write_text(
        f"bodies:\n  - {{name: a, {body}}}\n  - {{name: b, {body}, position: [0, 1.25, 0]}}\n"
        "stitches:\n"
        "  - {kind: soft_vertex_triangle, first: b, second: a, max_distance: 0.3, youngs: 1, poisson: 0.3,"
        " min_separate_distance: 0.5}\n"
        "  - {kind: vertex_vertex, name: thread, first: b, second: a, pairs: [[0, 0], [0, 1]], stiffness: 1,"
        " strength: [2, 3]}\n"
    )
    rows = rows_of("scene.yaml")
    soft, thread = rows["stitch of 'b' to 'a'"], rows["stitch 'thread'"]
    assert soft == "SoftVertexTriangleStitch, 4 pairs, 0.25 to 0.25 m apart, 4 rest vertices offset"
    assert thread.startswith("VertexVertexStitch, 2 pairs, 1.25 to ")
    assert thread.endswith(", breaks at 2 to 3 N")


def test_stitches_that_broke_in_a_recording(rows_of, tmp_path):
    mesh, rubber = sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), sp.StableNeoHookean(youngs=1e4, poisson=0.3)
    bodies = [sp.Body("held", mesh, rubber), sp.Body("low", mesh, rubber, position=(0, -0.11, 0))]
    seam = sp.VertexVertexStitch("low", "held", max_distance=0.0101, stiffness=500.0, strength=[0.1, 9.0, 9.0, 0.1])
    scene = sp.Scene(bodies, pins=[sp.Pin("held", np.arange(8))], stitches=[seam])
    frames = sp.simulate(scene, sp.XPBD(substeps=20), 0.01, 8, sinks=[sp.Recorder(tmp_path / "r.vtkhdf")])
    assert [len(frame.state.broken_stitches) for frame in frames][-1] == 2
    assert rows_of("r.vtkhdf")["stitches"] == "2 of 4 pairs have broken at the end"


def scene_of(divisions, poisson, order=1):
    return (
        f"bodies: [{{name: bar, shape: {{kind: box, size: [4, 1, 0.1], divisions: {divisions}}}, order: {order}, "
        f"material: {{kind: stable_neo_hookean, youngs: 1e4, poisson: {poisson}}}}}]\n"
        "solver: {kind: implicit}\ndt: 0.5\nsteps: 4\n"
    )


@pytest.mark.parametrize(
    ("divisions", "poisson", "order", "warned"),
    [
        ([4, 4, 2], 0.45, 1, True),
        ([4, 4, 3], 0.45, 1, False),  # flat cells, but three across
        ([4, 4, 2], 0.4, 1, False),
        ([4, 4, 2], 0.45, 2, False),
    ],
)
def test_a_thin_scene_that_locks(rows_of, tmp_path, divisions, poisson, order, warned):
    (tmp_path / "s.yaml").write_text(scene_of(divisions, poisson, order))
    rows = rows_of("s.yaml")
    assert ("warning bar" in rows) == warned
    if warned:
        # The two large sides.
        share = 100 * 8 / (8 + 2 * 0.5)
        assert rows["warning bar"].startswith(f"{share:.0f} % of the surface has fewer than three tets across")
        assert "Poisson's ratio up to 0.45" in rows["warning bar"]


def test_materials_with_other_parameters_show_their_moduli_of_small_strains(rows_of, tmp_path):
    rubber = "{kind: mooney_rivlin, c10: 1e5, bulk: 2e6}"
    slow = f"{{kind: viscoelastic, material: {rubber}, prony: [[0.5, 1]]}}"
    (tmp_path / "s.yaml").write_text(
        "bodies:\n"
        f"  - {{name: quick, shape: {{kind: box}}, material: {rubber}}}\n"
        f"  - {{name: slow, shape: {{kind: box}}, material: {slow}}}\n"
        "solver: {kind: implicit}\n"
    )
    rows = rows_of("s.yaml")
    moduli = f"(small strains: E = {9 * 2e6 * 2e5 / 6.2e6:.6g} Pa, nu = {(6e6 - 4e5) / 12.4e6:.6g})"
    assert rows["body quick"].startswith(f"MooneyRivlin {moduli}, ")
    assert rows["body slow"].startswith(f"Viscoelastic MooneyRivlin {moduli}, ")


def test_the_frequencies_of_a_scene(rows_of, tmp_path):
    (tmp_path / "s.yaml").write_text(
        "bodies: [{name: cube, shape: {kind: box, size: [1, 1, 2]}, "
        "material: {kind: arap, youngs: 1e4, poisson: 0.2, density: 500}}]\n"
        "pins: [{body: cube, vertices: [0, 1, 2, 3]}]\n"
    )
    scene = sp.load_scene(tmp_path / "s.yaml")
    assert rows_of("s.yaml", "--modes", "1")["frequencies"] == f"{sp.modes(scene, 1).frequencies[0]:.6g} Hz"
    assert "frequencies" not in rows_of("s.yaml")
