"""Imports run in one direction: every layer of the package imports only from the layers below it."""

import ast
import re
from pathlib import Path

import pytest

import supple

ROOT = Path(supple.__file__).parent
# From the top down. Parts of one layer do not import each other; those of the last one may. CONTRIBUTING.md shows
# this list.
LAYERS = (
    ("__main__",),
    ("cli",),
    ("demos",),
    ("viewer",),
    ("studies",),
    ("runs",),
    ("learning",),
    ("output", "scene_file"),
    ("simulate",),
    ("xpbd", "implicit"),
    ("contact", "joints", "readings"),
    ("solver", "stitched_points"),
    ("system",),
    ("loads",),
    ("scene",),
    ("mesh", "materials"),
    ("numerics", "files", "state", "displayed", "errors"),
)
LEVEL = {part: -k for k, layer in enumerate(LAYERS) for part in layer}
LOWEST = LAYERS[-1]


def part_of(path):
    """The package or module right below `supple` that a file belongs to."""
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def imports(path):
    """Line, and part of supple, of everything that a file imports from it, inside functions as well."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
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
                yield node.lineno, rest.partition(".")[0]


FILES = sorted(path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py")


@pytest.mark.parametrize("part", sorted({part_of(path) for path in FILES}))
def test_every_part_imports_only_from_the_layers_below(part):
    assert part in LEVEL, f"{part} is in no layer; add it to LAYERS"
    upward = [
        f"{path.relative_to(ROOT)}:{line} imports {other}"
        for path in FILES
        if part_of(path) == part
        for line, other in imports(path)
        if other != part and other not in LOWEST and LEVEL[other] >= LEVEL[part]
    ]
    assert upward == []


@pytest.mark.parametrize("part", LOWEST)
def test_the_lowest_layer_imports_nothing_above_it(part):
    imported = {other for path in FILES if part_of(path) == part for _, other in imports(path)}
    assert imported <= set(LOWEST)


def test_solvers_import_no_files_viewers_or_shell():
    for path in FILES:
        if part_of(path) in ("xpbd", "implicit"):
            imported = {other for _, other in imports(path)}
            assert not imported & {"scene_file", "output", "viewer", "cli", "demos", "simulate"}, path


def test_contributing_shows_the_layers():
    text = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^## Layers\n.*?\n\n((?: {4}[^\n]*\n)+)", text, flags=re.S | re.M)
    rows = [re.split(r"\s{2,}", line.strip())[0] for line in block.splitlines()]
    assert [tuple(row.replace(".py", "").split(", ")) for row in rows] == list(LAYERS[1:])
