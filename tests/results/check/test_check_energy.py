"""What the check of energy allows: a step whose energy falls gains none, whatever its works are."""

import numpy as np
from scipy.spatial.transform import Rotation

import supple as sp

from .conftest import recorded, verdicts


def test_contact_that_takes_more_than_is_lost(tmp_path):
    """A small cube on its corner turns far in one step, in which contact stops it."""
    side, turn = 1.5e-3, np.array([0.7, -0.5, 1.6])
    mesh = sp.shapes.box((side, side, side), (1, 1, 1))
    low = Rotation.from_rotvec(turn).apply(mesh.vertices.copy())[:, 1].min()
    jelly = sp.StableNeoHookean(youngs=2.4e4, poisson=0.3)
    cube = sp.Body("cube", mesh, jelly, position=(0, 1e-5 * side - low, 0), rotation=tuple(turn))
    path = recorded(tmp_path / "turn.vtkhdf", sp.Scene([cube], [sp.HalfSpace(friction=0.4)]), sp.Implicit())
    with sp.Recording(path) as recording:
        energy = sum(recording.series(f"{name}_energy") for name in ("kinetic", "elastic", "potential"))
        work = recording.frame_values("details/work")[:, :-1].sum(axis=1).cumsum()
    assert (np.diff(energy) < 0.02 * np.ptp(energy)).all()
    assert (np.diff(energy - work) > 0.05 * np.ptp(energy)).any()
    assert verdicts(path, only=["energy"]) == {"energy": "pass"}
