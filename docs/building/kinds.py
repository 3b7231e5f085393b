"""The table of all kinds of a scene file, made from the declared fields of their classes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING
from typing import Any

from supple.app.scene_file.document import scene_file_model as scene_file_model  # registers how values are written
from supple.app.scene_file.entries.body import ROD
from supple.app.scene_file.entries.kinds import keys_of
from supple.kinds.kind import Kind, declared, first_paragraph
from supple.materials.registry import MATERIALS
from supple.materials.rods.rod_material import RodMaterial
from supple.materials.shells.shell_material import ShellMaterial
from supple.mesh.primitives.shape import SHAPES
from supple.scene.joints.motors import MOTORS
from supple.scene.registry import PARTS
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rod import Rod
from supple.scene.shell import Shell
from supple.solvers.registry import SOLVERS

HEAD = """\
# Keys of scene files

What a [scene file](scene_files.md) can contain, by the lists that the entries are in. Where there is more than one
kind, an entry has its name as `kind`. Keys are called as the parameters in Python.
"""


def kinds_page() -> str:
    """The text of the page."""
    lists: dict[str, Sequence[Any]] = {
        "material": MATERIALS,
        "solver": SOLVERS,
        "shape": list(SHAPES.values()),
        **{key: part.kinds for key, part in PARTS.items()},
        "motor": MOTORS,
    }
    parts = [HEAD]
    for name, kinds in lists.items():
        parts.append(f"## {name}\n")
        if name != "loads" and set(kinds) <= set(PARTS["loads"].kinds):
            parts.append(f"As `{kinds[0].kind}` among the [loads](#loads), without `kind`.\n")
            continue
        for kind in kinds:
            title = f"`kind: {kind.kind}` (`{kind.__name__}`)" if len(kinds) > 1 else f"`{kind.__name__}`"
            fields = declared(ShellMaterial if kind is Shell else kind)  # the others are those of all bodies
            if kind is Rod:
                fields = {key: one for key, one in fields.items() if key in ROD} | declared(RodMaterial)
            rows = [row for field in fields.items() for row in _rows(*field)]
            if name == "bodies":
                below = {RigidBody: ": its own keys are below `rigid`", Shell: ": its own keys, below `shell`"}
                below[Rod] = ": its own keys, below `rod`"
                title = f"`{kind.__name__}`{below.get(kind, '')}"
            table = "\n".join(["| key | default | meaning |", "|---|---|---|", *rows])
            parts.append(f"### {title}\n\n{first_paragraph(kind)}\n\n{table}\n")
    return "\n".join(parts)


def _rows(name: str, field: Any) -> list[str]:
    """A row for each key that a field has."""
    found = []
    for key, (_, words) in keys_of(field.validator, name).items():
        text = (words or field.description.replace("None", "null")).replace("|", "\\|")
        default = field.default
        shown = "required" if default is MISSING else "" if default is None else f"`{_short(default)}`"
        found.append(f"| `{key}` | {shown if not words else ''} | {text} |")
    return found


def _short(default: Any) -> str:
    if isinstance(default, Kind):
        return "{}"
    return str(list(default)) if isinstance(default, tuple) else str(default).lower()
