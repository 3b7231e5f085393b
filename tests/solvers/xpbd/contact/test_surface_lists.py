"""Lists of what may touch that serve later frames."""

import numpy as np
import pytest

import supple as sp
from supple.solvers.xpbd.contact.detection.surface_lists import SurfaceLists


def _scene() -> sp.Scene:
    box = sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
    rubber = sp.StableNeoHookean(youngs=3e5, poisson=0.4, density=1000.0)
    bodies = [
        sp.Body("low", box, rubber, position=(0, 0.05, 0), friction=0.4),
        sp.Body("high", box, rubber, position=(0.01, 0.16, 0), rotation=(0, 0.3, 0), friction=0.4),
        sp.RigidBody(
            "plate", sp.shapes.box_surface((0.2, 0.02, 0.2), (2, 1, 2)), density=500.0, position=(0, 0.235, 0)
        ),
    ]
    floor = sp.shapes.box_surface((1.0, 0.1, 1.0), (2, 1, 2)).transformed(translation=(0, -0.051, 0))
    return sp.Scene(bodies, [sp.obstacles.TriangleObstacle(surface=floor, friction=0.4)])


def _run(monkeypatch: pytest.MonkeyPatch, keep: bool) -> tuple[np.ndarray, int]:
    made: list[int] = []
    renew, hold = SurfaceLists.renew, SurfaceLists.hold
    with monkeypatch.context() as patch:
        patch.setattr(SurfaceLists, "renew", lambda self, *args: (made.append(1), renew(self, *args)))
        patch.setattr(SurfaceLists, "hold", lambda self, depth: keep and hold(self, depth))
        frames = sp.simulate(_scene(), sp.XPBD(substeps=15, sleep_after=None), dt=1 / 60, steps=25)
        last = [frame.positions for frame in frames][-1]
    return np.concatenate(list(last.values())), len(made)


def test_lists_that_serve_later_frames_change_no_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    kept, few = _run(monkeypatch, True)
    renewed, many = _run(monkeypatch, False)
    assert many >= 25
    assert few <= 0.6 * many
    np.testing.assert_array_equal(kept, renewed)
