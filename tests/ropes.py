"""Straight ropes for tests of rods."""

import numpy as np

import supple as sp


def line(count, length, axis=0):
    """Points of `count` edges along an axis, about the origin."""
    points = np.zeros((count + 1, 3))
    points[:, axis] = np.linspace(-0.5 * length, 0.5 * length, count + 1)
    return points


def rope(name, points, youngs=1e6, damping=0.001, **more):
    """A rope of 1 cm."""
    material = sp.RodMaterial(youngs=youngs, poisson=0.4, radius=0.005, damping=damping)
    return sp.Rod(name, points, material, friction=0.5, **more)
