"""`make test` executes the same examples each time, whatever ran before; `make fuzz` executes those of a seed."""

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
# Writes what a test draws.
DRAWS = """\
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

drawn = []


@settings(max_examples=60)
@given(st.integers(), st.floats(), st.text(), st.binary(max_size=9))
def test_draws(i, x, text, raw):
    drawn.append(repr((i, x, text, raw)))


def test_writes():
    Path("drawn.txt").write_text("\\n".join(drawn))
"""


def draw(folder: Path, *options: str, imports: str = "") -> list[str]:
    """The examples of a run of pytest with the profiles of these tests, after the import of modules."""
    (folder / "conftest.py").write_bytes((TESTS / "same_examples.py").read_bytes())
    (folder / "test_draws.py").write_text(imports + DRAWS, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--import-mode=importlib", *options]
    command += ["-p", "_hypothesis_pytestplugin"]
    environment = os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # the others take a second to import
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    drawn = (folder / "drawn.txt").read_text(encoding="utf-8").splitlines()
    assert len(set(drawn)) > 40
    return drawn


def test_two_runs_draw_the_same_examples(tmp_path):
    # Hypothesis takes examples from the constants of modules that were imported.
    (tmp_path / "constants.py").write_text("A, B, C = 987654, 9.87654, 'a constant'\n", encoding="utf-8")
    assert draw(tmp_path) == draw(tmp_path, imports="import constants\n")


def test_a_seed_repeats_the_examples_of_a_search(tmp_path):
    search = [draw(tmp_path, "--hypothesis-profile=new", f"--hypothesis-seed={seed}") for seed in (1, 2, 1)]
    assert search[0] == search[2] != search[1]


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_make_fuzz_passes_the_seed_and_prints_it():
    done = subprocess.run(
        ["make", "-n", "fuzz", "SEED=7", "EXAMPLES=9"], cwd=TESTS.parent, capture_output=True, text=True, check=True
    )
    assert "seed=${SEED:-$(date +%s)}" in done.stdout
    assert "--hypothesis-profile=new --hypothesis-seed=$seed" in done.stdout


def test_random_numbers_of_tests_have_a_seed():
    """No generator without a seed, and no function of a module's own generator."""
    makers, shared, found = {"default_rng", "Random", "RandomState", "SeedSequence"}, {"np.random", "numpy.random"}, []
    for path in TESTS.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text if re.search("random|Seed", text) else "")
        imported = {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
        for call in ast.walk(tree):
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute):
                owner, name = ast.unparse(call.func.value), call.func.attr
                seeded = name in makers and (call.args or call.keywords)
                if (owner in shared or (owner == "random" and "random" in imported)) and not seeded:
                    found.append(f"{path.relative_to(TESTS)}:{call.lineno}")
    assert not found
