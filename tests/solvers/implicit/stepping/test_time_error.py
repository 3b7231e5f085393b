"""The estimate of what the length of a step adds to the error of positions."""

import numpy as np
import pytest

import supple as sp
from supple.app.cli.commands.info import info
from supple.mesh import shapes

BOX = sp.Body("box", shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), sp.StableNeoHookean(youngs=1e5, poisson=0.3))


def errors(scene: sp.Scene, integrator: str, dt: float, steps: int = 4, **more) -> list[float | None]:
    frames = sp.simulate(scene, sp.Implicit(integrator=integrator), dt, steps, **more)
    return [frame.report.details.time_error for frame in frames]


def test_a_fall_has_the_error_of_each_method():
    """Backward Euler falls g h^2 / 2 too far in each step, and BDF2 after its first one not at all."""
    dt = 1 / 60
    assert errors(sp.Scene([BOX]), "backward_euler", dt) == pytest.approx([9.81 * dt**2 / 2] * 4)
    assert errors(sp.Scene([BOX]), "bdf2", dt)[3] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("integrator", "order"), [("backward_euler", 2), ("bdf2", 3)])
def test_the_estimate_of_a_vibration_falls_with_the_step(integrator, order):
    stretched = {"box": BOX.points * np.array([1.02, 1.0, 1.0])}
    scene = sp.Scene([BOX], gravity=(0, 0, 0))
    ends = [errors(scene, integrator, 4e-3 / n, n, initial_positions=stretched)[-1] for n in (20, 40)]
    assert np.log2(ends[0] / ends[1]) == pytest.approx(order, abs=0.6)


def test_an_equilibrium_has_none():
    pinned = sp.Scene([BOX], pins=[sp.Pin("box", np.flatnonzero(BOX.mesh.vertices[:, 1] < -0.04))])
    assert errors(pinned, "static", 1.0) == [None] * 4


def test_info_names_it(tmp_path, capsys):
    file = tmp_path / "fall.vtkhdf"
    for _ in sp.simulate(sp.Scene([BOX]), sp.Implicit(), 1 / 60, 2, sinks=[sp.Recorder(file)]):
        pass
    info(file)
    assert "at most 0.00136 m (RMS)" in " ".join(capsys.readouterr().out.split())
