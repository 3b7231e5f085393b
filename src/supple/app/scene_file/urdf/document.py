"""A URDF file as a scene file's document."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from supple.app.scene_file.entries.mesh_sources import MeshStore
from supple.app.scene_file.urdf.describe import described
from supple.app.scene_file.urdf.elements import Problem
from supple.app.scene_file.urdf.notes import Notes
from supple.app.scene_file.urdf.robot import read_robot
from supple.app.scene_file.yaml_files import Key, YamlDocument, key_text, parse_yaml, yaml_text
from supple.errors import SceneError

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class UrdfDocument(YamlDocument):
    """The document that a URDF file is converted to.

    Attributes
    ----------
    lines : in the URDF file, of the links and joints, by the names of the bodies and joints of the scene
    """

    lines: Mapping[str, int] = field(default_factory=dict)

    def error(self, keys: Sequence[Key], message: str) -> SceneError:
        """A `SceneError` with the file and the line of a link or joint, and the key where the message names nothing."""
        where = "" if "'" in message else f"{key_text(keys)}: "
        name = ""
        if len(keys) > 1 and keys[0] in ("bodies", "joints") and isinstance(keys[1], int):
            name = self.data[keys[0]][keys[1]]["name"]
        line = f":{self.lines[name]}" if name in self.lines else ""
        return SceneError(f"{self.path}{line}: {where}{message}")

    def with_pairs(self, pairs: Sequence[tuple[str, str]]) -> UrdfDocument:
        """The document where further pairs of bodies do not touch."""
        logger.warning(
            "%s: links that overlap at the start do not touch each other: %s%s",
            self.path,
            ", ".join(f"{first} and {second}" for first, second in pairs[:4]),
            f" and {len(pairs) - 4} more pairs" if len(pairs) > 4 else "",
        )
        entries = [{"first": first, "second": second, "collide": False} for first, second in pairs]
        data = {**self.data, "contact_pairs": [*self.data.get("contact_pairs", []), *entries]}
        return _document(data, self.path, self.lines)


def read_urdf(path: str | Path, meshes: MeshStore) -> UrdfDocument:
    """Convert a URDF file. Warnings in the log say what is changed or left out.

    Raises
    ------
    SceneError : where the file cannot be read or simulated; one line that begins with the path.
    """
    path, notes = Path(path), Notes()
    try:
        data, lines = described(read_robot(path, notes), path.parent, meshes, notes)
    except Problem as problem:
        line = "" if problem.line is None else f":{problem.line}"
        raise SceneError(f"{path}{line}: {problem}") from None
    for text in notes.lines():
        logger.warning("%s: %s", path, text)
    return _document(data, path, lines)


def _document(data: dict[str, Any], path: Path, lines: Mapping[str, int]) -> UrdfDocument:
    document = parse_yaml(yaml_text(data), path)
    return UrdfDocument(document.path, document.text, document.data, document.root, lines)
