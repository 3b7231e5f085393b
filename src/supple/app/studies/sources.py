"""What a study varies: a scene file, or a function that makes a scene. Either one prepares each case."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from glob import escape
from pathlib import Path
from typing import Any

from supple import __version__
from supple.app.scene_file.loader import Run, load_run, validated
from supple.app.scene_file.paths import with_values
from supple.app.scene_file.yaml_files import read_yaml, yaml_text
from supple.errors import StudyError, SuppleError
from supple.runtime.replacing import whole_file
from supple.scene.scene import Scene
from supple.solvers.auto import Auto
from supple.solvers.solver import Solver

Job = Callable[[Path], Run]
"""What a worker gets of a case: takes the case's folder, and returns what is to be simulated, or raises."""
_DIGITS = 16  # of a hash: a chance of 1e-8 that two of a million cases have the same


@dataclass(frozen=True)
class Case:
    """One combination of values.

    Attributes
    ----------
    key : hash of everything that the results depend on; name of the case's folder
    values : of the factors
    job : what a worker does; refusal : why the values are not allowed, as far as is known without building anything
    """

    key: str
    values: Mapping[str, Any]
    job: Job
    refusal: str = ""

    def folder(self, study: Path) -> Path:
        return study / "cases" / self.key


Source = Callable[[Mapping[str, Any]], Case]
"""What is varied: gives the case with some values; raises `SuppleError` for a fault of the study, not of one case."""


def varied_file(path: str | Path) -> Source:
    """A scene file; factors are dotted paths into it.

    Raises
    ------
    SceneError : where the file cannot be read, and of the source, where a path leads to no place in it.
    """
    folder, document, digest = Path(path).parent, read_yaml(path), cache(_digest)

    def case(values: Mapping[str, Any]) -> Case:
        data = with_values(document.data, values)
        digests = [digest(folder / entry["file"]) for entry in mesh_files(data)]
        key, refusal = digest_of(__version__, json.dumps([data, digests], sort_keys=True)), ""
        try:
            validated(replace(document, data=data))
        except SuppleError as error:
            refusal = str(error)
        for entry in mesh_files(data):
            entry["file"] = str((folder / entry["file"]).absolute())
        return Case(key, values, partial(_run_of_text, yaml_text(data)), refusal)

    return case


def varied_function(make: Callable[..., Any], solver: Solver | Auto | None, dt: float, steps: int) -> Source:
    """A function of the factors. `solver`, `dt` [s] and `steps` are for functions that return a `Scene`.

    The source raises `StudyError` where the function does not take the factors.
    """

    def case(values: Mapping[str, Any]) -> Case:
        try:
            inspect.signature(make).bind(**values)
        except TypeError as error:
            raise StudyError(f"{_name(make)} cannot be called with {', '.join(values)}: {error}") from None
        except ValueError:  # a built-in function without a signature
            pass
        text = json.dumps([text_of(make), repr(solver), dt, steps, dict(values)], sort_keys=True)
        return Case(digest_of(__version__, text), values, partial(_run_of_function, make, values, solver, dt, steps))

    return case


def digest_of(*texts: str) -> str:
    """A short hash of texts."""
    return hashlib.sha256("\n".join(texts).encode()).hexdigest()[:_DIGITS]


def text_of(function: Callable[..., Any]) -> str:
    """A function's name and text. What it calls is not included."""
    name = getattr(function, "__qualname__", type(function).__qualname__)
    try:
        return f"{name}\n{inspect.getsource(function)}"
    except (OSError, TypeError):
        return name


def _name(function: Callable[..., Any]) -> str:
    return getattr(function, "__name__", repr(function))


def _run_of_text(text: str, folder: Path) -> Run:
    """Of a complete scene file, with absolute paths of its meshes; it stays in the folder."""
    path = folder / "scene.yaml"
    with whole_file(path) as fresh:
        fresh.write_text(text, encoding="utf-8")
    return load_run(path)


def _run_of_function(
    make: Callable[..., Any], values: Mapping[str, Any], solver: Solver | Auto | None, dt: float, steps: int, _: Path
) -> Run:
    made = make(**values)
    if isinstance(made, Scene):
        return Run(made, solver or Auto(), dt, steps)
    if not isinstance(made, Run):
        kind = type(made).__name__
        raise StudyError(f"{_name(make)} returned a {kind}; return a Scene, or a Run with its own solver")
    return made


def _digest(path: Path) -> str:
    """Of the contents of a mesh file, and of its siblings: a TetGen mesh consists of several files of one stem."""
    files = [path, *sorted(path.parent.glob(f"{escape(path.stem)}.*"))]
    try:
        return digest_of(*(f"{file.name} {_digest_of_bytes(file)}" for file in files if file.is_file()))
    except OSError as error:
        return str(error)  # the case itself reports what cannot be read


def _digest_of_bytes(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def mesh_files(data: Any) -> Iterator[dict[str, Any]]:
    """Every mapping in the data that names a file."""
    if isinstance(data, dict) and isinstance(data.get("file"), str):
        yield data
    for value in data.values() if isinstance(data, dict) else data if isinstance(data, list) else ():
        yield from mesh_files(value)
