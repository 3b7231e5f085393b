"""No file and no connection from outside is read by pickle, which would execute whatever is in it."""

import ast
import re
from pathlib import Path

import supple

ROOT = Path(supple.__file__).parent
MODULES = {"pickle", "cloudpickle", "dill", "joblib", "marshal", "shelve", "_pickle"}
WORDS = re.compile("pickle|dill|joblib|marshal|shelve|yaml|fromregex|eval|exec")  # parsing every file takes seconds
# Calls that are safe: kernels in the user's own folder; bytes are only hashed; a pipe to a child of the same program.
ALLOWED = {
    "runtime/kernel_cache.py": {"pickle.loads"},
    "runtime/reached_code.py": {"pickle.dumps"},
    "app/viewer/engine/engine.py": {"pickle.loads", "cloudpickle.dumps"},
    "app/viewer/engine/simulation_process.py": {"pickle.loads"},
}


def uses(path):
    """`module.name` for everything that a file takes from such modules, and loads of NumPy or YAML that would do it."""
    found, text = set(), path.read_text(encoding="utf-8")
    if not WORDS.search(text):
        return found
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] in MODULES:
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in MODULES:
            found.add(f"{node.value.id}.{node.attr}")
        if isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            for keyword in node.keywords:
                if keyword.arg == "allow_pickle" and ast.unparse(keyword.value) != "False":
                    found.add(f"{name}(allow_pickle)")
            if name in ("yaml.load", "yaml.unsafe_load", "yaml.full_load", "np.fromregex", "eval", "exec"):
                found.add(name)
    return found


def test_nothing_is_read_by_pickle():
    found = {path.relative_to(ROOT).as_posix(): used for path in sorted(ROOT.rglob("*.py")) if (used := uses(path))}
    assert found == ALLOWED


def test_every_such_use_is_seen(tmp_path):
    path = tmp_path / "toy.py"
    for text, used in (
        ("import pickle\npickle.load(f)", {"pickle.load"}),
        ("from cloudpickle import loads", {"cloudpickle.loads"}),
        ("import numpy as np\nnp.load(f, allow_pickle=True)", {"np.load(allow_pickle)"}),
        ("import numpy as np\nnp.load(f, allow_pickle=False)", set()),
        ("import yaml\nyaml.load(f, Loader=yaml.Loader)", {"yaml.load"}),
        ("eval(text)", {"eval"}),
    ):
        path.write_text(text, encoding="utf-8")
        assert uses(path) == used
