"""The pages of the API reference: which public names are on which page."""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "src" / "supple"
# Public names that are packages, and have public names of their own.
SPACES = ("obstacles", "studies")

# Page, title, and the parts of the package whose public names it has. The longest part that fits decides.
API = (
    ("scenes", "Bodies and scenes", ("scene",)),
    ("obstacles", "Obstacles", ("scene.obstacles",)),
    ("stitches", "Stitches", ("scene.stitches",)),
    ("loads", "Forces and loads", ("scene.loads", "scene.forces", "scene.inputs", "scene.sensors")),
    ("materials", "Materials", ("materials",)),
    ("meshes", "Meshes", ("mesh",)),
    ("simulation", "Solvers and simulation", ("simulate", "model", "solvers", "results.readings", "gradients")),
    ("recordings", "Recordings, checks and exports", ("results",)),
    ("runs", "Scene files, runs and the live page", ("app.scene_file", "app.runs", "app.viewer")),
    ("studies", "Studies", ("app.studies",)),
    ("numerics", "Numerics", ("numerics",)),
    ("errors", "Errors", ("errors",)),
)
# Not public names, but what public ones return.
RETURNED = {
    "simulation": (
        "supple.results.readings.frame_readings.FrameReadings",
        "supple.solvers.xpbd.details.XPBDDetails",
        "supple.solvers.implicit.details.ImplicitDetails",
    ),
    "recordings": ("supple.results.recording.frame.RecordedFrame",),
    "meshes": ("supple.mesh.sets.MeshSets",),
}


def public_names() -> dict[str, str]:
    """By public name, such as `Body` and `studies.Grid`, the module below `supple` that it is from."""
    top = _names_of(PACKAGE)
    homes = {space: f"{top.pop(space)}.{space}" for space in SPACES}
    inner = {
        f"{space}.{name}": f"{home}.{module}"
        for space, home in homes.items()
        for name, module in _names_of(PACKAGE.joinpath(*home.split("."))).items()
        if name not in top
    }
    return top | inner


def _names_of(package: Path) -> dict[str, str]:
    """By public name of a package, the module within it that it is from."""
    tree = ast.parse((package / "__init__.pyi").read_text(encoding="utf-8"))
    return {
        alias.asname or alias.name: str(node.module)
        for node in tree.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }


def path_of(name: str) -> str:
    """Of a public name, for griffe, to which `supple.simulate` is the module."""
    return "supple.simulate.simulate" if name == "simulate" else f"supple.{name}"


def page_of(module: str) -> str:
    """The page for the names of a module.

    Raises
    ------
    LookupError : where none exists.
    """
    fitting = [
        (len(part), page) for page, _, parts in API for part in parts if module == part or module.startswith(part + ".")
    ]
    if not fitting:
        raise LookupError(f"no page of the API reference has names of supple.{module}; add it to API in {__file__}")
    return max(fitting)[1]


def api_pages() -> dict[str, str]:
    """The text of each page by its path, and of the contents."""
    names: dict[str, list[str]] = {page: [] for page, _, _ in API}
    for name, module in public_names().items():
        names[page_of(module)].append(name)
    contents = ["# API reference\n\nAll names are attributes of `supple`: `import supple as sp`.\n"]
    pages = {}
    for page, title, _ in API:
        links = ", ".join(f"[`{name}`][{path_of(name)}]" for name in names[page])
        contents.append(f"**[{title}]({page}.md)**\n: {links}\n")
        objects = [*map(path_of, names[page]), *RETURNED.get(page, ())]
        pages[f"api/{page}.md"] = f"# {title}\n\n" + "\n".join(f"::: {name}\n" for name in objects)
    return pages | {"api/index.md": "\n".join(contents)}
