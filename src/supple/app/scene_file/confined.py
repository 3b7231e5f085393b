"""Meshes of scene files that are not trusted: nothing outside the file's own folder is read."""

from __future__ import annotations

import glob
from pathlib import Path

from supple.app.scene_file.entries.mesh_sources import MeshStore
from supple.app.scene_file.yaml_files import printable
from supple.errors import SceneError

LARGEST_FILE = 256 * 1024 * 1024


class ConfinedMeshStore(MeshStore):
    """Reads mesh files from one folder and those below it: no absolute path, no `..`, no link to another place.

    No file may be larger than `LARGEST_FILE` bytes, or be anything but a regular file.
    """

    def located(self, file: str) -> Path:
        path = self.folder / file
        self._require_inside(path, file)
        # A TetGen mesh consists of several files of one stem; the scene gives one of them.
        for sibling in path.parent.glob(f"{glob.escape(path.stem)}.*") if path.parent.is_dir() else ():
            self._require_inside(sibling, file)
        return path

    def _require_inside(self, path: Path, file: str) -> None:
        try:
            folder, real = self.folder.resolve(), path.resolve()
            inside = real.is_relative_to(folder)
            exists = real.exists()
            regular = real.is_file() and real.stat().st_size <= LARGEST_FILE
        except (OSError, ValueError, RuntimeError):
            raise SceneError(f"{printable(file)} cannot be read") from None
        if not inside or Path(file).is_absolute():
            raise SceneError(f"{printable(file)} is outside the scene file's folder; a live page reads no files there")
        if exists and not regular:
            raise SceneError(f"{printable(file)} is not a regular file of at most {LARGEST_FILE // 2**20} MiB")
