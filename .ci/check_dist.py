"""Check a wheel and an sdist: `python .ci/check_dist.py dist`. Installs the wheel alone into a bare environment."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def check_contents(wheel: Path, sdist: Path) -> None:
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
        (metadata,) = (file.read(name).decode() for name in names if name.endswith(".dist-info/METADATA"))
    sources = {str(p.relative_to(ROOT / "src").as_posix()) for p in (ROOT / "src" / "supple").rglob("*.py*")}
    sources = {name for name in sources if name.endswith((".py", ".pyi", ".typed"))}
    sources.add("supple/results/page/page.html")
    assert sources <= names, f"the wheel lacks {sorted(sources - names)[:5]}"
    strange = {name.partition("/")[0] for name in names} - {"supple"}
    assert all(name.endswith(".dist-info") for name in strange), f"the wheel contains {strange}"
    assert "supple/runtime/kernels/target.json" in names, "the wheel has no compiled kernels"
    assert any(name.endswith("/licenses/LICENSE") for name in names), "the wheel has no licence"
    assert "Typing :: Typed" in metadata
    page = metadata.partition("\n\n")[2]
    assert "pip install" in page.partition("##")[0], "the page does not begin with the installation"
    relative = re.findall(r"\]\((?!https:|#)([^)]*)\)", page)
    assert not relative, f"links that do not work on an index: {relative[:5]}"
    with tarfile.open(sdist) as file:
        packed = {name.partition("/")[2] for name in file.getnames()}
    missing = {"pyproject.toml", "hatch_build.py", "README.md", "LICENSE", "CHANGELOG.md", "client/build.py"}
    missing = (missing | {"src/supple/results/page/page.html"}) - packed
    assert not missing, f"the sdist lacks {missing}"
    print(f"{wheel.name}: {len(names)} files; {sdist.name}: {len(packed)} files")


def run_from(wheel: Path) -> None:
    """A demo from the wheel in an environment that has nothing else."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bare = folder / "bare"
        uv = [sys.executable, "-m", "uv"]
        subprocess.run([*uv, "venv", "-q", "--python", sys.executable, bare], check=True, env=clean)
        python = bare / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        lock = ROOT / "requirements" / "base.lock"
        subprocess.run([*uv, "pip", "install", "-q", "--python", python, "-r", lock], check=True, env=clean)
        subprocess.run([*uv, "pip", "install", "-q", "--python", python, "--no-deps", wheel], check=True, env=clean)
        code = "import supple, sys; print(supple.__file__); sys.exit('bare' not in supple.__file__)"
        subprocess.run([python, "-c", code], check=True, env=clean, cwd=folder)
        compare_kernels(python, folder, clean)
        demo = ["-m", "supple", "demo", "squash", "--output", "squash"]  # fails where a claim does not hold
        subprocess.run([python, *demo], check=True, env=clean, cwd=folder)
        check = ["-m", "supple", "check", "squash/recording.vtkhdf", "--every", "20"]
        subprocess.run([python, *check], check=True, env=clean, cwd=folder)


def compare_kernels(python: Path, folder: Path, environment: dict[str, str]) -> None:
    """README's snippet compiles nothing, and gives the same bits as with kernels that are compiled here."""
    snippet = re.findall(r"^```python\n(.*?)^```", (ROOT / "README.md").read_text(encoding="utf-8"), re.S | re.M)[0]
    (folder / "snippet.py").write_text(f"{snippet}\nprint(frame.positions['ball'].tobytes().hex())\n", encoding="utf-8")

    def run(cache: str, **more: str) -> str:
        chosen = {**environment, "NUMBA_CACHE_DIR": str(folder / cache), **more}
        command = [python, "snippet.py"]
        return subprocess.run(command, check=True, env=chosen, cwd=folder, capture_output=True, text=True).stdout

    packed = run("unused")
    entries = list((folder / "unused").rglob("*.kernel"))
    assert not entries, f"README's snippet compiled {len(entries)} kernels"
    (kernels,) = python.parents[1].rglob("supple/runtime/kernels")
    _, processor, features = json.loads((kernels / "target.json").read_text(encoding="utf-8"))
    kernels.rename(kernels.with_name("hidden"))
    compiled = run("compiled", NUMBA_CPU_NAME=processor, NUMBA_CPU_FEATURES=features)
    kernels.with_name("hidden").rename(kernels)
    count = len(list((folder / "compiled").rglob("*.kernel")))
    assert count > 20
    assert packed == compiled, "kernels of the wheel give other bits than those that are compiled here"
    print(f"{count} kernels of README's snippet come from the wheel, with the same bits as kernels compiled here")


def main(folder: Path) -> None:
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    check_contents(wheel, sdist)
    run_from(wheel.absolute())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
