"""The bytes of a mesh file, with one clear error for each reason why they cannot be read."""

from __future__ import annotations

from pathlib import Path

from supple.errors import MeshError


def file_contents(path: Path) -> bytes:
    """All bytes of a regular file that is not blank.

    Raises
    ------
    MeshError : naming the file and the reason.
    """
    try:
        if path.is_dir():
            raise MeshError(f"{path}: it is a folder; give the path of a mesh file")
        if path.exists() and not path.is_file():
            raise MeshError(f"{path}: it is not a regular file")
        data = path.read_bytes()
    except FileNotFoundError:
        raise MeshError(f"{path}: there is no such file") from None
    except MemoryError:
        raise MeshError(f"{path}: it is too large for the memory of this machine") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise MeshError(f"{path}: it cannot be read: {reason}") from None
    if not data.strip():
        raise MeshError(f"{path}: it is empty")
    return data
