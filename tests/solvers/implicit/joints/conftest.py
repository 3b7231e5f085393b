"""A bar of 2.5 kg and a hinge at its end."""

import supple as sp

BAR = sp.shapes.box_surface((1.0, 0.05, 0.05), (1, 1, 1))


def bar(name="bar", **values):
    return sp.RigidBody(name, BAR, **({"density": 1000.0, "position": (0.5, 0, 0)} | values))


def hinge(first="bar", second=None, **values):
    return sp.HingeJoint(first, second, **({"point": (0, 0, 0), "name": "hinge"} | values))
