"""Errors for scenes that the implicit solver does not support."""

import pytest

import supple as sp


def test_obstacles_without_contact_are_an_error() -> None:
    mesh = sp.shapes.box(size=(0.1, 0.1, 0.1), divisions=(1, 1, 1))
    body = sp.Body("one", mesh, sp.StableNeoHookean(youngs=1e5, poisson=0.3))
    scene = sp.Scene([body], obstacles=[sp.HalfSpace(name="floor")])
    with pytest.raises(sp.SolverError, match=r"obstacle 'floor': with contact=None obstacles have no effect"):
        sp.simulate(scene, sp.Implicit(contact=None), dt=1 / 60, steps=1)
