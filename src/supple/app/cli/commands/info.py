"""`supple info`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from supple.app.cli.arguments import Confine, whole_number
from supple.app.cli.console import print_table

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from supple.app.scene_file.loader import Run
    from supple.mesh.surface import SurfaceMesh
    from supple.mesh.tetmesh import TetMesh
    from supple.model.state import State
    from supple.model.system import System
    from supple.scene.body import PlacedBody
    from supple.scene.scene import Scene

SCENE_FILES = (".yaml", ".yml", ".urdf", ".xacro")
RECORDINGS = (".vtkhdf", ".hdf", ".h5")
PACKAGES = ("numpy", "scipy", "numba", "h5py", "tetgen", "websockets", "pydantic")
EXTRAS = ("pymeshfix", "pycollada", "loky", "usd-core", "pyvista")


def info(
    file: Path | None = None,
    /,
    *,
    time: Annotated[bool, Parameter(negative="")] = False,
    modes: Annotated[int | None, Parameter(converter=whole_number)] = None,
    confine: Confine = False,
) -> None:
    """Print what a file contains: counts, sizes, quality, problems. Without a file: versions, platform and threads.

    Parameters
    ----------
    file
        A scene (.yaml), a robot (.urdf), a surface, a tet mesh, a recording (.vtkhdf) or a run folder.
    time
        Of a scene: simulate its first frames, and print how long one takes. The first run of a solver compiles it.
    modes
        Of a scene: the frequencies of this many natural modes about its start.
    confine
        Of a scene: read meshes from the folder of its file, and folders below, only.
    """
    if file is None:
        print_table(_platform(), "Supple")
        return
    if file.is_dir():
        from supple.app.cli.run_rows import run_rows

        print_table(run_rows(file), str(file))
        return
    suffix = file.suffix.lower()
    if suffix in SCENE_FILES:
        _scene(file, time, modes, confine)
    elif suffix in RECORDINGS:
        _recording(file)
    else:
        _mesh(file, suffix)


def _platform() -> list[tuple[str, str]]:
    import os
    import platform
    from importlib.metadata import PackageNotFoundError, version

    import supple

    rows = [
        ("supple", supple.__version__),
        ("python", f"{platform.python_version()} ({platform.python_implementation()})"),
        ("platform", platform.platform()),
        ("processors", str(os.cpu_count())),
    ]
    import numba

    rows.append(("threads", str(numba.get_num_threads())))
    for name in (*PACKAGES, *EXTRAS):
        try:
            rows.append((name, version(name)))
        except PackageNotFoundError:
            rows.append((name, "not installed (an extra)" if name in EXTRAS else "missing"))
    return rows


def _extent(low: np.ndarray, high: np.ndarray) -> str:
    return " x ".join(f"{x:.6g}" for x in high - low) + " m"


def _surface_rows(surface: SurfaceMesh, file: Path) -> list[tuple[str, str]]:
    from supple.mesh.meshing.child_process import DEFAULT_TETS
    from supple.mesh.meshing.option_names import named_for, option
    from supple.mesh.meshing.sizes import needed_by_walls
    from supple.mesh.meshing.units import millimetres_hint

    report = surface.check()
    thickness, needed = needed_by_walls(surface) if report.watertight else (0.0, 0)
    tets = f"about {DEFAULT_TETS:,} where no size is given"
    if needed > DEFAULT_TETS:
        tets = f"about {needed:,} or more: walls are {thickness:.2g} m thick on average"
    with named_for("shell"):
        hint = millimetres_hint(file, surface.vertices)
        repair = "" if report.ok else f"\nmesh it with {option('repair', True)}"
    return [
        ("kind", "surface"),
        ("vertices", str(len(surface.vertices))),
        ("triangles", str(len(surface.triangles))),
        ("components", str(report.component_count)),
        ("size", _extent(*surface.bounds)),
        ("area", f"{surface.area:.6g} m^2"),
        ("volume", f"{surface.volume:.6g} m^3" if report.watertight else "none, the surface is open"),
        ("tets", tets),
        ("as a shell", _as_shell(surface, file)),
        ("problems", "none" if report.ok else "\n".join(report.problems) + repair),
        *([("warning", hint)] if hint else []),
    ]


def _as_shell(surface: SurfaceMesh, file: Path) -> str:
    """Whether it can be one, see `Shell`."""
    from supple.errors import MeshError
    from supple.mesh.shell_mesh import ShellMesh

    try:
        ShellMesh(surface)
    except MeshError as error:
        return f"not possible: {error}"
    return f"possible: supple view {file} --shell"


def _tet_rows(mesh: TetMesh) -> list[tuple[str, str]]:
    return [
        ("kind", "tetrahedral mesh" if mesh.order == 1 else "mesh of quadratic tetrahedra"),
        ("vertices", str(len(mesh.vertices))),
        ("tets", str(len(mesh.tets))),
        ("edges", str(len(mesh.edges))),
        ("surface triangles", str(len(mesh.surface.triangles))),
        ("components", str(mesh.components.count)),
        ("size", _extent(mesh.vertices.min(axis=0), mesh.vertices.max(axis=0))),
        ("volume", f"{mesh.volume:.6g} m^3"),
        ("tet volumes", f"{mesh.volumes.min():.3g} to {mesh.volumes.max():.3g} m^3"),
        ("smallest dihedral", f"{mesh.min_dihedrals.min():.2f} degrees (tet {int(mesh.min_dihedrals.argmin())})"),
        ("radius ratio", f"worst {mesh.radius_ratios.min():.3f}, mean {mesh.radius_ratios.mean():.3f} (1 is regular)"),
        ("tets reoriented", str(mesh.reoriented)),
    ]


def _mesh(file: Path, suffix: str) -> None:
    from supple.errors import MeshError
    from supple.mesh.io.mesh_files import READERS
    from supple.mesh.io.tetgen_family import SUFFIXES
    from supple.mesh.mesh_file import load_mesh
    from supple.mesh.tetmesh import TetMesh

    known = (*SCENE_FILES, *RECORDINGS[:1], *READERS, *SUFFIXES)
    if suffix not in known:
        raise MeshError(f"{file}: unknown extension {suffix or '(none)'}; known are {', '.join(known)}")
    mesh = load_mesh(file)
    rows = _tet_rows(mesh) if isinstance(mesh, TetMesh) else _surface_rows(mesh, file)
    if isinstance(mesh, TetMesh) and suffix in (".inp", ".msh", ".mesh"):
        rows += [(f"sets of {kind}", listed) for kind, listed in mesh.sets.listed().items()]
    print_table(rows, str(file))


def _scene(file: Path, timed: bool, modes: int | None, confine: bool) -> None:
    from supple.app.cli.console import reading
    from supple.app.scene_file.loader import load_run
    from supple.model.system import build_system, initial_state

    with reading():
        run = load_run(file, confine=confine)
    start = initial_state(run.scene, **{key.removeprefix("initial_"): value for key, value in run.start.items()})
    scene, system = run.scene, build_system(run.scene, start)
    rows = [
        ("kind", "scene"),
        *_counted(system),
        ("solver", run.chosen_solver.account),
        ("time", f"{run.steps} steps of {run.dt:.6g} s: {run.steps * run.dt:.6g} s"),
        ("memory", f"about {run.chosen_solver.bytes_needed(scene) / 1e6:.3g} MB beyond that of the program"),
        ("intersections", _start_problem(system, start)),
        ("each frame", _frame_time(run) if timed else "--time simulates the first ones, and says how long one takes"),
        *_frequencies(scene, start, modes),
        *_described(system, system.split(start.positions)),
    ]
    print_table(rows, str(file))


def _counted(system: System) -> list[tuple[str, str]]:
    """How many things a scene has, and their names."""
    from supple.results.recording.thin_cells import ThinCells

    scene = system.scene
    counts = {3: 0, 2: 0}
    for _, cells in ThinCells(system.bodies).parts:
        counts[cells.shape[1]] += len(cells)
    return [
        ("bodies", str(len(scene.bodies))),
        ("vertices", str(len(system.masses))),
        ("tets", str(len(system.tets))),
        *([("triangles", f"{counts[3]} of shells")] if counts[3] else []),
        *([("edges", f"{counts[2]} of rods")] if counts[2] else []),
        ("obstacles", ", ".join(f"{o.name} ({type(o).__name__})" for o in scene.obstacles) or "none"),
        ("pins", ", ".join(f"{p.pin.label}: {len(p.vertices)} vertices" for p in system.pins) or "none"),
        ("loads", ", ".join(load.label for load in scene.loads) or "none"),
        ("sensors", ", ".join(sensor.label for sensor in scene.sensors) or "none"),
    ]


def _described(system: System, points: Mapping[str, np.ndarray]) -> list[tuple[str, str]]:
    """What each thing of a scene is; points : of each body at the start [m]."""
    from supple.scene.registry import PARTS

    rows, scene = [], system.scene
    for body in scene.bodies:
        rows += [(f"place of {body.name}", _place(points[body.name])), (f"body {body.name}", body.facts(scene))]
        rows += _locking_rows(body)
    for part in system.actuators:
        unit = "m^3" if part.kind == "cavity" else "m"
        rows.append((f"{part.kind} {part.name}", f"{part.start:.6g} {unit} at the start"))
    things = (thing for key in PARTS if key != "bodies" for thing in getattr(scene, key))
    return rows + [(thing.label, facts) for thing in things if (facts := thing.facts(scene))]


def _place(x: np.ndarray) -> str:
    """The bounding box of points (n, 3) [m]."""
    low, high = (", ".join(f"{value:.4g}" for value in corner) for corner in (x.min(axis=0), x.max(axis=0)))
    return f"({low}) to ({high}) m"


def _start_problem(system: System, start: State) -> str:
    """Which surfaces are not apart at the start; of stitched or welded things, the solver decides."""
    from supple.contact.start.start_error import raise_if_intersecting
    from supple.errors import SceneError
    from supple.scene.contact_pairs import pair_table

    try:
        raise_if_intersecting(system, start.positions, start.time, pair_table(system.scene), joined=False)
    except SceneError as problem:
        return str(problem)
    joined = len(system.scene.stitches) + len(system.scene.welds) > 0
    return "none at the start" + joined * "; things that are stitched or welded to each other are not compared"


def _frame_time(run: Run) -> str:
    """Time of the fastest of the first frames after the one that may compile."""
    from supple.simulate import simulate

    start: dict[str, Any] = {**run.start}
    reports = [frame.report for frame in simulate(run.scene, run.chosen_solver, run.dt, 4, **start)]
    seconds = min(report.wall_seconds for report in reports[1:] or reports)
    whole = seconds * run.steps
    return f"{1e3 * seconds:.3g} ms at the start; {run.steps} steps take about {whole:.3g} s if all are like these"


def _frequencies(scene: Scene, start: State, count: int | None) -> list[tuple[str, str]]:
    """Of the natural modes, where they are asked for."""
    from supple.app.studies.modes import modes

    if count is None:
        return []
    return [("frequencies", "\n".join(f"{f:.6g} Hz" for f in modes(scene, count, start=start).frequencies))]


# Of the surface: below it, a few thin parts such as edges of a wedge are not worth a warning.
_THIN_SHARE = 0.1


def _locking_rows(body: PlacedBody) -> list[tuple[str, str]]:
    """A warning where nearly incompressible tets are too few across to deform (docs/theory/locking.md)."""
    import numpy as np

    from supple.materials.material import Hyperelastic
    from supple.mesh.quality import thickness

    material, mesh = body.material, body.mesh
    if not isinstance(material, Hyperelastic) or mesh.order == 2:
        return []
    poisson = np.broadcast_to(np.asarray(material.poisson, dtype=np.float64), len(mesh.tets))
    locking = poisson > 0.4
    if not locking.any():
        return []
    lines = thickness(mesh.vertices, mesh.tets, limit=9)
    thin = (lines.crossed < 9) & locking[lines.tets]
    share = lines.areas[thin].sum() / lines.areas.sum()
    if share <= _THIN_SHARE:
        return []
    text = (
        f"{100 * share:.0f} % of the surface has fewer than three tets across behind it, with Poisson's ratio up to "
        f"{poisson[locking].max():g}: linear tets are too stiff there; give quadratic tets "
        "(order: 2, for Implicit only), or smaller tets"
    )
    return [(f"warning {body.name}", text)]


def _time_error(largest: float) -> list[tuple[str, str]]:
    """Only some integrators estimate it."""
    return [] if largest != largest else [("time error", f"at most {largest:.3g} m (RMS) in a step")]


def _recording(file: Path) -> None:
    import numpy as np

    from supple.results.recording.reader import read_recording

    with read_recording(file) as recording:
        J = recording.series("min_det_F")
        soft = [body for body in recording.bodies if not body.rigid]
        rows = [
            ("kind", "recording"),
            ("frames", f"{len(recording)} to t = {recording.times[-1]:.6g} s, dt = {recording.dt:.6g} s"),
            *_counted(recording.system),
            ("volume", f"{sum(recording.rest_volumes[b.tets].sum() for b in soft):.6g} m^3 of soft bodies at rest"),
            ("mass", f"{recording.masses.sum():.6g} kg"),
            ("solver", recording.solver or "unknown"),
            ("smallest J", f"{J.min():.6g} at t = {recording.times[int(np.argmin(J))]:.6g} s"),
            *_time_error(recording.largest("details/time_error")),
            ("ended", str(recording.statuses[-1])),
            ("scene file", "inside" if recording.scene_text else "none"),
            ("written by", f"supple {recording.supple_version}"),
            *_described(recording.system, recording[0].positions),
        ]
        if recording.scene.stitching.names.breakable:
            broken = len(recording.broken_stitches(len(recording) - 1))
            rows.append(("stitches", f"{broken} of {len(recording.stitches)} pairs have broken at the end"))
        problems = [*(["a tetrahedron is inverted or flat (J <= 0)"] if J.min() <= 0.0 else [])]
        problems += [recording.unfinished] if recording.unfinished else []
        rows.append(("problems", "; ".join(problems) or "none"))
    print_table(rows, str(file))
