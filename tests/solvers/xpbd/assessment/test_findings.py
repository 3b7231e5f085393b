"""The status and the message of a frame."""

import numpy as np

import supple as sp
from supple.model.state import Status
from supple.model.system import build_system
from supple.solvers.xpbd.assessment.findings import Findings, count_inverted, tangled_bodies
from supple.solvers.xpbd.assessment.surfaces import Overlap

CUBE = sp.shapes.box((1.0, 1.0, 1.0), (1, 1, 1))


def test_nothing_found_is_converged_without_a_message():
    assert Findings().status is Status.CONVERGED
    assert Findings().message(1.0, "take substeps=60") == ""


def test_the_worst_gives_the_status_and_all_are_in_the_message():
    findings = Findings(
        inverted={"ball": 12},
        overlaps=[Overlap("body 'ball'", "obstacle 'floor'", depth=0.003)],
        gained=0.31,
        gainer="ball",
        softened=[(0.051, "ball")],
    )
    assert findings.status is Status.INVERTED
    assert findings.message(1.2, "take substeps=60") == (
        "12 tets of body 'ball' inverted, body 'ball' is 0.003 m deep in obstacle 'floor', 31 % of the energy has "
        "no source, most of it in body 'ball', body 'ball' about 5.1 % too soft at t = 1.2 s; take substeps=60"
    )
    assert all(
        status.can_go_on for status in (Status.INVERTED, Status.INTERSECTING, Status.ENERGY_GAINED, Status.SOFTENED)
    )


def test_substeps_in_which_motion_was_truncated_count_from_a_tenth_on():
    assert Findings(held=0.1).status is Status.CONVERGED
    findings = Findings(held=0.375, softened=[(0.1, "ball")])
    assert findings.status is Status.TRUNCATED
    assert findings.status.can_go_on
    assert findings.message(1.0, "").startswith("motion was truncated in 38 % of the substeps, ")


def test_energy_from_nowhere_counts_from_two_percent_on_and_is_named_before_what_held_bodies_back():
    assert Findings(gained=0.5, held=0.375).status is Status.ENERGY_GAINED
    assert Findings(gained=0.019).status is Status.CONVERGED
    assert Findings(gained=0.021).status is Status.ENERGY_GAINED


def test_bodies_that_began_tangled_are_not_counted():
    jelly = sp.StableNeoHookean(youngs=1e5, poisson=0.4)
    system = build_system(sp.Scene([sp.Body("a", CUBE, jelly), sp.Body("b", CUBE, jelly, position=(3, 0, 0))]))
    J = np.ones(12)
    J[[2, 7, 8]] = -0.5, 0.0, np.nan
    assert tangled_bodies(system, J) == {"a", "b"}
    assert count_inverted(system, J, frozenset()) == {"a": 1, "b": 2}
    assert count_inverted(system, J, frozenset({"a"})) == {"b": 2}
