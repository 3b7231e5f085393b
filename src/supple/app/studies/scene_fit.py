"""Values of a scene file that fit measurements: markers of a film, or the force of a test over its displacement.

Parameters are dotted paths into the file, as factors of studies are. Both files are tables; each frame that is near a
row of it is compared with the table's value at the frame, which is interpolated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.app.scene_file.entries.mesh_sources import MeshStore
from supple.app.scene_file.loader import Run, run_of, validated
from supple.app.scene_file.paths import value_at, with_values
from supple.app.scene_file.yaml_files import YamlDocument, read_yaml, yaml_text
from supple.app.studies.sources import digest_of, mesh_files
from supple.errors import SceneError, SolverError
from supple.gradients.fit import SimulationFit, fit_simulation
from supple.gradients.misfit import Misfit
from supple.gradients.sensitivity import Sensitivity
from supple.kinds.suggestion import suggestion
from supple.materials.fit_files import FORCES, LENGTHS, LOAD, TIMES, TRAVEL, Table, column
from supple.mesh.skin import Embedding
from supple.model.system import build_system, initial_state
from supple.runtime.replacing import parent_folder, whole_file
from supple.scene.body import PlacedBody
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rotation import rotation_matrix
from supple.solvers.auto import Auto
from supple.solvers.implicit.contact.settings import IPCContact
from supple.solvers.implicit.solver import Implicit

Floats = NDArray[np.float64]

_AXES = ("x", "y", "z")
_NOT_OF_SCENES = ("supple", "solver", "dt", "steps", "output")
# What a file that leaves the choice to the scene is fitted with.
FITTED_WITH = Implicit(integrator="bdf2", tolerance=1e-6, contact=IPCContact(friction_iterations=1))
# Of the diagonal of a body: a marker on a round surface may be so far outside of its mesh, which has flat sides.
_OUTSIDE = 0.05
# Of the largest displacement: noise by which that of a test may go back while it is loaded.
_BACK = 0.01
# Of the distance of two frames: a row is near the frame that is half of it away, up to round-off.
_NEAR = 0.5 + 1e-6


class Parameter(NamedTuple):
    """A path into a scene file, and the values [in the unit of the file] that it may have."""

    path: str
    low: float
    start: float
    high: float

    @classmethod
    def of(cls, text: str, document: YamlDocument) -> Parameter:
        """Of PATH=LOW:HIGH, which starts from the value in the file, or PATH=LOW:START:HIGH."""
        path, _, ends = text.partition("=")
        try:
            values = [float(one) for one in ends.split(":")]
        except ValueError:
            values = []
        if not path or len(values) not in (2, 3) or not np.isfinite(values).all() or values != sorted(set(values)):
            raise SceneError(f"--parameters {text}: give PATH=LOW:HIGH, such as bodies.bear.material.youngs=1e4:1e6")
        given, above = value_at(document.data, path), path.rpartition(".")[0]
        if path.partition(".")[0] in _NOT_OF_SCENES:
            raise SceneError(
                f"--parameters {text}: {path} is not a part of the scene; give a path of a body, a load ..."
            )
        if above and value_at(document.data, above) is None:
            raise SceneError(f"{path}: {document.path} has no {above}; write it there")
        for value in values:  # says what a path lacks
            validated(replace(document, data=with_values(document.data, {path: value})))
        if len(values) == 2:
            if isinstance(given, bool) or not isinstance(given, int | float):
                has = "no value" if given is None else f"the value {given!r}"
                raise SceneError(f"{path}: {document.path} has {has}; give {path}=LOW:START:HIGH")
            if not values[0] <= given <= values[1]:
                raise SceneError(f"{path}: its value {given:g} in {document.path} is not in {ends}; give other bounds")
            values.insert(1, float(given))
        return cls(path, *values)


class Compared(NamedTuple):
    """A misfit; over : see `SimulationFit.plot`"""

    misfit: Misfit
    over: tuple[str, str, Floats] | None


@dataclass(frozen=True, eq=False)
class SceneFit:
    """A scene file, what varies in it, and what was measured."""

    document: YamlDocument
    parameters: tuple[Parameter, ...]
    data: tuple[Path, ...]
    sensitivity: Sensitivity
    over: tuple[str, str, Floats] | None

    @classmethod
    def of(cls, path: str | Path, parameters: Sequence[str], data: Sequence[Path], of: str | None = None) -> SceneFit:
        """Read the files.

        Parameters
        ----------
        parameters : texts such as "bodies.bear.material.youngs=1e4:1e6"
        data : CSV files
        of : the body of markers, or the pin or obstacle of a force; None: the only one, or the only one that moves

        Raises
        ------
        SceneError, SolverError : where a file, a path, a unit or a name cannot be used.
        """
        document, store = read_yaml(path), MeshStore(Path(path).parent)
        varied = tuple(Parameter.of(text, document) for text in parameters)
        paths = [one.path for one in varied]
        if not paths or len(set(paths)) < len(paths):
            raise SceneError("fit: give --parameters, each path once")

        def run_at(p: Any) -> Run:
            data = with_values(document.data, dict(zip(paths, map(float, p), strict=True)))
            return run_of(path, replace(document, data=data), store)

        run = run_at([one.start for one in varied])
        if run.initial_positions:
            raise SceneError(f"{path}: body {next(iter(run.initial_positions))!r} starts deformed, which is not fitted")
        solver = FITTED_WITH if isinstance(run.solver, Auto) else run.solver
        if not isinstance(solver, Implicit):
            raise SolverError(f"{path}: {solver.label} has no derivatives; give solver: {{kind: implicit}}")
        if not data:
            raise SceneError("fit: give --data, a CSV file of markers, or of force over displacement")
        compared = [one for file in data for one in _compared(Path(file), run, of)]
        steps = max(max(one.misfit.frames(run.steps)) for one in compared)
        one = Sensitivity(
            lambda p: run_at(p).scene,
            [one.misfit for one in compared],
            solver,
            run.dt,
            steps,
            scales=[max(abs(one.start), 1e-3 * (one.high - one.low)) for one in varied],
        )
        return cls(document, varied, tuple(map(Path, data)), one, compared[0].over if len(compared) == 1 else None)

    @property
    def start(self) -> Floats:
        """(q,) where the parameters start."""
        return np.array([one.start for one in self.parameters])

    def run(self, folder: Path, evaluations: int, report: Callable[[str], None]) -> tuple[SimulationFit, list[Path]]:
        """Fit, and write a scene with the values, and a picture; the fit, and the files.

        Every run is a line of a file in the folder; the same fit goes on from there.
        """
        texts = [self.document.text, *(file.read_bytes().hex() for file in self.data)]
        names = [one.path for one in self.parameters]
        log = folder / f"runs-{digest_of(*texts, *names)}.csv"
        parent_folder(log)
        found = fit_simulation(
            self.sensitivity,
            self.start,
            bounds=([one.low for one in self.parameters], [one.high for one in self.parameters]),
            names=names,
            max_evaluations=evaluations,
            log=log,
            report=report,
        )
        values = dict(zip(names, map(float, found.values), strict=True))
        data = with_values(self.document.data, values)
        for entry in mesh_files(data):
            entry["file"] = str((self.document.path.parent / entry["file"]).absolute())
        head = [f"fitted to {', '.join(file.name for file in self.data)}", *str(found).splitlines()]
        scene = folder / "fitted.yaml"
        with whole_file(scene) as fresh:
            fresh.write_text("".join(f"# {line}\n" for line in head) + yaml_text(data), encoding="utf-8")
        return found, [scene, found.plot(folder / "fit.png", self.over), log]


def _compared(path: Path, run: Run, of: str | None) -> list[Compared]:
    def is_markers(names: Sequence[str]) -> bool:
        wanted = (("time",), ("vertex", "marker"), *((axis,) for axis in _AXES))
        return all(column(names, starts) is not None for starts in wanted)

    def is_test(names: Sequence[str]) -> bool:
        return column(names, TRAVEL) is not None and column(names, LOAD) is not None

    expected = "name them time, vertex or marker, x, y and z; or displacement and force"
    table = Table.read(path, lambda names: is_markers(names) or is_test(names), expected)
    if not table.rows:
        raise SceneError(f"{path}: has no rows")
    return _markers(table, run, of) if is_markers(table.names) else [_force(table, run, of)]


def _markers(table: Table, run: Run, of: str | None) -> list[Compared]:
    """The positions of vertices, and of places that a name marks, whose row at time 0 says where they are."""
    bodies = [body.name for body in run.scene.bodies]
    name = of or (bodies[0] if len(bodies) == 1 else "")
    if name not in bodies:
        what = f"body {of!r} does not exist" if of else "of which body are the markers"
        raise SceneError(f"{table.path}: {what}; give --of, {suggestion(name, bodies)}")
    body = run.scene.body(name)
    times = table.numbers(table.place("time"), "time", TIMES, default="s")
    names = table.texts(table.place("vertex", "marker"))
    columns = [table.numbers(table.place(axis), axis, LENGTHS, default="m", gaps=True) for axis in _AXES]
    x = np.stack(columns, axis=1)
    frames = np.arange(1, run.steps + 1, dtype=np.float64)
    found = []
    for of_vertices in (True, False):
        chosen = [one for one in dict.fromkeys(names) if one.isdecimal() == of_vertices]
        if not chosen:
            continue
        target, places = np.full((run.steps, len(chosen), 3), np.nan), []
        for j, one in enumerate(chosen):
            rows = np.flatnonzero(np.array(names) == one)
            rows = rows[np.argsort(times[rows], kind="stable")]
            if of_vertices and int(one) >= len(body.points):
                line = table.rows[rows[0]][0]
                raise SceneError(f"{table.path}:{line}: body {name!r} has vertices 0 to {len(body.points) - 1}")
            if not of_vertices:
                places.append(_place(body, table, rows[0], one, float(times[rows[0]]), x[rows[0]]))
            for axis in range(3):
                known = rows[np.isfinite(x[rows, axis])]
                target[:, j, axis] = _at(frames * run.dt, times[known], x[known, axis], run.dt)
        used = np.isfinite(target).any(axis=(1, 2))
        if not used.any():
            ends = f"{times.min():.6g} to {times.max():.6g}"
            raise SceneError(
                f"{table.path}: its times, {ends} s, have no frame of the run beside the start, which is "
                f"{run.steps * run.dt:.6g} s long; correct them, or steps and dt of the scene"
            )
        size = float(np.nanmax(np.abs(target[used] - np.nanmean(target[used], axis=0)), initial=0.0))
        where = {"vertices": [int(one) for one in chosen]} if of_vertices else {"points": places}
        weight = 1.0 / size**2 if size else 1.0
        misfit = Misfit("positions", name, target[used], frames=frames[used].tolist(), weight=weight, **where)
        found.append(Compared(misfit, None))
    return found


def _place(body: PlacedBody, table: Table, row: int, name: str, time: float, at: Floats) -> Floats:
    """(3,) in the body's own coordinates."""
    where = f"{table.path}:{table.rows[row][0]}: marker {name!r}"
    if time != 0.0 or not np.isfinite(at).all():
        raise SceneError(f"{where} has no row at time 0, which says where it is on the body; add it, or name vertices")
    place = (at - np.asarray(body.position)) @ rotation_matrix(body.rotation)
    if not isinstance(body, RigidBody):
        mesh, held = body.mesh, Embedding.of(body.mesh, place[None])
        corners = mesh.vertices[mesh.tets[held.tets[0]]]
        weights = np.linalg.solve(np.vstack([corners.T, np.ones(4)]), [*place, 1.0])
        inside = np.maximum(weights, 0.0)
        off = float(np.linalg.norm(place - inside @ corners / inside.sum()))
        if off > _OUTSIDE * float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))):
            raise SceneError(f"{where} is {off:.2g} m outside of body {body.name!r} at time 0; check units and axes")
    return place


def _force(table: Table, run: Run, of: str | None) -> Compared:
    """The force of a pin or obstacle on what it moves, along its way."""
    displacement = table.numbers(table.place(*TRAVEL), "displacement", LENGTHS, default="m")
    force = table.numbers(table.place(*LOAD), "force", FORCES, default="N")
    # Machines count either direction as positive; what is moved resists.
    displacement = displacement * np.sign(displacement[np.abs(displacement).argmax()])
    force = force * (np.sign(displacement @ force) or 1.0)
    end = int(displacement.argmax()) + 1
    displacement, force = displacement[:end], force[:end]
    back = np.maximum.accumulate(displacement) - displacement
    if back.max() > _BACK * displacement[-1]:
        line = table.rows[int(back.argmax())][0]
        raise SceneError(f"{table.path}:{line}: the displacement goes back; keep the rows of one loading")
    order = np.argsort(displacement, kind="stable")
    times = np.asarray(run.dt * np.arange(run.steps + 1), dtype=np.float64)
    moved = _motions(run, times)
    moving = [name for name, path in moved.items() if np.abs(path).max() > 0.0]
    name = of or (moving[0] if len(moving) == 1 else "")
    if name not in moving:
        what = "the force of which pin or obstacle is it" if of is None else f"pin or obstacle {of!r} does not move"
        raise SceneError(f"{table.path}: {what}; give --of, {suggestion(name, moving) if moving else 'and a motion'}")
    path = moved[name]
    far = int(np.linalg.norm(path, axis=1).argmax())
    along = path[far] / np.linalg.norm(path[far])
    gone = path[: far + 1] @ along
    target = np.full(run.steps, np.nan)
    spacing = np.maximum(np.gradient(gone), np.finfo(float).tiny)[1:] if far else np.ones(0)
    target[:far] = _at(gone[1:], displacement[order], force[order], spacing)
    used = np.isfinite(target)
    if not used.any():
        raise SceneError(
            f"{table.path}: its displacements, up to {displacement[-1]:.3g} m, are those of no frame, which go up to "
            f"{gone[-1]:.3g} m; check the unit, or the motion of {name!r}"
        )
    frames = (np.flatnonzero(used) + 1).tolist()
    weight = 1.0 / max(float(np.abs(target[used]).max()), np.finfo(float).tiny) ** 2
    misfit = Misfit("reaction", name, target[used], along=along, frames=frames, weight=weight)
    return Compared(misfit, ("displacement [m]", f"force of {name} [N]", gone[frames]))


def _motions(run: Run, times: Floats) -> dict[str, Floats]:
    """(f, 3) how far each pin and obstacle is from its place at the start [m], by name."""
    system, found = build_system(run.scene, initial_state(run.scene)), {}
    for pin in system.pins:
        means = np.array([(pin.targets(time) - pin.anchors).mean(axis=0) for time in times])
        found[pin.pin.name or f"{pin.pin.body}.pin"] = means - means[0]
    for obstacle in system.obstacles:
        poses = [obstacle.pose(time) for time in times]
        centers = np.array([R @ obstacle.center + t for R, t in poses])
        found[str(obstacle.name)] = centers - centers[0]
    return found


def _at(places: Floats, known: Floats, values: Floats, spacing: Any) -> Floats:
    """(f,) values at places, from those at `known` places, which rise; NaN where none of these is near.

    spacing : of places, half of which is near
    """
    if not len(known):
        return np.full(len(places), np.nan)
    after = np.clip(np.searchsorted(known, places), 1, len(known) - 1) if len(known) > 1 else np.zeros(len(places), int)
    nearest = np.minimum(np.abs(known[after] - places), np.abs(known[np.maximum(after - 1, 0)] - places))
    slack = 1e-9 * max(float(np.abs(known).max()), np.finfo(float).tiny)
    inside = (places >= known[0] - slack) & (places <= known[-1] + slack)
    return np.where(inside & (nearest <= _NEAR * spacing), np.interp(places, known, values), np.nan)
