"""From surfaces to tets: real shapes, cavities, options that are met, and every way in which a mesher can fail."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from supple.errors import MeshingError
from supple.mesh.meshing import mesher_worker
from supple.mesh.meshing.child_process import Limits, MesherFailure
from supple.mesh.meshing.meshers import mesh_with_tetgen
from supple.mesh.meshing.tetrahedralize import tetrahedralize as fill
from supple.mesh.meshing.tetrahedralize import tetrahedralize_reported
from supple.mesh.primitives.gummy_bear import gummy_bear_surface
from supple.mesh.primitives.surfaces import sphere_surface, torus_surface
from supple.mesh.shapes import box_surface
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.runtime.memory import limit_process

SPHERE = sphere_surface(radius=0.5, edge_length=0.15)
SMALL = sphere_surface(radius=0.2, edge_length=0.15)
TINY = sphere_surface(radius=0.08, edge_length=0.08)
OPTIONS = {"max_volume": None, "quality": 1.4, "min_dihedral": None, "keep_surface": False}


def joined(*surfaces: SurfaceMesh) -> SurfaceMesh:
    starts = np.cumsum([0, *(len(s.vertices) for s in surfaces[:-1])])
    return SurfaceMesh(
        np.concatenate([s.vertices for s in surfaces]),
        np.concatenate([s.triangles + start for s, start in zip(surfaces, starts, strict=True)]),
    )


def moved(surface: SurfaceMesh, *by: float) -> SurfaceMesh:
    return surface.transformed(translation=by)


def assert_fills(mesh: TetMesh, surface: SurfaceMesh, volume: float | None = None) -> None:
    """Positive tets, a clean outward boundary, the volume of the surface."""
    assert (mesh.volumes > 0).all()
    assert mesh.volume == pytest.approx(surface.volume if volume is None else volume, rel=1e-4)
    report = mesh.surface.check()
    assert report.watertight
    assert report.outward
    assert mesh.surface.volume == pytest.approx(mesh.volume, rel=1e-9)


@pytest.mark.usefixtures("own_interpreters")
@pytest.mark.parametrize(
    ("surface", "max_volume"),
    [
        (SPHERE, 1e-3),
        (torus_surface(radius=0.5, tube_radius=0.2, edge_length=0.12), 5e-4),
        (gummy_bear_surface(height=0.1, resolution=24), 1e-8),
        (box_surface(size=(1.0, 0.1, 0.1), divisions=(10, 1, 1)), 2e-5),
    ],
    ids=["sphere", "torus", "bear", "box"],
)
def test_shapes_are_filled_and_no_tet_is_too_large(surface: SurfaceMesh, max_volume: float) -> None:
    mesh = fill(surface, max_volume=max_volume)
    assert_fills(mesh, surface)
    assert mesh.volumes.max() <= max_volume * (1 + 1e-6)
    assert np.median(mesh.min_dihedrals) > 30


def test_scale_does_not_matter() -> None:
    """The same mesh at nanometres; the factor is 2^-30, because only powers of two are exact."""
    scale = 2.0**-30
    mesh = fill(SPHERE, max_volume=2e-3)
    small = fill(SurfaceMesh(SPHERE.vertices * scale, SPHERE.triangles), max_volume=2e-3 * scale**3)
    np.testing.assert_array_equal(small.tets, mesh.tets)
    np.testing.assert_array_equal(small.vertices, mesh.vertices * scale)


def test_keep_surface_adds_no_vertex_there() -> None:
    mesh = fill(SPHERE, max_volume=2e-3, keep_surface=True)
    assert_fills(mesh, SPHERE)
    rows = mesh.surface.used_vertices
    assert sorted(mesh.vertices[rows].tolist()) == sorted(SPHERE.vertices.tolist())
    assert len(mesh.vertices) > len(rows)


def test_stricter_quality_and_dihedral_give_more_tets() -> None:
    counts = [
        len(fill(SPHERE, quality=quality, min_dihedral=angle).tets)
        for quality, angle in ((2.0, None), (1.2, None), (1.2, 15.0))
    ]
    assert counts == sorted(set(counts))
    assert (fill(SPHERE, quality=None).min_dihedrals < 10).any()


def test_components_are_filled_and_cavities_are_not() -> None:
    """A ball with a cavity, in it another ball; and a second ball elsewhere."""
    surface = joined(SPHERE, SMALL.flipped(), TINY, moved(TINY, 2, 0, 0))
    mesh = fill(surface)
    assert_fills(mesh, surface, SPHERE.volume - SMALL.volume + 2 * TINY.volume)
    assert mesh.components.count == 3


def test_inward_surfaces_are_turned(caplog: pytest.LogCaptureFixture) -> None:
    inside_out = joined(SPHERE, SMALL.flipped()).flipped()
    assert_fills(fill(inside_out), inside_out, SPHERE.volume - SMALL.volume)
    assert "faced inward" in caplog.text
    one_of_two = joined(SPHERE, moved(SMALL, 2, 0, 0).flipped())
    assert_fills(fill(one_of_two), one_of_two, SPHERE.volume + SMALL.volume)


def test_unused_vertices_are_dropped() -> None:
    surface = SurfaceMesh(np.vstack([SPHERE.vertices, [[9.0, 9.0, 9.0]]]), SPHERE.triangles)
    assert_fills(fill(surface), SPHERE)


BROKEN = {
    "open": (SurfaceMesh(SPHERE.vertices, SPHERE.triangles[3:]), "open boundary edge"),
    "overlapping": (joined(SPHERE, moved(SPHERE, 0.4, 0.01, 0)), "intersecting triangle"),
    "aligned": (joined(SPHERE, SPHERE), "duplicate|intersecting|folded|non-manifold"),
    "solid in solid": (joined(SPHERE, SMALL), "1 component of 2 faces the wrong way"),
    "duplicate": (SurfaceMesh(SPHERE.vertices, np.vstack([SPHERE.triangles, SPHERE.triangles[:1]])), "non-manifold"),
    "one triangle": (SurfaceMesh(np.eye(3), [[0, 1, 2]]), "open boundary edge"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_surfaces_with_faults_are_errors_with_place_and_remedy(case: str) -> None:
    surface, fault = BROKEN[case]
    with pytest.raises(MeshingError, match=fault) as error:
        fill(surface, mesher="tetgen")
    assert "repair=True" in str(error.value)
    assert "stuffing" in str(error.value)


def test_triangles_that_disagree_are_turned_first(caplog: pytest.LogCaptureFixture) -> None:
    mixed = SurfaceMesh(SPHERE.vertices, np.vstack([SPHERE.triangles[:5, ::-1], SPHERE.triangles[5:]]))
    mesh, report = tetrahedralize_reported(mixed)
    assert report.mesher == "tetgen"
    assert mesh.volume == pytest.approx(SPHERE.volume, rel=1e-3)
    assert "reoriented 5 triangles to agree with their neighbours" in caplog.text


def test_surfaces_with_faults_are_filled(caplog: pytest.LogCaptureFixture) -> None:
    ball = sphere_surface(radius=0.5, edge_length=0.35)
    with_hole = SurfaceMesh(ball.vertices, ball.triangles[1:])
    surface = joined(with_hole, moved(ball, 0.5, 0.01, 0.02))
    mesh, report = tetrahedralize_reported(surface, max_volume=0.02)
    assert report.mesher == "stuffing"
    assert "filling it with a lattice, which rounds sharp edges" in caplog.text
    assert (mesh.volumes > 0).all()
    assert mesh.volumes.max() <= 0.02
    # A union: more than one ball, less than two.
    assert 1.2 * ball.volume < mesh.volume < 1.9 * ball.volume


@pytest.mark.parametrize(
    "options",
    [
        {"max_volume": 0.0},
        {"max_volume": -1.0},
        {"max_volume": float("nan")},
        {"max_volume": "big"},
        {"quality": 1.0},
        {"quality": float("inf")},
        {"min_dihedral": 90.0},
        {"time_limit": 0.0},
        {"memory_limit": -5},
        {"mesher": "gmsh"},
    ],
    ids=str,
)
def test_parameters_out_of_range_are_named(options: dict) -> None:
    with pytest.raises(MeshingError, match=next(iter(options))):
        fill(SPHERE, **options)


def test_only_surfaces_are_filled() -> None:
    with pytest.raises(MeshingError, match="needs a SurfaceMesh, not str"):
        fill("bear.stl")  # type: ignore[arg-type]


def test_an_unreachable_max_volume_is_an_error() -> None:
    """TetGen finds no place for a vertex inside twelve large triangles that it may not split."""
    with pytest.raises(MeshingError, match=r"left a tet of .* larger than max_volume=0\.0001; omit keep_surface"):
        fill(box_surface(size=(1, 1, 1), divisions=(1, 1, 1)), max_volume=1e-4, keep_surface=True)


def test_time_limit_ends_the_mesher() -> None:
    started = time.monotonic()
    with pytest.raises(MesherFailure, match=r"time limit of 1 s.*raise time_limit") as error:
        fill(SPHERE, max_volume=3e-7, time_limit=1.0)
    assert error.value.kind == "time"
    assert time.monotonic() - started < 30


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="address space is bounded on Linux only")
@pytest.mark.parametrize("mebibytes", [40, 200])
def test_memory_limit_ends_the_mesher(mebibytes: int) -> None:
    """At 40 MiB NumPy cannot be loaded; at 200 MiB TetGen runs out of memory."""
    with pytest.raises(MesherFailure, match=rf"ran out of memory within the memory limit of {mebibytes} MiB") as error:
        fill(SPHERE, max_volume=SPHERE.volume / (3000 * mebibytes), memory_limit=mebibytes * 2**20)
    assert error.value.kind == "memory"


@pytest.mark.parametrize("size", [{"tets": 10**12}, {"max_volume": 1e-12 * SPHERE.volume}, {"edge": 1e-300}], ids=str)
def test_more_tets_than_memory_are_refused_before_the_mesher_starts(size) -> None:
    with pytest.raises(MeshingError, match=r"at least (1e\+12|inf) tets do not fit into the memory limit of 4096 MiB"):
        fill(SPHERE, **size)


@pytest.mark.parametrize("size", [{"tets": 20_000_000}, {"max_volume": SPHERE.volume / 20_000_000}], ids=str)
def test_twenty_million_tets_do_not_fit_into_four_gibibytes(size) -> None:
    with pytest.raises(MeshingError, match=r"at least 2e\+07 tets do not fit into .* 4096 MiB; ask for fewer \(tets,"):
        fill(SPHERE, **size)


@pytest.mark.parametrize("size", [{"tets": 2_000_000}, {"max_volume": SPHERE.volume / 800_000}], ids=str)
def test_sizes_that_take_minutes_are_named_before_the_mesher_starts(size, caplog) -> None:
    with pytest.raises(MesherFailure, match="time limit"):
        fill(SPHERE, time_limit=0.1, **size)
    assert "about 2e+06 tets are expected: the mesher may reach its time limit of 0.1 s; ask for fewer" in caplog.text
    assert "tets=500000, or edge=0.02" in caplog.text


@pytest.mark.parametrize("shift", [(0.4, 0.01, 0.0), (0.4, 0.0, 0.0), (1e-9, 0.0, 0.0)], ids=str)
def test_a_crash_of_tetgen_is_an_error_here(shift: tuple[float, float, float], tmp_path, monkeypatch) -> None:
    """Overlapping spheres without the check before: TetGen fails, aborts or segfaults."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MesherFailure, match=r"failed|crashed|stopped at the time limit") as error:
        mesh_with_tetgen(joined(SPHERE, moved(SPHERE, *shift)), OPTIONS, Limits(4.0, 2**30))
    assert error.value.kind in ("failed", "crash", "time")
    # TetGen writes `_skipped.node` and other files into its current folder, which must not be the one of this process.
    assert list(tmp_path.iterdir()) == []


def test_a_surface_of_noise_is_an_error_here() -> None:
    noise = np.random.default_rng(6).normal(size=SPHERE.vertices.shape) * 0.1
    with pytest.raises(MesherFailure):
        mesh_with_tetgen(SurfaceMesh(SPHERE.vertices + noise, SPHERE.triangles), OPTIONS, Limits(4.0, 2**30))


def worker(monkeypatch: pytest.MonkeyPatch, folder: Path, code: str) -> None:
    """Replace the mesher by a script."""
    script = folder / "worker.py"
    script.write_text(code)
    monkeypatch.setattr(mesher_worker, "__file__", str(script))


@pytest.mark.parametrize(
    ("code", "kind", "text"),
    [
        ("import os, sys; print('malloc(): broken', flush=True); os.abort()", "crash", "malloc(): broken"),
        ("raise SystemExit(7)", "crash", "exit code 7"),
        ("import sys; print('terminate: std::bad_alloc', file=sys.stderr); raise SystemExit(134)", "memory", "ran out"),
    ],
)
def test_the_end_of_the_child_is_reported(tmp_path, monkeypatch, code: str, kind: str, text: str) -> None:
    worker(monkeypatch, tmp_path, code)
    with pytest.raises(MesherFailure) as error:
        fill(SPHERE, mesher="tetgen")
    assert error.value.kind == kind
    assert text in str(error.value)


def test_auto_goes_on_with_stuffing_where_tetgen_crashes(tmp_path, monkeypatch, caplog) -> None:
    real = Path(mesher_worker.__file__).read_text(encoding="utf-8")
    crash = 'import os, pathlib, sys\nif "tetgen" in pathlib.Path(sys.argv[1], "job.json").read_text(): os.abort()\n'
    future = "from __future__ import annotations\n"
    worker(monkeypatch, tmp_path, future + crash + real.replace(future, ""))
    mesh, report = tetrahedralize_reported(SPHERE, max_volume=0.05)
    assert report.mesher == "stuffing"
    assert mesh.volume == pytest.approx(SPHERE.volume, rel=0.01)
    assert "tetgen crashed" in caplog.text
    assert "filling it with a lattice" in caplog.text
    with pytest.raises(MesherFailure, match="tetgen crashed"):
        fill(SPHERE, keep_surface=True)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_signal_is_named(tmp_path, monkeypatch) -> None:
    worker(monkeypatch, tmp_path, "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    with pytest.raises(MesherFailure, match=r"crashed \(SIGSEGV\).*mesher=\"stuffing\""):
        fill(SPHERE, mesher="tetgen")


def test_a_python_that_cannot_start_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    with pytest.raises(MesherFailure, match="cannot start Python"):
        fill(SPHERE, mesher="tetgen")


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_an_interrupt_ends_the_child(tmp_path: Path) -> None:
    """Ctrl-C in a program that meshes: no child and no temporary files remain."""
    program = (
        "import sys; from supple.mesh.meshing import mesher_worker\n"
        "from supple.mesh.primitives.surfaces import sphere_surface\n"
        "from supple.mesh.meshing.tetrahedralize import tetrahedralize\n"
        f"mesher_worker.__file__ = {str(tmp_path / 'worker.py')!r}\n"
        "tetrahedralize(sphere_surface(radius=.5, edge_length=.3))\n"
    )
    (tmp_path / "worker.py").write_text(
        f"import os, time; open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid())); time.sleep(60)"
    )
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    parent = subprocess.Popen(
        [sys.executable, "-c", program],
        env=os.environ | {"TMPDIR": str(scratch)},
        stderr=subprocess.PIPE,
        # Tests in the background may run with SIGINT ignored; at a terminal it is not.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    pid_file = tmp_path / "pid"
    deadline = time.monotonic() + 30
    while not (pid_file.exists() and pid_file.read_text()) and time.monotonic() < deadline:
        time.sleep(0.05)
    child = int(pid_file.read_text())
    parent.send_signal(signal.SIGINT)
    _, output = parent.communicate(timeout=30)
    assert b"KeyboardInterrupt" in output
    with pytest.raises(ProcessLookupError):
        os.kill(child, 0)
    assert list(scratch.iterdir()) == []


def test_a_missing_memory_limit_is_a_log_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "resource", None)  # as on Windows
    assert "no memory limit" in limit_process(10.0, 2**30)[0]


@pytest.mark.usefixtures("own_interpreters")
def test_two_threads_can_mesh_at_once() -> None:
    meshes: list[TetMesh] = []
    threads = [threading.Thread(target=lambda: meshes.append(fill(SPHERE))) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    np.testing.assert_array_equal(meshes[0].tets, meshes[1].tets)


def test_a_sheet_encloses_nothing() -> None:
    sheet = SurfaceMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(MeshingError, match="encloses nothing"):
        fill(sheet, tets=100)


def crossed_shells(edge: float = 0.2) -> SurfaceMesh:
    """A hollow ball with a wall of 2 cm, and a bar that crosses it."""
    ball = sphere_surface(radius=0.5, edge_length=edge)
    bar = box_surface((0.3, 0.05, 0.02), (3, 1, 1))
    return joined(ball, ball.transformed(0.96).flipped(), moved(bar, 0.5, 0.0, 0.0))


def test_a_lattice_that_is_coarser_than_walls_says_so() -> None:
    """Not after minutes, with finer and finer lattices, nor for lack of memory."""
    with pytest.raises(MeshingError, match=r"its walls are thinner than edges, .* m; ask for more tets \(tets=\d+\)"):
        fill(crossed_shells(), tets=20_000, mesher="stuffing")


def test_a_lattice_of_ten_times_the_tets_is_a_question() -> None:
    """The first one that keeps a wall of 7.5 cm has thousands of tets."""
    ball = sphere_surface(radius=0.5, edge_length=0.2)
    with pytest.raises(
        MeshingError, match=r"keeps the surface's walls has \S+ tets, \d+ times the 120 that were asked"
    ):
        fill(joined(ball, ball.transformed(0.85).flipped()), tets=120, mesher="stuffing")


def test_thin_walls_that_cross_are_united() -> None:
    """A cavity and a bar through its wall, at the number of tets and with the volume of their union."""
    surface = crossed_shells(0.1)
    mesh, report = tetrahedralize_reported(surface, tets=4000)
    assert report.mesher == "mmg"
    assert len(mesh.tets) == pytest.approx(4000, rel=0.15)
    assert mesh.components.count == 1
    wall = (1.0 - 0.96**3) * sphere_surface(radius=0.5, edge_length=0.1).volume
    assert mesh.volume == pytest.approx(wall + 0.28 * 0.05 * 0.02, rel=0.02)


def test_a_component_that_faces_inward_is_a_cavity_within_others_and_a_solid_outside() -> None:
    ball = sphere_surface(radius=0.5, edge_length=0.2)
    inner, outer = ball.transformed(0.4).flipped(), moved(ball, 0.6, 0.02, 0.01).flipped()
    third = moved(ball, -0.6, 0.02, 0.01)
    mesh, report = tetrahedralize_reported(joined(ball, inner, outer, third), tets=1500)
    assert report.mesher == "mmg"
    two = tetrahedralize_reported(joined(ball, moved(ball, 0.6, 0.02, 0.01), third), tets=1500)[0]
    assert mesh.volume == pytest.approx(two.volume - 0.4**3 * ball.volume, rel=0.01)
