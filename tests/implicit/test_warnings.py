"""What the implicit solver cannot do yet, it says."""

import logging

import pytest

import supple as sp


def test_bodies_that_pass_through_each_other_are_announced(caplog: pytest.LogCaptureFixture) -> None:
    mesh = sp.shapes.box(size=(0.1, 0.1, 0.1), divisions=(1, 1, 1))
    material = sp.StableNeoHookean(youngs=1e5, poisson=0.3)
    bodies = [sp.Body("one", mesh, material), sp.Body("two", mesh, material, position=(0, 1, 0))]
    with caplog.at_level(logging.WARNING, logger="supple"):
        next(sp.simulate(sp.Scene(bodies), sp.Implicit(), dt=1 / 60, steps=1))
    assert "2 bodies pass through each other" in caplog.text


def test_obstacles_are_refused() -> None:
    mesh = sp.shapes.box(size=(0.1, 0.1, 0.1), divisions=(1, 1, 1))
    body = sp.Body("one", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.3))
    scene = sp.Scene([body], obstacles=[sp.HalfSpace(name="floor")])
    with pytest.raises(sp.SolverError, match=r"obstacle 'floor': Implicit has no contact yet"):
        sp.simulate(scene, sp.Implicit(), dt=1 / 60, steps=1)
