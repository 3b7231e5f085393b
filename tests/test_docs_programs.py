"""Every program of the documentation and of README runs: the blocks of a page one after the other, in one folder.

Python blocks share their names. A YAML block that begins with `# name.yaml` is written to that file. Shell blocks are
lines of `supple`, which run in this process; a demo whose claim fails returns 1. The folder is empty but for README's
`examples`.
"""

import ast
import importlib.util
import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.demos.registry import DEMOS
from supple.model.state import Status

DOCS = Path(__file__).parents[1] / "docs"
# Pages with blocks that another test runs, or that are parts of a program.
ELSEWHERE = {
    "learn/tutorial.md": "tests/test_tutorial.py",
    "reference/studies.md": "tests/app/studies/test_docs.py",
    "reference/scene_files.md": "tests/app/scene_file/test_loader.py",
    "reference/checks.md": "lines that need a recording; tests/results/check runs the same commands",
    "reference/runs.md": "lines that need a run; tests/app/cli/test_resume.py runs the same commands",
    "reference/stitches.md": "two lines of the program of learn/stitching.md",
}
PAGES = [str(path.relative_to(DOCS).as_posix()) for path in sorted(DOCS.rglob("*.md"))]
README = "../README.md"
# README's blocks that install Supple, or that CI runs itself.
INSTALLATION = re.compile(r"^(make|pip install|git clone)\b", flags=re.M)
BLOCK = re.compile(r"^```(python|yaml|sh)\n(.*?)^```", flags=re.S | re.M)


def blocks_of(page):
    return BLOCK.findall((DOCS / page).read_text(encoding="utf-8"))


WITH_PROGRAMS = [page for page in [README, *PAGES] if blocks_of(page) and page not in ELSEWHERE]


def cheaper(arguments):
    """Options that give a command fewer frames and pixels than a person would want."""
    if arguments[:2] == ["run", "ball.yaml"]:
        return ["--steps", "20"]
    return ["--size", "160x120"] if {"mp4", "picture"} & {*arguments} and "--size" not in arguments else []


@pytest.mark.parametrize("page", WITH_PROGRAMS)
def test_the_programs_of_a_page_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    blocks = blocks_of(page)
    if page == README:
        shutil.copytree(DOCS.parent / "examples", "examples")
        blocks = [(kind, text) for kind, text in blocks if not (kind == "sh" and INSTALLATION.search(text))]
        assert {kind for kind, _ in blocks} == {"python", "sh"}
    for kind, text in blocks:
        if kind == "python":
            exec(compile(text, page, "exec"), names)
        elif kind == "yaml":
            file = re.match(r"# (\w+\.yaml)\n", text)
            if file:  # otherwise a part of a scene file
                Path(file[1]).write_text(text, encoding="utf-8")
        else:
            for line in text.splitlines():
                program, *arguments = shlex.split(line, comments=True)
                assert program == "supple", f"{page}: {line!r} is not run; use lines of supple"
                assert main([*arguments, *cheaper(arguments)]) == 0, line
    frame = names.get("exact" if page == "reference/contact.md" else "frame")
    if frame is not None:
        assert frame.report.status == "converged"  # pyright: ignore[reportAttributeAccessIssue]


def test_pages_that_are_run_elsewhere_exist():
    assert set(PAGES) >= ELSEWHERE.keys()


def test_every_block_has_a_language_and_ends():
    for page in PAGES:
        fences = re.findall(r"^```(.*)$", (DOCS / page).read_text(encoding="utf-8"), flags=re.M)
        assert len(fences) % 2 == 0, page
        assert set(fences[::2]) <= {"python", "yaml", "sh", "text"}, page
        assert set(fences[1::2]) <= {""}, page


def test_the_page_on_reports_lists_every_status():
    page = (DOCS / "reference" / "reports.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| `(\w+)` \|", page, flags=re.M)[1:]  # after the heading
    assert set(listed) == {str(status) for status in Status}


def test_the_gallery_has_every_demo_and_example_as_it_is():
    """`python docs/draw_gallery.py NAME` draws one again."""
    known = json.loads((DOCS / "gallery.json").read_text(encoding="utf-8"))
    drawn = [path for path in sorted((DOCS.parent / "examples").glob("[0-9]*.py")) if "sinks=()" in path.read_text()]
    examples = {path.stem[3:]: ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) for path in drawn}
    assert list(known) == [*DEMOS, *examples]
    for name, entry in known.items():
        assert (DOCS / "images" / "gallery" / f"{name}.png").is_file()
        said = (entry["summary"], entry["explanation"])
        if name in DEMOS:
            assert said == (DEMOS[name].summary, DEMOS[name].explanation), name
        else:
            assert said == tuple(part.replace("\n", " ") for part in examples[name].split("\n\n")[:2]), name


def test_the_site_has_every_public_name_once():
    spec = importlib.util.spec_from_file_location("api", DOCS / "building" / "api.py")
    api = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(api)
    names = set(sp.__all__) - {"__version__", *api.SPACES}
    inner = {f"{space}.{name}" for space in api.SPACES for name in getattr(sp, space).__all__ if name not in names}
    assert set(api.public_names()) == names | inner
    pages = api.api_pages().values()
    for name in api.public_names():
        assert sum(f"::: {api.path_of(name)}\n" in text for text in pages) == 1, name


def test_links_between_files_of_the_repository_exist():
    """As they are seen in the repository; the build of the site checks its own links, anchors included."""
    root = DOCS.parent
    pages = [*root.glob("*.md"), *DOCS.rglob("*.md")]
    links = [
        (page, link) for page in pages for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))
    ]
    assert len(links) > 100
    for page, link in links:
        if re.match(r"[a-z]+:", link):
            assert link.startswith("https://"), f"{page}: {link}"
        elif not link.startswith("#"):
            assert (page.parent / link.partition("#")[0]).exists(), f"{page}: {link}"
