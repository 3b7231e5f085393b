"""Retired words do not come back: in the package, on pages, in examples and in tests. Each line has the word to use."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
RETIRED = {
    r"held[ _]back": "truncated",
    r"through each other": "penetrate",
    r"\buntouching": "excluded pairs",
    r"\bis_room\b": "is_container",
    r"signs? of life": "heartbeat",
    r"\bKeeper\b": "run writer",
    r"\bNot done\b": "rejected",
    r"\bturned_nodes\b|tets (were|are) turned": "reoriented",
    r"\b(Whole|Flag|Or)\((?=[A-Z0-9)])|class (Whole|Flag|Or|Given)\b": "Integer, Boolean, Union; metadata",
    r"\bspelled(_for)?\b": "schema type; named",
    r"could not go on|[Gg]o on (with|without)|Go on\?": "continue, resume",
    r"\bfor each in\b|\beach = ": "the thing's name",
    r"\bthe present (state|step|solver|position|frame)": "current",
    r"\bThere (is|are) no\b|\bthere is no\b|\bit is no\b": "is not, is missing, without",
    r"\bused to be\b|\bno longer supported\b|\bformerly\b": "history, which is the changelog's",
}
# Where others' words are quoted, and solvers, whose words follow in their own order.
SOLVERS = re.compile(r"src/supple/(solvers|contact)/|tests/(solvers|contact|torture)/")
LATER = {r"through each other", r"\bfor each in\b|\beach = ", r"\bthe present (state|step|solver|position|frame)"}
LATER |= {r"held[ _]back", r"could not go on|[Gg]o on (with|without)|Go on\?"}
LATER |= {r"\bThere (is|are) no\b|\bthere is no\b|\bit is no\b"}
FILES = [
    path
    for folder in ("src", "docs", "examples", "tests", "blender")
    for path in sorted((ROOT / folder).rglob("*"))
    if path.suffix in (".py", ".md", ".yaml") and path != Path(__file__)
]


@pytest.mark.parametrize("word", RETIRED)
def test_a_retired_word_is_gone(word):
    texts = {path.relative_to(ROOT).as_posix(): path for path in [*FILES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]}
    lines = [
        f"{name}:{number}: {line.strip()}"
        for name, path in texts.items()
        if not (word in LATER and SOLVERS.match(name))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if re.search(word, line)
    ]
    assert lines == [], f"use: {RETIRED[word]}"
