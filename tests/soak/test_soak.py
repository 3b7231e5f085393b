"""Long runs: flat memory, bounded energy, constant momentum. `make soak` takes 100,000 steps, `make test` some."""

import os
from pathlib import Path

import numpy as np
import pytest

import supple as sp

STEPS = int(os.environ.get("SUPPLE_SOAK_STEPS", "60"))
DT = 1 / 60
MESH = sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1))
SOFT = sp.StableNeoHookean(youngs=5e4, poisson=0.3, density=1000, damping=0.01)
CONSERVING = (sp.XPBD(threads=1), sp.Implicit(integrator="newmark"))
SOLVERS = pytest.mark.parametrize(
    "solver",
    [*CONSERVING, sp.Implicit(), sp.Implicit(integrator="bdf2")],
    ids=["xpbd", "newmark", "backward_euler", "bdf2"],
)


def resident() -> int:
    """Memory of this process [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class MemoryGate:
    """Compares the memory late in a run with that after a tenth of it, when everything is compiled and loaded."""

    def __init__(self) -> None:
        self.first = 0

    def check(self, step: int) -> None:
        if step == STEPS // 10:
            self.first = resident()
        if step == STEPS:
            assert resident() < 1.02 * self.first, f"memory grew from {self.first / 2**20:.1f} MiB"


@SOLVERS
def test_a_free_body_keeps_its_momenta_and_gains_no_energy(solver):
    cube = sp.Body("cube", MESH, SOFT, velocity=(0.01, 0, 0.02), angular_velocity=(1, 5, 2))
    memory, first, highest = MemoryGate(), None, 0.0
    for frame in sp.simulate(sp.Scene([cube], gravity=(0, 0, 0)), solver, DT, STEPS):
        report = frame.report
        assert report.status == "converged"
        energy = report.kinetic_energy + report.elastic_energy
        first = first or frame
        for name in ("linear_momentum", "angular_momentum"):
            begun, now = getattr(first.report, name), getattr(report, name)
            if name == "linear_momentum" or solver in CONSERVING:
                assert np.linalg.norm(now - begun) < 1e-8 * np.linalg.norm(begun), frame.index
            else:  # these methods lose spin, as they lose energy
                assert np.linalg.norm(now) < (1.0 + 1e-8) * np.linalg.norm(begun), frame.index
        highest = max(highest, energy)
        memory.check(frame.index)
    assert highest < 1.01 * (first.report.kinetic_energy + first.report.elastic_energy)


@SOLVERS
def test_a_body_that_lies_on_a_floor_stays_there(solver, tmp_path):
    """The run is kept in a folder, with checkpoints: neither the recording nor the journal takes memory."""
    cube = sp.Body("cube", MESH, SOFT, position=(0, 0.11, 0), velocity=(0.3, 0, 0))
    scene = sp.Scene([cube], [sp.HalfSpace(friction=0.5)])
    memory, first = MemoryGate(), None
    folder = sp.RunFolder(tmp_path / "out", solver, checkpoint_every=max(STEPS // 10, 1))
    for frame in sp.simulate(scene, solver, DT, STEPS, sinks=[folder]):
        report = frame.report
        assert report.status == "converged"
        energy = report.kinetic_energy + report.elastic_energy + report.potential_energy
        first = energy if first is None else first
        assert energy < first + 1e-3 * abs(first)
        memory.check(frame.index)
    assert report.kinetic_energy < 1e-2
    assert np.abs(frame.positions["cube"][:, 1]).max() < 0.25
    assert frame.positions["cube"][:, 0].mean() < 0.3, "friction has stopped it"
