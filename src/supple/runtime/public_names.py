"""The public names of a package, as its stub `__init__.pyi` lists them: a name's module is imported when it is used."""

from __future__ import annotations

import ast
import copyreg
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any


class _Package(ModuleType):
    """A package of whose modules some have the name of what they define, as `supple.simulate`: that keeps the name."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not isinstance(value, ModuleType) or name not in self.__all__:
            super().__setattr__(name, value)


# A function that says `sp.Scene` refers to this module. It is sent to other processes by its name, as all modules are.
copyreg.pickle(_Package, lambda package: (import_module, (package.__name__,)))  # pyright: ignore[reportArgumentType]


def public_names(package: str) -> tuple[Callable[[str], Any], list[str]]:
    """What `__getattr__` and `__all__` of a package are."""
    this = sys.modules[package]
    stub = ast.parse(Path(str(this.__file__)).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [line for line in stub.body if isinstance(line, ast.ImportFrom)]
    homes = {alias.name: f"{package}.{line.module}" for line in imports for alias in line.names}

    def first_use(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"{package} has no name {name!r}")
        home = import_module(homes[name])
        vars(this)[name] = getattr(home, name, None) or import_module(f"{homes[name]}.{name}")
        return vars(this)[name]

    this.__class__ = _Package
    return first_use, sorted(homes)
