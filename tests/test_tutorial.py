"""The tutorial runs as it stands, block after block."""

import re
from pathlib import Path

TUTORIAL = Path(__file__).parents[1] / "docs" / "tutorial.md"


def test_every_block_of_the_tutorial_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```python\n(.*?)^```", TUTORIAL.read_text(encoding="utf-8"), flags=re.S | re.M)
    names: dict[str, object] = {}
    for number, block in enumerate(blocks, start=1):
        exec(compile(block, f"tutorial.md, block {number}", "exec"), names)
    assert len(blocks) == 7
    said = capsys.readouterr().out
    assert "fast.vtkhdf: 31 of 31 frames checked" in said
    assert "exact.vtkhdf: 31 of 31 frames checked" in said
    assert "  fail  " not in said
