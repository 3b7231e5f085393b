"""A study that Ctrl-C interrupts."""

import csv
import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

SCRIPT = """
import sys, time
import supple as sp

folder = sys.argv[1]

def make(case):
    if case > 2:
        open(folder + "/slow", "w").close()
        time.sleep(600)
    cube = sp.Body("cube", sp.shapes.box((1, 1, 1), (1, 1, 1)), sp.EdgesAndVolume())
    return sp.Scene([cube], gravity=(0, -case, 0))

def low(recording):
    return recording[-1].positions["cube"][:, 1].min()

sp.sweep(make, {"case": [1, 2, 3, 4]}, measure=low, folder=folder + "/s", workers=1,
         solver=sp.XPBD(substeps=1, contact=None), dt=0.01, steps=2)
"""


@pytest.mark.skipif(os.name != "posix", reason="interrupts a process by a signal")
def test_an_interrupted_study_keeps_what_has_ended_and_leaves_no_process(tmp_path):
    """The script has no `if __name__ == "__main__"`: workers do not import it."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)],
        env=environment,
        stderr=subprocess.PIPE,
        # Whoever runs the tests in the background may have had SIGINT ignored; a person at a terminal has not.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    end = time.monotonic() + 120
    while not (tmp_path / "slow").exists() and time.monotonic() < end:
        time.sleep(0.1)
    workers = json.loads(subprocess.check_output(["python3", "-c", CHILDREN, str(process.pid)]))
    assert workers
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=300)
    assert b"KeyboardInterrupt" in error
    with (tmp_path / "s" / "table.csv").open(encoding="utf-8", newline="") as file:
        assert [row["status"] for row in csv.DictReader(file)] == ["done", "done"]
    end = time.monotonic() + 30
    while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < end:
        time.sleep(0.1)
    assert [pid for pid in workers if Path(f"/proc/{pid}").exists()] == []


CHILDREN = textwrap.dedent("""
    import json, pathlib, sys
    parents = {}
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            text = stat.read_text()
        except OSError:
            continue
        parents[int(stat.parent.name)] = int(text.rpartition(")")[2].split()[1])
    found, new = set(), {int(sys.argv[1])}
    while new:
        new = {pid for pid, parent in parents.items() if parent in new}
        found |= new
    print(json.dumps(sorted(found)))
""")
