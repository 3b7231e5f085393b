"""Check a wheel and an sdist: `python .ci/check_dist.py dist`. Installs the wheel alone into a bare environment."""

from __future__ import annotations

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
    assert sources <= names, f"the wheel lacks {sorted(sources - names)[:5]}"
    strange = {name.partition("/")[0] for name in names} - {"supple"}
    assert all(name.endswith(".dist-info") for name in strange), f"the wheel contains {strange}"
    assert any(name.endswith("/licenses/LICENSE") for name in names), "the wheel has no licence"
    assert "Typing :: Typed" in metadata
    page = metadata.partition("\n\n")[2]
    assert "pip install supple" in page.partition("##")[0], "the page does not begin with the installation"
    relative = re.findall(r"\]\((?!https:|#)([^)]*)\)", page)
    assert not relative, f"links that do not work on an index: {relative[:5]}"
    with tarfile.open(sdist) as file:
        packed = {name.partition("/")[2] for name in file.getnames()}
    missing = {"pyproject.toml", "hatch_build.py", "README.md", "LICENSE", "CHANGELOG.md"} - packed
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
        demo = ["-m", "supple", "demo", "squash", "--output", "squash"]  # fails where a claim does not hold
        subprocess.run([python, *demo], check=True, env=clean, cwd=folder)
        check = ["-m", "supple", "check", "squash/recording.vtkhdf", "--every", "20"]
        subprocess.run([python, *check], check=True, env=clean, cwd=folder)


def main(folder: Path) -> None:
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    check_contents(wheel, sdist)
    run_from(wheel.absolute())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
