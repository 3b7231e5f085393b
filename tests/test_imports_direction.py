"""Imports run in one direction: every floor of the house knows only those below it."""

import ast
from pathlib import Path

import pytest

import supple

ROOT = Path(supple.__file__).parent
# From the roof down. What stands on one floor does not know its neighbours; the last one holds up all others.
FLOORS = (
    ("__main__",),
    ("cli",),
    ("demos",),
    ("viewer",),
    ("output", "scene_file"),
    ("simulate",),
    ("diagnostics",),
    ("xpbd", "implicit"),
    ("solver",),
    ("system",),
    ("scene",),
    ("mesh", "materials"),
    ("numerics", "state", "contact_points", "replacing", "errors"),
)
LEVEL = {part: -k for k, floor in enumerate(FLOORS) for part in floor}
GROUND = FLOORS[-1]


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
def test_every_part_knows_only_the_floors_below(part):
    assert part in LEVEL, f"{part} stands on no floor; give it one in this test"
    upward = [
        f"{path.relative_to(ROOT)}:{line} imports {other}"
        for path in FILES
        if part_of(path) == part
        for line, other in imports(path)
        if other != part and other not in GROUND and LEVEL[other] >= LEVEL[part]
    ]
    assert upward == []


@pytest.mark.parametrize("part", GROUND)
def test_the_ground_floor_knows_nothing_above_it(part):
    known = {other for path in FILES if part_of(path) == part for _, other in imports(path)}
    assert known <= set(GROUND)


def test_solvers_know_no_files_viewers_or_shell():
    for path in FILES:
        if part_of(path) in ("xpbd", "implicit"):
            known = {other for _, other in imports(path)}
            assert not known & {"scene_file", "output", "viewer", "cli", "demos", "simulate"}, path
