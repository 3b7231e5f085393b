"""Pages of the documentation site that are made from other files while it is built: a hook of mkdocs.

The home page is README.md; the examples, the gallery, the changelog and CONTRIBUTING.md are pages; see `api.py` for the
API reference.
"""

from __future__ import annotations

import ast
import json
import re
import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

sys.path.append(str(Path(__file__).parent))  # mkdocs loads this file alone

from api import api_pages
from kinds import kinds_page

ROOT = Path(__file__).parents[2]
# Pages that are files of the repository's root.
OF_ROOT = {
    "index.md": "README.md",
    "changelog.md": "CHANGELOG.md",
    "contributing.md": "CONTRIBUTING.md",
    "code_of_conduct.md": "CODE_OF_CONDUCT.md",
    "security.md": "SECURITY.md",
}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages."""
    made = {
        "learn/examples.md": examples(),
        "learn/gallery.md": gallery(),
        "reference/scene_keys.md": kinds_page(),
        "CITATION.cff": (ROOT / "CITATION.cff").read_text(encoding="utf-8"),
    } | api_pages()
    made |= {page: root_page(path) for page, path in OF_ROOT.items()}
    for path, text in made.items():
        files.append(File.generated(config, path, content=text))
    return files


def root_page(path: str) -> str:
    """A page of the repository's root, whose links are relative to the folder above `docs`."""
    text = (
        (ROOT / path)
        .read_text(encoding="utf-8")
        .replace("](docs/", "](")
        .replace("](examples)", "](learn/examples.md)")
    )
    for page, other in OF_ROOT.items():
        text = text.replace(f"]({other})", f"]({page})")
    return re.sub(r"\[docs/(\w+)\.md\]", r"[\1]", text)


def examples() -> str:
    """Every example with its code."""
    parts = ["# Examples\n\nShort scripts; a test compares each with one physical number.\n"]
    for path in sorted((ROOT / "examples").glob("[0-9]*.py")):
        code = path.read_text(encoding="utf-8")
        first = (ast.get_docstring(ast.parse(code)) or path.stem).split("\n\n")[0].replace("\n", " ")
        parts.append(f"## {path.name}\n\n{first}\n\n``` python\n{code}```\n")
    for path in sorted((ROOT / "examples" / "scenes").glob("*.yaml")):
        parts.append(f"## scenes/{path.name}\n\n``` yaml\n{path.read_text(encoding='utf-8')}```\n")
    return "\n".join(parts)


def gallery() -> str:
    """Every demo and drawn example with its picture and what docs/draw_gallery.py measured."""
    parts = [
        "# Gallery\n\nEvery demo measures its claims; `supple demo NAME` runs one, `supple demo --list` lists them. "
        "Tests compare what [examples](examples.md) print with theory. Pictures and figures are from one run of "
        "`docs/draw_gallery.py`: the start, a fifth, a half and the end.\n"
    ]
    for name, demo in json.loads((ROOT / "docs" / "gallery.json").read_text(encoding="utf-8")).items():
        rows = [
            f"| {claim['text']} | {claim['measured']} | {'holds' if claim['holds'] else '**does not hold**'} |"
            for claim in demo.get("claims", ())
        ]
        sheets = f"{demo['triangles']:,} triangles of shells, " if "triangles" in demo else ""
        measured = "| claim | measured | |\n|---|---|---|\n" + "\n".join(rows)
        parts.append(
            f"## {name}\n\n![{demo['summary']}](../images/gallery/{name}.png)\n\n{demo['explanation']}\n\n"
            f"{demo['tets']:,} tets, {sheets}{demo['frames']} frames of {demo['dt']:.4g} s, solver `{demo['solver']}`: "
            f"`{demo['command']}`\n\n" + (measured if rows else f"``` text\n{demo['prints']}```") + "\n"
        )
    return "\n".join(parts)


def on_page_markdown(markdown: str, **_: object) -> str:
    """A list needs an empty line before it in Python-Markdown; GitHub needs none."""
    return re.sub(r"(?m)^((?![-*|\s]|\d+\. ).+)\n(?=(?:- |\d+\. )\S)", r"\1\n\n", markdown)
