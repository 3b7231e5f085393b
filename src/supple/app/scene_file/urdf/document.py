"""A URDF file as a scene file's document."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from supple.app.scene_file.urdf.describe import described
from supple.app.scene_file.urdf.robot import read_robot
from supple.app.scene_file.yaml_files import Key, YamlDocument, key_text, parse_yaml, yaml_text
from supple.errors import SceneError

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class UrdfDocument(YamlDocument):
    """The document that a URDF file is converted to; its lines are not those of the file."""

    def error(self, keys: Sequence[Key], message: str) -> SceneError:
        """A `SceneError` with the file before `message`, and the key where the message names nothing."""
        where = "" if "'" in message else f"{key_text(keys)}: "
        return SceneError(f"{self.path}: {where}{message}")


def read_urdf(path: str | Path) -> UrdfDocument:
    """Convert a URDF file. A warning in the log names what is not used.

    Raises
    ------
    SceneError : where the file cannot be read or simulated; one line that begins with the path.
    """
    path = Path(path)
    robot = read_robot(path)
    try:
        data, missing = described(robot)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    if missing:
        logger.warning("%s: not used: %s", path, "; ".join(missing))
    document = parse_yaml(yaml_text(data), path)
    return UrdfDocument(document.path, document.text, document.data, document.root)
