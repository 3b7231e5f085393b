"""What a study varies: a scene file, or a function that makes a scene. Either one gives a job for each case."""

from __future__ import annotations

import hashlib
import inspect
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from supple.app.scene_file.loader import Run, load_run, validated
from supple.app.scene_file.paths import unit_of, with_values
from supple.app.scene_file.yaml_files import YamlDocument, read_yaml, yaml_text
from supple.errors import StudyError
from supple.runtime.replacing import whole_file
from supple.scene.scene import Scene
from supple.solvers.auto import Auto
from supple.solvers.solver import Solver

SCENE_FILE = "scene.yaml"
_BLOCK = 1 << 20


class Job(ABC):
    """One case of a study, as it is sent to a worker."""

    @abstractmethod
    def load(self, folder: Path) -> Run:
        """What is to be simulated; `folder` is the case's own.

        Raises
        ------
        SuppleError : where the case cannot be simulated.
        """


class Source(ABC):
    """What is varied."""

    @abstractmethod
    def job(self, values: Mapping[str, Any]) -> Job:
        """The job for one combination of values.

        Raises
        ------
        StudyError : where a factor does not exist: a fault of the study, not of one case.
        """

    @abstractmethod
    def identity(self, values: Mapping[str, Any]) -> str:
        """What the results of the case depend on, as a text: equal texts have equal results."""

    def check(self, values: Mapping[str, Any]) -> None:
        """Raise `SuppleError` where the values are not allowed, as far as this can be known without building anything.

        Sources that know nothing before they build do not override this method.
        """
        return

    def unit(self, name: str) -> str:
        """The unit of a factor, where it is known."""
        return ""


@dataclass(frozen=True)
class FileJob(Job):
    """A scene file, complete, with absolute paths of its meshes."""

    text: str

    def load(self, folder: Path) -> Run:
        path = folder / SCENE_FILE
        with whole_file(path) as fresh:
            fresh.write_text(self.text, encoding="utf-8")
        return load_run(path)


class FileSource(Source):
    """A scene file; factors are dotted paths into it.

    Raises
    ------
    SceneError : where the file cannot be read.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._document = read_yaml(self.path)
        self._digests: dict[Path, str] = {}
        self._factors: set[str] = set()

    def job(self, values: Mapping[str, Any]) -> FileJob:
        data = with_values(self._document.data, values)
        for entry in _mesh_files(data):
            entry["file"] = str((self.path.parent / entry["file"]).absolute())
        return FileJob(yaml_text(data))

    def identity(self, values: Mapping[str, Any]) -> str:
        data = with_values(self._document.data, values)
        files = [self._digest(self.path.parent / entry["file"]) for entry in _mesh_files(data)]
        return json.dumps([data, files], sort_keys=True)

    def check(self, values: Mapping[str, Any]) -> None:
        validated(self._changed(values))

    def unit(self, name: str) -> str:
        return unit_of(name)

    def _changed(self, values: Mapping[str, Any]) -> YamlDocument:
        return replace(self._document, data=with_values(self._document.data, values))

    def _digest(self, path: Path) -> str:
        """Of the contents of a mesh file, and of its siblings: a TetGen mesh consists of several files of one stem."""
        if path not in self._digests:
            digest = hashlib.sha256()
            try:
                for file in sorted(other for other in path.parent.iterdir() if other.stem == path.stem):
                    if file.is_file():
                        digest.update(file.name.encode())
                        with file.open("rb") as opened:
                            while block := opened.read(_BLOCK):
                                digest.update(block)
            except OSError as error:
                digest.update(str(error).encode())  # the case itself reports what cannot be read
            self._digests[path] = digest.hexdigest()
        return self._digests[path]


@dataclass(frozen=True)
class FunctionJob(Job):
    """A call of a function that returns a `Scene` or a `Run`."""

    make: Callable[..., Any]
    values: Mapping[str, Any]
    solver: Solver | Auto | None
    dt: float
    steps: int

    def load(self, folder: Path) -> Run:
        made = self.make(**self.values)
        if isinstance(made, Run):
            return made
        name = getattr(self.make, "__name__", "the function")
        if not isinstance(made, Scene):
            raise StudyError(f"{name} returned a {type(made).__name__}; return a Scene, or a Run with its own solver")
        return Run(made, self.solver or Auto(), self.dt, self.steps)


class FunctionSource(Source):
    """A function of the factors. `solver`, `dt` [s] and `steps` are for functions that return a `Scene`."""

    def __init__(self, make: Callable[..., Any], solver: Solver | Auto | None, dt: float, steps: int) -> None:
        self.make, self.solver, self.dt, self.steps = make, solver, dt, steps

    def job(self, values: Mapping[str, Any]) -> FunctionJob:
        try:
            inspect.signature(self.make).bind(**values)
        except TypeError as error:
            name = getattr(self.make, "__name__", repr(self.make))
            raise StudyError(f"{name} cannot be called with {', '.join(values)}: {error}") from None
        except ValueError:  # a built-in function without a signature
            pass
        return FunctionJob(self.make, values, self.solver, self.dt, self.steps)

    def identity(self, values: Mapping[str, Any]) -> str:
        return json.dumps([self._code, repr(self.solver), self.dt, self.steps, dict(values)], sort_keys=True)

    @property
    def _code(self) -> str:
        """The function's name and text. What it calls is not included."""
        try:
            return f"{self.make.__qualname__}\n{inspect.getsource(self.make)}"
        except (OSError, TypeError, AttributeError):
            return repr(getattr(self.make, "__qualname__", type(self.make).__qualname__))


def _mesh_files(data: Any) -> Iterator[dict[str, Any]]:
    """Every mapping in the data that names a file."""
    if isinstance(data, dict):
        if isinstance(data.get("file"), str):
            yield data
        for value in data.values():
            yield from _mesh_files(value)
    elif isinstance(data, list):
        for value in data:
            yield from _mesh_files(value)
