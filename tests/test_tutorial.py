"""The tutorial runs as it stands, block after block."""

import re
import shlex
from pathlib import Path

from supple.app.cli.app import main

TUTORIAL = Path(__file__).parents[1] / "docs" / "learn" / "tutorial.md"


def in_the_shell(block):
    """Run lines of `supple`, with fewer tets and frames than a person would wait for."""
    for line in block.splitlines():
        program, command, *arguments = shlex.split(line, comments=True)
        assert program == "supple"
        shorter = ["--steps", "5"] if command == "run" else []
        assert main([command, *arguments, *shorter]) == 0, line
        if command == "new":
            scene = Path("part.yaml").read_text(encoding="utf-8")
            assert "tets: 2000" in scene
            Path("part.yaml").write_text(scene.replace("tets: 2000", "tets: 1000"), encoding="utf-8")


def in_python(block, number, names):
    """Run a block, with fewer tets."""
    block = block.replace("max_volume=1e-6", "tets=1000")
    exec(compile(block, f"tutorial.md, block {number}", "exec"), names)


def test_every_block_of_the_tutorial_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```(\w+)\n(.*?)^```", TUTORIAL.read_text(encoding="utf-8"), flags=re.S | re.M)
    names: dict[str, object] = {}
    for number, (kind, block) in enumerate(blocks, start=1):
        if kind == "python":
            in_python(block, number, names)
        else:
            in_the_shell(block)
    assert [kind for kind, _ in blocks] == ["python", "sh", *["python"] * 6]
    assert Path("part/index.html").stat().st_size > 10_000
    said, told = capsys.readouterr()
    assert "taken to be in millimetres (scale: 0.001)" in said + told
    assert "fast.vtkhdf: 16 of 16 frames checked" in said
    assert "exact.vtkhdf: 16 of 16 frames checked" in said
    assert "  fail  " not in said
