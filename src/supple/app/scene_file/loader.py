"""From a scene file to a scene, and to a whole run."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from supple.app.scene_file.document import OutputModel, SceneFileModel, scene_file_model
from supple.app.scene_file.entries.kinds import built
from supple.app.scene_file.entries.mesh_sources import MESH_FILES, ConfinedMeshStore, MeshStore
from supple.app.scene_file.new_scenes import read_surface_scene
from supple.app.scene_file.urdf.document import read_urdf
from supple.app.scene_file.validation_errors import scene_error
from supple.app.scene_file.yaml_files import Key, YamlDocument, read_yaml
from supple.errors import SceneError
from supple.mesh.meshing.option_names import named_for
from supple.model.system import build_system, initial_state
from supple.scene.body import PlacedBody
from supple.scene.inputs import MotorInput
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.joint import Joint
from supple.scene.located import LocatedError, at
from supple.scene.registry import PARTS
from supple.scene.scene import Scene
from supple.solvers.auto import Auto, solver_for
from supple.solvers.solver import Solver

logger = logging.getLogger(__name__)

URDF_FILES = (".urdf", ".xacro")


@dataclass(frozen=True, eq=False)
class Run:
    """The contents of a scene file: `simulate(run.scene, run.solver, run.dt, run.steps, **run.start)`.

    Attributes
    ----------
    scene, solver : what to simulate, and how; `Auto` where the file leaves the choice to the scene
    dt : time from frame to frame [s]; steps : number of frames
    initial_positions : by body name, (n, 3) [m], of bodies that start deformed
    output : what to write beside the recording
    text : of the file, stored in the recording
    description : the content of the file, with all defaults; folder : that paths in it are relative to
    """

    scene: Scene
    solver: Solver | Auto
    dt: float
    steps: int
    initial_positions: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    output: OutputModel = field(default_factory=OutputModel)
    text: str | None = None
    description: SceneFileModel | None = None
    folder: Path = Path()

    @cached_property
    def chosen_solver(self) -> Solver:
        """The solver; of `Auto`, the one that suits the scene."""
        if isinstance(self.solver, Solver):
            return self.solver
        return solver_for(self.solver, build_system(self.scene, initial_state(self.scene)), self.dt)

    @property
    def start(self) -> dict[str, dict[str, NDArray[np.float64]]]:
        """The keywords of `simulate` for the start of the bodies."""
        return {"initial_positions": self.initial_positions} if self.initial_positions else {}


def load_scene(path: str | Path, *, confine: bool = False) -> Scene:
    """The scene of a scene file (YAML), or of a robot (URDF). Paths in it are relative to the file.

    The format of scene files: `supple schema`; what is read of a URDF: docs/learn/robots.md.

    Solver, timing and deformed starts in the file are checked too, but only `load_run` returns them.

    Parameters
    ----------
    path : of the scene file.
    confine : whether meshes are read from the folder of the file, and folders below, only; for files of strangers.

    Raises
    ------
    SceneError : where the file cannot be read or is not a valid scene; one line that begins with `file:line:`.
    """
    run = load_run(path, confine=confine)
    for name in run.initial_positions:
        logger.warning("%s: the deformed start of %r is not a part of the scene; load_run returns it", path, name)
    return run.scene


def load_run(path: str | Path, *, confine: bool = False, scale: float | None = None, shell: bool = False) -> Run:
    """The scene of a scene file, with its solver, timing and start.

    Parameters
    ----------
    path : of the scene file (YAML), of a robot (URDF), or of a surface, which becomes a body above a floor.
    confine : as of `load_scene`
    scale : factor of the coordinates of a surface; shell : whether it becomes a thin sheet; see `scene_of_surface`

    Raises
    ------
    SceneError : where the file cannot be read or is not a valid scene; one line that begins with `file:line:`.
    """
    store, suffix = (ConfinedMeshStore if confine else MeshStore)(Path(path).parent), Path(path).suffix.lower()
    if shell and suffix not in MESH_FILES:
        raise SceneError(f"{path}: `shell` is of a file of a surface; a body of a scene file has `shell: {{...}}`")
    if suffix in URDF_FILES:
        document = read_urdf(path, store)
        if pairs := overlaps(run_of(path, document, store).scene):
            document = document.with_pairs(pairs)
    else:
        document = read_surface_scene(path, scale, shell) if suffix in MESH_FILES else read_yaml(path)
    return run_of(path, document, store)


def run_of(path: str | Path, document: YamlDocument, store: MeshStore) -> Run:
    """The run that a document describes, with meshes of a store, which makes equal ones once; see `load_run`."""
    model = validated(document)
    try:
        with named_for("yaml"):
            run = _built(model, store)
        return replace(run, text=document.text, description=model, folder=Path(path).parent)
    except LocatedError as error:
        if Path(path).suffix.lower() in MESH_FILES:  # its lines are not those of the document
            raise SceneError(f"{path}: {error}") from None
        raise document.error(_keys_of_message(document.data, error.keys, str(error)), str(error)) from None


def overlaps(scene: Scene) -> list[tuple[str, str]]:
    """The pairs of bodies whose surfaces meet where the scene places them, or are inside each other."""
    from supple.contact.start.intersections import intersections_of
    from supple.contact.start.surfaces import start_surfaces
    from supple.model.system import build_system, initial_state
    from supple.scene.contact_pairs import pair_table

    start = initial_state(scene)
    surfaces = start_surfaces(build_system(scene, start), start.positions, start.time)
    found = intersections_of(surfaces, pair_table(scene))
    return list({(scene.bodies[one.first].name, scene.bodies[one.second].name): None for one in found})


def validated(document: YamlDocument) -> SceneFileModel:
    """The contents of a scene file, of which no mesh was read or made yet.

    Raises
    ------
    SceneError : where a value is missing, unknown or not allowed; one line that begins with `file:line:`.
    """
    try:
        return scene_file_model().model_validate(document.data)
    except ValidationError as error:
        raise scene_error(document, error) from None


def _built(model: SceneFileModel, meshes: MeshStore) -> Run:
    bodies: dict[str, PlacedBody] = {}
    starts: dict[str, NDArray[np.float64]] = {}
    for i, described in enumerate(model.bodies):
        with at("bodies", i):
            for made in described.build(meshes):
                if made.body.name in bodies:
                    raise SceneError(f"another body has the name {made.body.name!r}; give each a different name")
                bodies[made.body.name] = made.body
                meshes.sources[made.body.name] = described.mesh
                if made.initial_positions is not None:
                    starts[made.body.name] = made.initial_positions
    parts: dict[str, list[Any]] = {}
    for key in PARTS:
        if key != "bodies":
            with at(key):
                parts[key] = built(getattr(model, key), meshes)
    parts["joints"] = with_shared_inputs(parts["joints"])
    with at("solver"):
        solver = built(model.solver, meshes)
    with at():
        scene = Scene(list(bodies.values()), gravity=model.gravity, **parts)
    if model.joint_positions:
        with at("joint_positions"):
            there, scene = scene, scene.with_joint_positions(model.joint_positions)
            for name in starts:
                if _is_moved(there.body(name), scene.body(name)):
                    raise SceneError(f"they move body {name!r}, which has a deformed start; remove one of the two")
    with at():
        # The pairs are found here, where an error's place in the file is known; the scene caches them.
        logger.debug("%d stitched pairs", len(scene.stitching))
    return Run(scene, solver, model.dt, model.steps, starts, model.output)


def _is_moved(before: PlacedBody, after: PlacedBody) -> bool:
    return any(not np.array_equal(getattr(before, key), getattr(after, key)) for key in ("position", "rotation"))


def _keys_of_message(data: Any, keys: tuple[Key, ...], message: str) -> tuple[Key, ...]:
    """`keys`, and the first key below them that the message names after its subject."""
    for key in keys:
        if not (isinstance(data, list) and isinstance(key, int)) and not (isinstance(data, dict) and key in data):
            return keys
        data = data[key]  # pyright: ignore[reportCallIssue, reportArgumentType]
    if isinstance(data, dict):
        for word in re.findall(r"\w+", re.sub(r"^[^:]*: ", "", message)):
            if word in data:
                return (*keys, word)
    return keys


def with_shared_inputs(joints: Sequence[Joint]) -> list[Joint]:
    """The joints with one input for each name.

    Raises
    ------
    SceneError : where one begins at two values.
    """
    inputs: dict[str, MotorInput] = {}
    found = []
    for i, joint in enumerate(joints):
        motor = joint.motor if isinstance(joint, AxisJoint) else None
        if isinstance(joint, AxisJoint) and motor is not None and isinstance(motor.script, MotorInput):
            one = inputs.setdefault(motor.script.name, motor.script)
            if one.value != motor.script.value:
                with at("joints", i, "motor"):
                    raise SceneError(
                        f"input {one.name!r} begins at {float(motor.script.value):g} here and at {float(one.value):g} "
                        "in a joint above; give both one value, or each a name"
                    )
            joint = replace(joint, motor=motor.scripted(one))
        found.append(joint)
    return found
