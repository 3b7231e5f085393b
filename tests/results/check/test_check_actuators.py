"""Works of cavities in frames that do not resolve what happens in them."""

import pytest

import supple as sp

SHELL = sp.shapes.spherical_shell(0.04, 0.06, 0.04)
SOLVER = sp.XPBD(substeps=80, sleep_after=None)


def check(path, cavity, height):
    shell = sp.Body("shell", SHELL, sp.StableNeoHookean(youngs=2e5, poisson=0.4), position=(0, height, 0))
    scene = sp.Scene([shell], [sp.HalfSpace()], cavities=[cavity])
    frames = list(sp.simulate(scene, SOLVER, 1 / 60, 8, sinks=[sp.Recorder(path)]))
    return frames, sp.check_recording(path, only=["works"])


def test_a_given_volume_that_begins_with_a_jump(tmp_path):
    """In the first substep its pressure is far above the mean of the frame."""
    frames, report = check(tmp_path / "jump.vtkhdf", sp.Cavity("shell", volume=2.4e-4), 0.5)
    cavities = [frame.report.cavities["shell"] for frame in frames]
    assert cavities[0].volume == pytest.approx(2.4e-4)
    assert report.ok, report["works"].message


def test_a_shell_of_gas_that_bounces_within_a_frame(tmp_path):
    """The mean pressure of the frame is not that of either end."""
    frames, report = check(tmp_path / "bounce.vtkhdf", sp.Cavity("shell", gas=sp.Gas(gamma=1.4)), 0.08)
    lowest = [float(frame.positions["shell"][:, 1].min()) for frame in frames]
    assert min(lowest[1:-1]) < 0.005 < min(lowest[0], lowest[-1])
    assert report.ok, report["works"].message
