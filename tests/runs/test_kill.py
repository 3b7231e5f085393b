"""Runs that are killed at random times: each resumes, each recording reads, and the end has the same bits."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from functools import cache

import pytest

import supple as sp
from supple.files.lock import is_locked
from supple.runs.contents import RunPaths
from supple.runs.resume import last_checkpoint

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
    """The scene file for a solver, and the frames of the run that is never killed."""
    folder = tmp_path_factory.mktemp("scenes")

    @cache
    def made(solver):
        path = folder / f"{solver}.yaml"
        path.write_text(SCENE + SOLVERS[solver])
        run = sp.load_run(path)
        began = time.perf_counter()
        frames = list(sp.simulate(run.scene, run.solver, run.dt, run.steps))
        return path, frames, time.perf_counter() - began

    return made


def killed(arguments, folder, seconds):
    """Start a process, and kill it a while after its run folder has appeared; returns whether it was still running."""
    process = subprocess.Popen([sys.executable, "-m", "supple", *map(str, arguments)], stderr=subprocess.PIPE)
    begun = time.monotonic()
    while not is_locked(folder) and process.poll() is None and time.monotonic() - begun < 120:
        time.sleep(0.002)
    time.sleep(seconds)
    process.kill()
    errors = process.communicate()[1].decode()
    assert "Traceback" not in errors
    return process.returncode != 0


def survives(out, scene_of, solver, seconds, kills):
    """Kill a run several times, then let it end; it must equal the one that was never killed."""
    path, whole, duration = scene_of(solver)
    paths, interrupted = RunPaths(out), 0
    for k in range(kills):
        begins = not paths.journal.exists()  # a run that was killed even before that has left nothing to resume
        arguments = ["run", path, "-o", out, "-q", "--checkpoint-every", 4] if begins else ["resume", out, "-q"]
        interrupted += killed(arguments, out, seconds[k % len(seconds)] * duration)
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
    return interrupted


@pytest.mark.parametrize(("solver", "seconds"), [("xpbd", 0.5), ("bdf2", 0.6)])
def test_a_killed_run_resumes(tmp_path, scene_of, solver, seconds):
    survives(tmp_path / "out", scene_of, solver, [seconds], 1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(25))
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_hundred_killed_runs_resume(tmp_path, scene_of, solver, seed):
    chance = random.Random(f"{solver} {seed}")
    seconds = [chance.uniform(0.0, 1.2) for _ in range(3)]
    survives(tmp_path / "out", scene_of, solver, seconds, chance.randint(1, 3))
