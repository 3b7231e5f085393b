"""Which file a mesh was loaded from."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

Loaded = TypeVar("Loaded")


def with_origin(mesh: Loaded, path: str | Path) -> Loaded:
    """The mesh, which remembers its file; a changed copy of it does not."""
    object.__setattr__(mesh, "_origin", Path(path).absolute())
    return mesh


def origin_of(mesh: Any) -> Path | None:
    """The absolute path of the file that holds exactly this mesh, unless the file has changed; None of other meshes."""
    return getattr(mesh, "_origin", None)
