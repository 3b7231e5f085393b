"""The Python blocks of documentation pages with complete programs run, in their order."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


@pytest.mark.parametrize(
    "page",
    [
        "contact.md",
        "forces_and_stresses.md",
        "implicit.md",
        "joints.md",
        "learning.md",
        "locking.md",
        "rigid_bodies.md",
    ],
)
def test_the_programs_of_a_page_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```", (DOCS / page).read_text(encoding="utf-8"), flags=re.S | re.M)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, page, "exec"), names)
    frame = names["exact" if page == "contact.md" else "frame"]
    assert frame.report.status == "converged"  # pyright: ignore[reportAttributeAccessIssue]
