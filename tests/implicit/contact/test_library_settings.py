"""What a simulation leaves of the contact library's settings, which belong to the whole process."""

import subprocess
import sys

import ipctk
import pytest

import supple as sp

SOFT = sp.StableNeoHookean(youngs=2e4, poisson=0.3)


def resting(mesh=None):
    mesh = mesh or sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2))
    bodies = [sp.Body(name, mesh, SOFT, position=(0, y, 0)) for name, y in (("a", 0.051), ("b", 0.1515))]
    return sp.Scene(bodies, [sp.HalfSpace(friction=0.5)])


@pytest.mark.parametrize("threads", [1, 2])
def test_the_number_of_threads_is_that_from_before(threads, monkeypatch):
    before = ipctk.get_num_threads()
    ipctk.set_num_threads(threads)
    used = []
    kept = ipctk.Candidates.build
    monkeypatch.setattr(ipctk.Candidates, "build", lambda *args: (used.append(ipctk.get_num_threads()), kept(*args))[1])
    try:
        for frame in sp.simulate(resting(), sp.Implicit(), 1 / 60, 3):
            assert ipctk.get_num_threads() == threads
            assert frame.contacts is not None
            assert ipctk.get_num_threads() == threads
        with pytest.raises(sp.SceneError):
            next(
                sp.simulate(
                    sp.Scene([*resting().bodies, sp.Body("c", resting().bodies[0].mesh, SOFT)]), sp.Implicit(), 1, 1
                )
            )
        assert ipctk.get_num_threads() == threads
    finally:
        ipctk.set_num_threads(before)
    assert set(used) == {1}


_LOG = """
import ipctk, sys
levels = []
ipctk.set_logger_level = levels.append
import supple as sp
from tests.implicit.contact.test_library_settings import resting
*_, frame = sp.simulate(resting(), sp.Implicit(), 1 / 60, 10)
assert frame.report.status == "converged"
assert levels == [], levels
"""


def test_the_log_level_is_left_alone_and_nothing_is_printed():
    done = subprocess.run([sys.executable, "-c", _LOG], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
