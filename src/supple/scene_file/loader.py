"""From a scene file to a scene, and to a whole run."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from supple.errors import SceneError, SuppleError
from supple.scene.body import Body
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.scene_file.complaints import complaint, suggestion
from supple.scene_file.document import OutputModel, SceneFileModel
from supple.scene_file.mesh_sources import MeshStore
from supple.scene_file.yaml_reader import Key, YamlDocument, read_yaml
from supple.solver import Solver

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Run:
    """All that a scene file says: `simulate(run.scene, run.solver, run.dt, run.steps, **run.start)`.

    Attributes
    ----------
    scene, solver : what to simulate, and how
    dt : time from frame to frame [s]; steps : number of frames
    initial_positions : by body name, (n, 3) [m], of bodies that start deformed
    output : what to write beside the recording
    """

    scene: Scene
    solver: Solver
    dt: float
    steps: int
    initial_positions: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    output: OutputModel = field(default_factory=OutputModel)

    @property
    def start(self) -> dict[str, dict[str, NDArray[np.float64]]]:
        """The keywords of `simulate` that say how bodies start."""
        return {"initial_positions": self.initial_positions} if self.initial_positions else {}


def load_scene(path: str | Path) -> Scene:
    """The scene of a scene file (YAML). Paths in it are relative to the file. The format: `supple schema`.

    What the file says of solver, timing and deformed starts is checked too, but only `load_run` returns it.

    Raises
    ------
    SceneError : where the file cannot be read or says something impossible; one line that begins with `file:line:`.
    """
    run = load_run(path)
    for name in run.initial_positions:
        logger.warning("%s: the deformed start of %r is no part of the scene; load_run returns it", path, name)
    return run.scene


def load_run(path: str | Path) -> Run:
    """The scene of a scene file, with its solver, timing and start.

    Raises
    ------
    SceneError : where the file cannot be read or says something impossible; one line that begins with `file:line:`.
    """
    document = read_yaml(path)
    try:
        model = SceneFileModel.model_validate(document.data)
    except ValidationError as error:
        raise complaint(document, error) from None
    meshes = MeshStore(Path(path).parent)
    names: dict[str, Body] = {}
    starts: dict[str, NDArray[np.float64]] = {}
    for i, body in enumerate(model.bodies):
        with _told_where(document, ("bodies", i)):
            for built in body.build(meshes):
                if built.body.name in names:
                    raise SceneError(f"another body has the name {built.body.name!r}; give each a name of its own")
                names[built.body.name] = built.body
                if built.initial_positions is not None:
                    starts[built.body.name] = built.initial_positions
    obstacles, pins = [], []
    for i, obstacle in enumerate(model.obstacles):
        with _told_where(document, ("obstacles", i)):
            obstacles.append(obstacle.build(meshes))
    for i, pin in enumerate(model.pins):
        with _told_where(document, ("pins", i)):
            pins.append(_checked(pin.build(), names))
    with _told_where(document, ("solver",)):
        solver = model.solver.build()
    with _told_where(document, ()):
        scene = Scene(list(names.values()), obstacles, pins, model.gravity)
    return Run(scene, solver, model.dt, model.steps, starts, model.output)


def _checked(pin: Pin, bodies: dict[str, Body]) -> Pin:
    """The pin, if its body and its vertices exist: checked here, where its place in the file is known."""
    if pin.body not in bodies:
        raise SceneError(f"there is no body {pin.body!r}; {suggestion(pin.body, bodies)}")
    body = bodies[pin.body]
    pin.select(body.place(body.mesh.vertices))
    return pin


@contextmanager
def _told_where(document: YamlDocument, keys: tuple[Key, ...]) -> Iterator[None]:
    """Adds file, line and key to an error in building what stands at `keys`."""
    try:
        yield
    except SuppleError as error:
        raise SceneError(str(document.error(_blamed(document, keys, str(error)), str(error)))) from None


def _blamed(document: YamlDocument, keys: tuple[Key, ...], message: str) -> Sequence[Key]:
    """`keys`, and the keys below that the message names."""
    data = document.data
    for key in keys:
        if not isinstance(data, (dict, list)) or (isinstance(data, dict) and key not in data):
            return keys
        data = data[key]  # pyright: ignore[reportCallIssue, reportArgumentType]
    if isinstance(data, dict):
        for word in re.findall(r"\w+", message):
            if word in data and word != "kind":
                return (*keys, word)
    return keys
