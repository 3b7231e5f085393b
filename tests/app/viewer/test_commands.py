"""Commands check their values when they are created."""

import math

import numpy as np
import pytest

from supple.app.viewer.protocol.commands import (
    Grab,
    MoveGrab,
    Pin,
    ReleaseGrab,
    SetParameter,
    SetSolver,
    SetSpeed,
    SetView,
    Step,
    Unpin,
)
from supple.app.viewer.protocol.parameters import PARAMETERS
from supple.errors import CommandError

NAN, INF = math.nan, math.inf

HOSTILE = [
    (Step, (0,)),
    (Step, (10**9,)),
    (Step, (1.5,)),
    (Step, (True,)),
    (SetSpeed, (0.0,)),
    (SetSpeed, (NAN,)),
    (SetSpeed, (INF,)),
    (SetSpeed, ("fast",)),
    (SetSpeed, (10**400,)),
    (SetSolver, ("__import__('os')",)),
    (SetSolver, (None,)),
    (SetParameter, ("__class__", 1)),
    (SetParameter, (["substeps"], 1)),
    (SetParameter, ("substeps", -1)),
    (SetParameter, ("substeps", 2.5)),
    (SetParameter, ("substeps", 10**12)),
    (SetParameter, ("youngs", -1.0)),
    (SetParameter, ("youngs", NAN)),
    (SetParameter, ("poisson", 0.5)),
    (SetParameter, ("momentum_restore", 1)),
    (SetParameter, ("gravity", 9.81, "ball")),
    (SetParameter, ("friction", 0.5, "../../etc/passwd")),
    (SetView, ("positions",)),
    (SetView, ("J", 1)),
    (Grab, (-1, "ball", (0,), (1.0,), (0, 0, 0))),
    (Grab, (0, "", (0,), (1.0,), (0, 0, 0))),
    (Grab, (0, "ball", (), (), (0, 0, 0))),
    (Grab, (0, "ball", (-1,), (1.0,), (0, 0, 0))),
    (Grab, (0, "ball", (1, 1), (0.5, 0.5), (0, 0, 0))),
    (Grab, (0, "ball", (1, 2), (1.0,), (0, 0, 0))),
    (Grab, (0, "ball", (1, 2), (1.0, -1.0), (0, 0, 0))),
    (Grab, (0, "ball", (1,), (NAN,), (0, 0, 0))),
    (Grab, (0, "ball", tuple(range(5)), (0.2,) * 5, (0, 0, 0))),
    (Grab, (0, "ball", (0,), (1.0,), (0, 0, 1e300))),
    (Grab, (0, "ball", (0,), (1.0,), (0, 0, 0), 1e9)),
    (MoveGrab, (0, (0.0, NAN, 0.0))),
    (MoveGrab, (0, (0.0, 0.0))),
    (MoveGrab, (0, "abc")),
    (MoveGrab, (0, np.zeros((3, 3)))),
    (ReleaseGrab, ("0",)),
    (Pin, ("ball", -1)),
    (Pin, ("ball", 2**40)),
    (Pin, (None, 1)),
    (Unpin, ("ball",)),
]


@pytest.mark.parametrize(("kind", "values"), HOSTILE, ids=lambda value: getattr(value, "__name__", None))
def test_malformed_commands_are_refused(kind, values):
    with pytest.raises(CommandError) as caught:
        kind(*values)
    assert len(str(caught.value)) < 400


def test_weights_are_normalized_and_numbers_become_python_types():
    grab = Grab(np.int64(3), "ball", np.array([4, 5]), np.array([1.0, 3.0]), np.array([1, 2, 3]))
    assert grab.weights == (0.25, 0.75)
    assert grab.vertices == (4, 5)
    assert type(grab.grab) is int
    assert grab.target == (1.0, 2.0, 3.0)
    assert type(grab.target[0]) is float


@pytest.mark.parametrize("parameter", PARAMETERS.values(), ids=PARAMETERS.keys())
def test_both_ends_of_a_parameters_range_are_allowed(parameter):
    for end in (parameter.low, parameter.high):
        value = bool(end) if parameter.kind is bool else end
        made = SetParameter(parameter.name, value)
        assert type(made.value) is parameter.kind
        assert made.value == value
