"""Imports run in one direction: every layer of the package imports only from the layers below it."""

import ast
import re
from pathlib import Path

import pytest
from tests.sources import import_statements

import supple

ROOT = Path(supple.__file__).parent
# From the top down. Parts of one layer do not import each other. CONTRIBUTING.md shows this list.
LAYERS = (
    ("__main__",),
    ("app.cli",),
    ("app.demos",),
    ("app.viewer",),
    ("app.studies",),
    ("app.runs",),
    ("app.scene_file",),
    ("gradients",),
    ("simulate",),
    ("results",),
    ("solvers.registry",),
    ("solvers.auto",),
    ("solvers.xpbd", "solvers.implicit"),
    ("solvers.solver",),
    ("contact",),
    ("model",),
    ("scene",),
    ("mesh", "materials"),
    ("kinds",),
    ("numerics",),
    ("runtime",),
    ("errors",),
)
LEVEL = {part: -k for k, layer in enumerate(LAYERS) for part in layer}


def part_of(name):
    """The part of `LAYERS` that a module belongs to, by its name below `supple`; None where it is in none."""
    return next((part for part in LEVEL if name == part or name.startswith(f"{part}.")), None)


def name_of(path):
    """The dotted name below `supple` of a file's module."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def imports(path):
    """Line, and part of supple, of everything that a file imports from it, inside functions as well."""
    for node in import_statements(path):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: a relative import"
            names = [node.module] if node.module != "supple" else [f"supple.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        for name in names:
            package, _, rest = (name or "").partition(".")
            # `from supple import __version__` and a whole `import supple` name no part.
            if package == "supple" and rest and not rest.startswith("__version__"):
                yield node.lineno, rest


FILES = sorted(path for path in ROOT.rglob("*.py") if path.name != "__init__.py")


def test_every_module_is_in_a_layer():
    assert [name_of(path) for path in FILES if part_of(name_of(path)) is None] == []


@pytest.mark.parametrize("part", LEVEL)
def test_every_part_imports_only_from_the_layers_below(part):
    upward = [
        f"{name_of(path)}:{line} imports {other}"
        for path in FILES
        if part_of(name_of(path)) == part
        for line, other in imports(path)
        if part_of(other) not in (part, None) and LEVEL[part_of(other)] >= LEVEL[part]
    ]
    assert upward == []


def test_contributing_shows_the_layers():
    text = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^## The tree\n.*?\n\n((?: {4}[^\n]*\n)+)", text, flags=re.S | re.M)
    rows = [re.split(r"\s{2,}", line.strip())[0] for line in block.splitlines()]
    parts = [tuple(row.replace(".py", "").replace("/", ".").split(", ")) for row in rows]
    assert parts == list(LAYERS[1:])
