"""What pages name exists: commands, options, extras, functions and their arguments, files, keys of scene files."""

import ast
import inspect
import json
import re
import shlex
import tomllib
from pathlib import Path

import pytest
import yaml

import supple as sp
from supple.app.cli.app import app
from supple.app.scene_file.document import json_schema
from supple.app.studies.study_file import study_schema

ROOT = Path(__file__).parents[1]
PAGES = [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md"]
IDS = [path.relative_to(ROOT).as_posix() for path in PAGES]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", flags=re.S | re.M)
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]


def spans_of(page):
    """The pieces of code within the text of a page."""
    text = page.read_text(encoding="utf-8")
    return re.findall(r"`([^`\n]+)`", BLOCK.sub("", text))


def lines_of_shell(page):
    blocks = [body for kind, body in BLOCK.findall(page.read_text(encoding="utf-8")) if kind in ("sh", "")]
    return [*spans_of(page), *(line.strip() for block in blocks for line in block.splitlines())]


def commands_of(page):
    """The words of each command of `supple` that a page names, up to a pipe or comment."""
    for line in lines_of_shell(page):
        match = re.match(r"(?:\.venv/bin/)?supple ([a-z].*)", line)
        if match:
            text = re.split(r" \| | #|…| \.\.\.", match[1])[0]
            yield shlex.split(text) if text.count("'") % 2 == 0 and text.count('"') % 2 == 0 else text.split()


@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_commands_and_options_exist(page):
    wrong = []
    for name, *arguments in commands_of(page):
        names = name.split("|")
        for one in names:
            try:
                command = app[one]
            except KeyError:
                wrong.append(f"supple {one}")
                continue
            known = {option for argument in command.assemble_argument_collection() for option in argument.names}
            options = [word.partition("=")[0].rstrip(",.;:)") for word in arguments if re.match(r"--?[a-z]", word)]
            wrong += [f"supple {one} {option}" for option in options if option not in known | {"--help", "--no-color"}]
    assert wrong == []


@pytest.mark.parametrize("page", [*PAGES, *sorted((ROOT / "src").rglob("*.py"))], ids=lambda path: path.stem)
def test_extras_exist(page):
    text = page.read_text(encoding="utf-8")
    found = re.findall(r"(?:supple|'\.)\[([a-z,]+)\]", text) + re.findall(r"\bextra `([a-z]+)`", text)
    assert {name for names in found for name in names.split(",")} <= EXTRAS.keys()


def object_of(name):
    """The public object `sp.a.b`."""
    found = sp
    for part in name.split(".")[1:]:
        found = getattr(found, part)
    return found


def calls_of(page):
    """Names of `sp`, and the keywords that they are called with, in the text of a page."""
    blocks = [body for kind, body in BLOCK.findall(page.read_text(encoding="utf-8")) if kind == "python"]
    for text in [*spans_of(page), *blocks]:
        for name in re.findall(r"\bsp(?:\.[A-Za-z_]\w*)+", text):
            yield name, []
        try:
            tree = ast.parse(text)
        except SyntaxError:
            continue
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):
                function = ast.unparse(node.func)
                if re.fullmatch(r"sp(\.\w+)+", function):
                    yield function, [keyword.arg for keyword in node.keywords if keyword.arg]


@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_public_names_and_their_arguments_exist(page):
    wrong = []
    for name, keywords in calls_of(page):
        try:
            found = object_of(name)
            parameters = inspect.signature(found).parameters if keywords else {}
        except AttributeError:
            wrong.append(name)
            continue
        if not any(one.kind is one.VAR_KEYWORD for one in parameters.values()):
            wrong += [f"{name}({keyword}=)" for keyword in keywords if keyword not in parameters]
    assert wrong == []


@pytest.mark.parametrize("page", [*PAGES, ROOT / "notes" / "decisions.md"], ids=[*IDS, "decisions.md"])
def test_files_of_this_project_exist(page):
    named = [
        span
        for span in spans_of(page)
        if re.fullmatch(r"(src|docs|tests|examples|notes|benchmarks|\.ci)/[\w./-]+", span)
    ]
    links = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", page.read_text(encoding="utf-8"))
    named += re.findall(r"\((docs/[\w./-]+\.md)", page.read_text(encoding="utf-8"))
    missing = [name for name in named if not (ROOT / name.rstrip("/")).exists()]
    # Pages of the site that are made when it is built.
    made = ("api/", "gallery", "keys")
    missing += [link for link in links if not (page.parent / link).exists() and not any(word in link for word in made)]
    assert missing == []


def keys_of_schema(schema):
    """Every key that files of a schema may have, and those of them below which their author chooses names."""
    found, free, stack = set(), set(), [schema]
    while stack:
        part = stack.pop()
        if isinstance(part, dict):
            named = part.get("properties", {})
            found |= set(named)
            free |= {key for key, one in named.items() if '"additionalProperties": {' in json.dumps(one)}
            stack += part.values()
        elif isinstance(part, list):
            stack += part
    return found, free


KEYS, FREE = (a | b for a, b in zip(keys_of_schema(json_schema()), keys_of_schema(study_schema()), strict=True))


def keys_in(data):
    if isinstance(data, dict):
        for key, value in data.items():
            yield key
            if key not in FREE:
                yield from keys_in(value)
    elif isinstance(data, list):
        for value in data:
            yield from keys_in(value)


@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_keys_of_yaml_exist(page):
    blocks = [body for kind, body in BLOCK.findall(page.read_text(encoding="utf-8")) if kind == "yaml"]
    # Of the spans of that page, some are keys of other programs.
    spans = [] if page.name == "coming_from.md" else spans_of(page)
    spans = [span for span in spans if re.match(r"(\{\s*)?[a-z_]+: ", span)]
    wrong = set()
    for text in [*blocks, *spans]:
        try:
            data = yaml.safe_load(text)
        except yaml.YAMLError:
            continue
        wrong |= {key for key in keys_in(data) if isinstance(key, str) and key not in KEYS}
    assert sorted(wrong) == [], json.dumps(sorted(wrong))
