"""A belt lies over half of a drum with friction. While it slides, Euler (1762) and Eytelwein have the tensions of its
ends in the ratio exp(mu theta), whatever the drum's size is: 2.566 for mu = .3 and half a turn.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, mapped_box

import supple as sp

RADIUS, THICK, WIDTH, STRAIGHT, GAP, MU = 0.1, 2e-3, 0.01, 0.05, 2e-4, 0.3


def belt(cells):
    """Quadratic tets along two straight ends and the arc between them."""

    def place(x):
        arc = np.pi * (RADIUS + THICK / 2)
        along = x[:, 0] * (2 * STRAIGHT + arc) - STRAIGHT
        angle, r = np.pi * np.clip(along / arc, 0.0, 1.0), RADIUS + GAP + THICK * x[:, 1]
        beyond = np.minimum(along, 0.0) - np.maximum(along - arc, 0.0)
        return np.column_stack([-r * np.cos(angle), r * np.sin(angle) + beyond, WIDTH * (x[:, 2] - 0.5)])

    return mapped_box((cells, 1, 1), place)


def solve(cells):
    mesh = belt(cells)
    x = mesh.vertices
    ends = x[:, 1] < -STRAIGHT + 1e-9

    def moves(rate):
        """Both ends are pulled by 1 mm in a second, then on with a rate [m/s]."""
        return lambda t: (0.0, -1e-3 * min(t, 1.0) + rate * max(t - 1.0, 0.0), 0.0)

    scene = sp.Scene(
        [sp.Body("belt", mesh, sp.StableNeoHookean(youngs=1e8, poisson=0.0, density=1000.0), friction=MU)],
        [sp.obstacles.Cylinder(name="drum", start=(0, 0, -0.05), end=(0, 0, 0.05), radius=RADIUS, friction=MU)],
        pins=[
            sp.Pin("belt", np.flatnonzero(ends & (x[:, 0] < 0)), motion=moves(2e-3)),
            sp.Pin("belt", np.flatnonzero(ends & (x[:, 0] > 0)), motion=moves(-3e-3)),
        ],
        gravity=(0, 0, 0),
    )
    ratios, frame = [], None
    for frame in sp.simulate(scene, sp.Implicit(integrator="static"), 0.25, 8, strict=True):
        slack, tight = (force[1] for force in frame.report.details.reaction_forces.values())  # pyright: ignore
        ratios.append(tight / slack)
    assert frame is not None
    return Solution({"ratio of tensions": np.mean(ratios[4:])}, frame)


CASE = Case(
    title="Belt around a drum",
    source="Euler 1762",
    references={"ratio of tensions": Reference(float(np.exp(MU * np.pi)), "1")},
    solve=solve,
    meshes=(32, 64),
    differs="The belt is elastic and has a thickness of a fiftieth of the drum's radius. The ratio is the mean of four "
    "steps while it slides.",
)
