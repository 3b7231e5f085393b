"""What starts once for all tests: one browser, and one process of which meshers and readers are forks."""

import io
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from tests import same_examples  # noqa: F401 - it sets hypothesis up
from tests.forked_children import forked_children

from supple.errors import SuppleError
from supple.mesh.io import in_child
from supple.mesh.meshing import child_process
from supple.results.export import video

# Tests share the cores. By default, a thread of OpenMP spins while it waits for another one, which waits for a core:
# beside other processes, a ball of 5,112 tets in `Implicit` takes ten times the CPU time.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
# Otherwise ffmpeg is started by a copy of this process, which takes a minute on some machines.
os.environ.setdefault("IMAGEIO_FFMPEG_NO_PREVENT_SIGINT", "1")

_FLAGS = (
    "--headless --no-sandbox --disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader "
    "--disable-background-networking"
)


def pytest_configure(config: pytest.Config) -> None:
    """Build the page of a checkout whose client has changed, once for all processes."""
    if not hasattr(config, "workerinput"):
        subprocess.run([sys.executable, Path(__file__).parents[1] / "client" / "build.py"], check=True)


@pytest.fixture(scope="session", autouse=True)
def _forks() -> Iterator[None]:
    with forked_children():
        yield


@pytest.fixture(scope="session", autouse=True)
def _errors_are_one_line() -> Iterator[None]:
    """All that tests raise, with or without a look at the text."""

    def checked(error: SuppleError, *arguments: object) -> None:
        assert "\n" not in "".join(map(str, arguments)), arguments
        Exception.__init__(error, *arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SuppleError, "__init__", checked)
        yield


@pytest.fixture
def own_interpreters(monkeypatch) -> None:
    """Meshers, libraries and films run as for users: each in an interpreter of its own."""
    monkeypatch.setattr(video, "subprocess", subprocess)
    monkeypatch.setattr(in_child, "subprocess", subprocess)
    monkeypatch.setattr(child_process, "subprocess", subprocess)


@pytest.fixture(scope="session")
def browser() -> Iterator:
    """Chromium, drawing with software WebGL; without it tests are skipped here, and fail in CI."""
    sync_api = pytest.importorskip("playwright.sync_api")
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if found is None:
        if os.environ.get("CI"):
            pytest.fail("CI needs chromium: apt install chromium")
        pytest.skip("chromium is missing; apt install chromium")
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=found, args=_FLAGS.split())
        yield started
        started.close()


@pytest.fixture(scope="session")
def pixels() -> Callable:
    """What a page of Playwright's shows, as (height, width, 3) integers."""
    image = pytest.importorskip("PIL.Image")

    def shot(page, **options) -> np.ndarray:
        taken = page.screenshot(timeout=90_000, **options)  # drawn in software, on a machine that may do much else
        return np.asarray(image.open(io.BytesIO(taken)).convert("RGB")).astype(int)

    return shot
