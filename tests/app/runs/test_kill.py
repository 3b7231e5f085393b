"""Runs that are killed at random times: each resumes, each recording reads, and the end has the same bits."""

import os
import random
import subprocess
import sys
import time
from functools import cache
from statistics import median

import pytest

import supple as sp
from supple.app.runs.contents import RunPaths
from supple.app.runs.resume import last_checkpoint
from supple.runtime.lock import is_locked

from .conftest import same_bits

SCENE = """
bodies:
  - name: one
    shape: {kind: box, size: [0.2, 0.2, 0.2], divisions: [1, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: 5e4, poisson: 0.4, damping: 0.01}
    position: [0, 0.12, 0]
    velocity: [0.5, 0.5, 0]
    friction: 0.3
  - name: two
    shape: {kind: box, size: [0.2, 0.2, 0.2], divisions: [1, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: 5e4, poisson: 0.4}
    position: [0.21, 0.12, 0]
    friction: 0.3
  - name: three
    shape: {kind: box, size: [0.2, 0.2, 0.2], divisions: [1, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: 5e4, poisson: 0.4}
    position: [0.1, 0.35, 0.02]
    friction: 0.3
obstacles: [{kind: half_space, name: floor, friction: 0.4}]
stitches: [{kind: soft_vertex_triangle, first: one, second: two, max_distance: 0.02, youngs: 1e5, poisson: 0.4}]
dt: 1/60
steps: 20
output: {page: false, plot: false}
"""
SOLVERS = {
    "xpbd": "solver: {kind: xpbd, substeps: 10}",
    "bdf2": "solver: {kind: implicit, integrator: bdf2}",
    "newmark": "solver: {kind: implicit, integrator: newmark}",
    "backward_euler": "solver: {kind: implicit}",
}


@pytest.fixture(scope="module")
def scene_of(tmp_path_factory):
    """The scene file for a solver, the frames of the run that is never killed, and how long it takes [s]."""
    folder = tmp_path_factory.mktemp("scenes")

    @cache
    def made(solver):
        path = folder / f"{solver}.yaml"
        path.write_text(SCENE + SOLVERS[solver])
        run = sp.load_run(path)
        frames = list(sp.simulate(run.scene, run.solver, run.dt, run.steps))
        # Not the sum: some steps include the compilation of kernels.
        return path, frames, len(frames) * median(frame.report.wall_seconds for frame in frames)

    return made


# Forks a process for each line: `run` or `resume`, scene file, folder. A fresh interpreter would take seconds to start.
SERVER = """
import os, sys
import supple as sp
from supple.app.runs.resume import resume
from supple.app.runs.run_folder import RunFolder, SceneSource
from supple.app.scene_file.resolved import resolved_scene

def work(what, path, folder):
    if what == "resume":
        frames = resume(folder)
    else:
        run = sp.load_run(path)
        files = resolved_scene(run, solver=None, dt=run.dt, steps=run.steps)
        source = SceneSource({"kind": "scene_file"}, run.text, files)
        sink = RunFolder(folder, run.solver, checkpoint_every=4, source=source)
        frames = sp.simulate(run.scene, run.solver, run.dt, run.steps, sinks=[sink])
    for frame in frames:
        pass

for path in sys.argv[1:]:
    run = sp.load_run(path)
    list(sp.simulate(run.scene, run.solver, run.dt, 8))
print("ready", flush=True)
for line in sys.stdin:
    process = os.fork()
    if process == 0:
        try:
            work(*line.split())
        finally:
            os._exit(0)
    sys.stdin.readline()  # until the process is to be killed; it has its number until it is waited for
    os.kill(process, 9)
    print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)
"""


class Commands:
    """Runs in processes of the command line."""

    def start(self, what, path, out):
        arguments = [what, path, "-o", out, "--checkpoint-every", 4] if what == "run" else [what, out]
        command = [sys.executable, "-m", "supple", *map(str, arguments), "-q"]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE)

    def kill(self):
        self.process.kill()
        errors = self.process.communicate()[1].decode()
        assert "Traceback" not in errors
        return self.process.returncode


class Forks:
    """Runs in processes that a server forks."""

    def __init__(self, paths):
        one_thread = dict.fromkeys(("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        self.server = subprocess.Popen(
            [sys.executable, "-c", SERVER, *map(str, paths)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **one_thread, "NUMBA_THREADING_LAYER": "workqueue"},  # processes with OpenMP cannot fork
        )
        assert self.server.stdout.readline() == "ready\n"

    def start(self, what, path, out):
        self.server.stdin.write(f"{what} {path} {out}\n")
        self.server.stdin.flush()

    def kill(self):
        self.server.stdin.write("kill\n")
        self.server.stdin.flush()
        return int(self.server.stdout.readline())

    def close(self):
        self.server.kill()
        self.server.communicate()


def survives(out, scene_of, starter, solver, seconds):
    """Kill a run several times, then let it end; it must equal the one that was never killed.

    Returns how often it was killed while it was running.
    """
    path, whole, duration = scene_of(solver)
    paths, kills = RunPaths(out), 0
    for share in seconds:
        # A run that was killed before it had a journal has left nothing to resume.
        starter.start("resume" if paths.journal.exists() else "run", path, out)
        begun = time.monotonic()
        while not is_locked(out) and not paths.recording.exists() and time.monotonic() - begun < 120:
            time.sleep(0.001)
        time.sleep(share * duration)
        kills += starter.kill() != 0
        if paths.recording.exists():
            with sp.read_recording(paths.recording) as recording:
                assert all(map(same_bits, whole, list(recording)[1:]))
                if len(recording) == len(whole) + 1:
                    break
    run = sp.load_run(path)
    if not paths.journal.exists():
        list(sp.simulate(run.scene, run.solver, run.dt, run.steps, sinks=[sp.RunFolder(out, run.solver)]))
    elif last_checkpoint(paths).index < run.steps:  # it may have been killed when it was complete
        rest = list(sp.resume(out))
        assert all(map(same_bits, whole[-len(rest) :], rest))
    with sp.read_recording(paths.recording) as recording:
        assert [frame.index for frame in recording] == list(range(len(whole) + 1))
        assert all(map(same_bits, whole, list(recording)[1:]))
    assert not is_locked(out)
    return kills


@pytest.mark.parametrize(("solver", "seconds"), [pytest.param("xpbd", 0.5, marks=pytest.mark.slow), ("bdf2", 0.6)])
def test_a_killed_run_resumes(tmp_path, scene_of, solver, seconds):
    survives(tmp_path / "out", scene_of, Commands(), solver, [seconds])


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="only POSIX forks processes")
def test_a_hundred_killed_runs_resume(tmp_path, scene_of):
    chance, kills = random.Random(7), 0
    starter = Forks([scene_of(solver)[0] for solver in SOLVERS])
    try:
        for k in range(100):
            solver = list(SOLVERS)[k % len(SOLVERS)]
            seconds = [chance.uniform(0.0, 0.6) for _ in range(2)]
            kills += survives(tmp_path / f"out{k}", scene_of, starter, solver, seconds)
    finally:
        starter.close()
    assert kills >= 100
