"""The process of Supple that simulates the job in a folder."""

import json
import subprocess
from pathlib import Path

import numpy as np

PROGRAM = Path(__file__).with_name("bake.py")


class Run:
    """A simulation that runs; its standard output has one line for each frame, and its errors are in a file."""

    def __init__(self, python, folder):
        self.folder = folder
        self._errors = (folder / "errors.txt").open("wb")
        self._lines = (folder / "lines.txt").open("wb")
        self._child = subprocess.Popen(
            [python, str(PROGRAM), str(folder)], stdout=self._lines, stderr=self._errors, stdin=subprocess.DEVNULL
        )

    def is_running(self):
        return self._child.poll() is None

    def wait(self):
        self._child.wait()

    def end(self):
        """End the process."""
        self._child.kill()
        self._child.wait()

    def code(self):
        """The exit code; 0 where all went well."""
        return self._child.wait()

    def frame(self):
        """How many frames are done."""
        return (self.folder / "lines.txt").read_bytes().count(b"\n")

    def last_error(self):
        """The last line of standard error: why the simulation ended."""
        text = (self.folder / "errors.txt").read_text("utf-8", "replace").strip()
        last = text.splitlines()[-1] if text else f"exit code {self.code()}"
        if "No module named 'supple'" in last:
            last = (
                "this Python has no Supple; pip install supple there, or set another Python in the add-on's preferences"
            )
        return last

    def results(self, names):
        """Each body's name and positions (f, n, 3) in the world [m]."""
        for k, name in enumerate(names):
            yield name, np.load(self.folder / f"positions_{k}.npy")

    def warnings(self):
        """What a user must know of the result: frames that did not converge."""
        return json.loads((self.folder / "report.json").read_text("utf-8"))["warnings"]

    def summary(self):
        """One line on what was simulated."""
        return json.loads((self.folder / "report.json").read_text("utf-8"))["summary"]
