"""A small scene that each case of a study simulates, and a real cluster of worker processes."""

import os
import subprocess
import sys
import time

import pytest

import supple as sp

FALL_STEPS, FALL_DT = 10, 0.01

SCENE = """\
bodies:
  - name: cube
    shape: {kind: box, size: [1, 1, 1], divisions: [1, 1, 1]}
    material: {kind: edges_and_volume}
    position: [0, 2, 0]
gravity: [0, -10, 0]
solver: {kind: xpbd, substeps: 1, contact: null}
dt: 0.01
steps: 10
"""


def make_fall(gravity, height=2.0):
    """A cube that falls freely."""
    cube = sp.Body("cube", sp.shapes.box((1, 1, 1), (1, 1, 1)), sp.EdgesAndVolume(), position=(0, height, 0))
    return sp.Scene([cube], gravity=(0, -gravity, 0))


def fallen(gravity, substeps=1):
    """Where symplectic Euler takes a body in `FALL_STEPS` frames [m]: g h^2 (1 + 2 + ... + n)."""
    n, h = FALL_STEPS * substeps, FALL_DT / substeps
    return -gravity * h * h * n * (n + 1) / 2


@pytest.fixture(scope="session")
def cluster(tmp_path_factory):
    """Address of a scheduler with two worker processes, all started as on a cluster."""
    pytest.importorskip("distributed")
    folder = tmp_path_factory.mktemp("cluster")
    contact, log = folder / "scheduler.json", (folder / "log.txt").open("wb")
    # A case that kills its workers is given up after the second one, not the fourth: starting one takes seconds.
    failures = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"}
    environment = os.environ | failures | {"PYTHONPATH": os.pathsep.join(sys.path)}

    def start(*command):
        command = [*command, "--scheduler-file", str(contact), "--no-dashboard"]
        return subprocess.Popen(command, env=environment, stdout=log, stderr=log, cwd=folder)

    scheduler = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    started = [start(*scheduler, "--host", "127.0.0.1", "--port", "0")]
    options = "--nworkers 2 --nthreads 1 --memory-limit 2GB --local-directory"
    started.append(start(sys.executable, "-m", "distributed.cli.dask_worker", *options.split(), str(folder)))
    while not contact.exists():
        assert started[0].poll() is None
        time.sleep(0.05)
    from distributed import Client

    with Client(scheduler_file=str(contact), set_as_default=False) as client:
        client.wait_for_workers(2, timeout=120)
        address = client.scheduler.address
    yield address
    for process in reversed(started):
        process.terminate()
        process.wait(timeout=120)
    log.close()
