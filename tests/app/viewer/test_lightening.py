"""Scenes that are slower than real time get coarser meshes, or another solver, on a page."""

from dataclasses import replace

import numpy as np
import pytest

import supple as sp
from supple.app.viewer.engine.scene.lightening import coarsened, linearized
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.simulation_process import _in_time
from supple.app.viewer.protocol.live_source import LiveSource
from supple.mesh.coarser import coarser

JELLY = sp.StableNeoHookean(youngs=3e4, poisson=0.4)


def stepped(dt: float = 1e-4, **parts) -> LiveScene:
    """Balls beside each other after a step; with so short a frame no scene keeps up with time."""
    mesh = sp.shapes.sphere(0.1, 0.03)
    balls = [sp.Body(f"ball {k}", mesh, JELLY, position=(0.3 * k, 0.2, 0)) for k in range(2)]
    live = LiveScene(LiveSource("balls", sp.Scene(balls, **parts), sp.XPBD(substeps=10), dt))
    live.step()
    return live


@pytest.fixture(scope="module")
def slow() -> LiveScene:
    return stepped()


def test_bodies_of_a_slow_scene_get_fewer_tets_and_keep_their_surface(slow):
    source, line = coarsened(slow)
    before, after = slow.source.scene.bodies[0], source.scene.bodies[0]
    assert len(after.mesh.tets) < 0.8 * len(before.mesh.tets)
    np.testing.assert_allclose(after.skin.volume, before.mesh.surface.volume, rtol=1e-12)
    assert after.mesh is source.scene.bodies[1].mesh  # equal bodies share their mesh
    assert f"{2 * len(after.mesh.tets):,} tets instead of {2 * len(before.mesh.tets):,}" in line
    assert linearized(slow) is None  # bodies that touch each other


def test_a_scene_that_keeps_up_with_time_stays_as_it_is(slow):
    slow.source, source = replace(slow.source, dt=10.0), slow.source
    try:
        assert coarsened(slow) is None
    finally:
        slow.source = source


def test_bodies_that_something_refers_to_keep_their_meshes():
    source, _ = coarsened(stepped(pins=[sp.Pin("ball 0", vertices=[0])]))
    pinned, free = source.scene.bodies
    assert pinned.skin is None
    assert len(free.mesh.tets) < len(pinned.mesh.tets)


def alone(solver, edge=0.05, dt=1 / 60) -> LiveScene:
    scene = sp.Scene([sp.Body("ball", sp.shapes.sphere(0.1, edge), replace(JELLY, youngs=1e8))])
    live = LiveScene(LiveSource("ball", scene, solver, dt, real_time=True))
    live.step()
    return live


def test_a_slow_body_alone_is_simulated_with_two_linearizations_or_one():
    live = alone(sp.XPBD(substeps=101))
    source, line = linearized(live)
    assert source.solver.max_iterations == 2
    assert source.scene is live.source.scene
    assert line == "solves each step by 2 linearizations of Implicit (status linearized)"
    live.source = replace(live.source, solver_given=True)
    assert linearized(live) is None
    slow = alone(sp.Implicit(max_iterations=2, tolerance=1e-2), dt=1e-3)
    source, line = linearized(slow)
    assert source.solver == sp.Implicit(max_iterations=1, tolerance=1e-2)
    assert "by 1 linearization of" in line
    assert linearized(alone(sp.Implicit(max_iterations=2))) is None
    assert linearized(alone(sp.Implicit(max_iterations=1), dt=1e-3)) is None
    assert linearized(alone(sp.Implicit(integrator="newmark"), dt=1e-3)) is None


def test_the_page_takes_what_is_faster_by_counts_and_says_so():
    live = alone(sp.XPBD(substeps=101), 0.03)
    chosen, line = _in_time(live)
    assert chosen.setup.solver.max_iterations == 1
    assert line.startswith("to keep up with real time, the page solves each step by 1 linearization of Implicit")
    assert len(chosen.system.tets) == len(live.system.tets)
    full = alone(sp.XPBD(substeps=101), 0.03)
    full.source = replace(full.source, real_time=False)
    assert _in_time(full) == (full, "")
    kept = alone(sp.XPBD(substeps=10), 0.03)
    assert _in_time(kept) == (kept, "")
    both, line = _in_time(alone(sp.XPBD(substeps=101), 0.03, dt=2e-3))
    assert len(both.system.tets) < len(live.system.tets)
    assert "1 linearization of Implicit (status linearized) and simulates " in line


def test_frames_are_repeated_with_at_most_twice_the_usual_substeps(monkeypatch):
    scene = sp.Scene([sp.Body("ball", sp.shapes.sphere(0.1, 0.03), replace(JELLY, youngs=3e6))])
    used = []
    step = sp.XPBD.step
    monkeypatch.setattr(sp.XPBD, "step", lambda self, *rest: used.append(self.max_substeps) or step(self, *rest))
    for real_time in (True, False):
        live = LiveScene(LiveSource("ball", scene, sp.XPBD(accuracy=0.1), 1 / 60, real_time=real_time))
        usual = live.step().iterations
        live.step()
        live.adopt(live.setup)  # what is usual may be another number from here
        live.step()
        assert used == [1000, 2 * usual if real_time else 1000, 1000]
        used.clear()
    ball = sp.RigidBody("ball", sp.shapes.sphere(0.1, 0.05), density=1000.0)
    live = LiveScene(LiveSource("ball", sp.Scene([ball]), sp.XPBD(), 1 / 60, real_time=True))
    live.step()
    live.step()
    assert used == [1000, 1000]


@pytest.mark.parametrize(
    ("mesh", "tets"), [(sp.shapes.gummy_bear(1.0, 0.13), 150), (sp.shapes.torus(0.4, 0.12, 0.06), 500)]
)
def test_a_coarser_mesh_has_the_same_shape(mesh, tets):
    made = coarser(mesh, tets)
    assert made is not None
    assert len(made.tets) <= tets
    np.testing.assert_allclose(made.volumes.sum(), mesh.volumes.sum(), rtol=0.05)
    np.testing.assert_allclose(made.vertices.max(axis=0), mesh.vertices.max(axis=0), atol=0.1)
    assert made.min_dihedrals.min() > 10.0


def test_a_shape_that_so_few_tets_cannot_have_has_no_coarser_mesh():
    assert coarser(sp.shapes.torus(0.4, 0.06, 0.05), 30) is None
