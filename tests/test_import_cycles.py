"""No module imports itself by way of others, neither at its top nor inside a function."""

import ast
from pathlib import Path

import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from tests.sources import import_statements

import supple

ROOT = Path(supple.__file__).parent


def module_files(root, package):
    """File of each module below `root`, by its full name; a package is the module `__init__.py`."""
    files = {}
    for path in sorted(root.rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        files[".".join((package, *(parts[:-1] if parts[-1] == "__init__" else parts)))] = path
    return files


def imported_modules(path, name, modules):
    """Which of `modules` a file imports anywhere in it, inside functions and for type checkers as well.

    `from supple.a import b` imports supple.a.b where that is a module, otherwise supple.a.
    """
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    found = set()
    for node in import_statements(path):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level] if node.level else []
            source = ".".join([*above, *([node.module] if node.module else [])])
            inner = {f"{source}.{alias.name}" for alias in node.names}
            found |= {one if one in modules else source for one in inner}
    return (found & modules.keys()) - {name}


def import_cycles(graph):
    """Groups of modules, each of which can be reached from every other one: the strongly connected components."""
    names = sorted(graph)
    index = {name: k for k, name in enumerate(names)}
    edges = [(index[a], index[b]) for a in names for b in graph[a]]
    rows, columns = zip(*edges, strict=True) if edges else ((), ())
    matrix = coo_array(([1] * len(edges), (rows, columns)), shape=(len(names), len(names)))
    count, labels = connected_components(matrix.tocsr(), directed=True, connection="strong")
    groups = [[] for _ in range(count)]
    for name, label in zip(names, labels, strict=True):
        groups[label].append(name)
    return sorted(group for group in groups if len(group) > 1)


def described(group, graph):
    """A group as text: every import inside it, so that the reader sees which one to move."""
    return "; ".join(f"{a} imports {', '.join(sorted(graph[a] & set(group)))}" for a in group)


def import_graph(root, package):
    """Which modules of a package each of them imports."""
    modules = module_files(root, package)
    return {name: imported_modules(path, name, modules) for name, path in modules.items()}


def test_no_module_imports_itself_by_way_of_others():
    graph = import_graph(ROOT, "supple")
    # `supple/__init__.py` lists the public names and imports each when it is first used. No other module may import a
    # public name from there (tests/test_imports_direction.py).
    graph["supple"] = set()
    assert [described(group, graph) for group in import_cycles(graph)] == []


def test_the_parts_of_every_folder_import_each_other_in_one_direction():
    graph = import_graph(ROOT, "supple")
    del graph["supple"]
    folders: dict[str, dict[str, set[str]]] = {}
    for importer, imported in graph.items():
        for name in imported & graph.keys():
            own, other = importer.split("."), name.split(".")
            depth = next((k for k, (a, b) in enumerate(zip(own, other, strict=False)) if a != b), None)
            if depth is not None:  # otherwise one is the package of the other
                parts = folders.setdefault(".".join(own[:depth]), {})
                parts.setdefault(own[depth], set()).add(other[depth])
                parts.setdefault(other[depth], set())
    cycles = {folder: groups for folder, parts in folders.items() if (groups := import_cycles(parts))}
    assert cycles == {}


def test_no_folder_has_more_than_16_files():
    counts = {folder: len([p for p in folder.glob("*.py") if p.name != "__init__.py"]) for folder in ROOT.rglob("*")}
    assert {str(folder.relative_to(ROOT)): count for folder, count in counts.items() if count > 16} == {}


@pytest.mark.parametrize(
    ("first", "second", "cyclic"),
    [
        ("from toy.b import f", "def f():\n    from toy.a import g", True),
        ("from toy import b", "def f():\n    import toy.a", True),
        ("from . import b", "from .a import g", True),
        ("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from toy.b import F", "import toy.a", True),
        ("from toy.b import f", "from toy import other", False),
        ("import toy.b", "import os", False),
    ],
)
def test_every_kind_of_import_is_seen(tmp_path, first, second, cyclic):
    for name, text in (("__init__", ""), ("a", first), ("b", second)):
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
    graph = import_graph(tmp_path, "toy")
    assert import_cycles(graph) == ([["toy.a", "toy.b"]] if cyclic else [])
