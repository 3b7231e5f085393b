"""A cantilever of one square inch lies along a 45 degree arc of radius 100 in, clamped at one end; E = 1e7 psi and
Poisson's ratio is zero. A force normal to the plane of the arc acts on the other end, which goes to the places that
Simo and Vu-Quoc (1986), section 4, give. The problem is that of Bathe and Bolourchi (1979), section 5, who give
(22.5, 59.2, 39.5) in for 300 lb and (15.9, 47.2, 53.4) for 600 lb: the two sources differ by 1.7 and 0.2 % of the way
of the tip.
"""

import numpy as np
from tests.published.case import Case, Reference, Solution, equilibria, mapped_box, triangles_where

import supple as sp

RADIUS = 100.0


def arc(divisions):
    """The beam in inches: along the arc, in its plane, and along z, the direction of the force."""

    def place(x):
        angle, r = x[:, 0] * np.pi / 4, RADIUS + x[:, 1] - 0.5
        return np.column_stack([RADIUS - r * np.cos(angle), r * np.sin(angle), x[:, 2] - 0.5])

    return mapped_box(divisions, place)


def tips(divisions, loads):
    """The middles of the loaded end under increasing loads [lb], and the last equilibrium."""
    mesh = arc(divisions)
    x = mesh.vertices
    angle = np.arctan2(x[:, 1], RADIUS - x[:, 0])
    end = angle > np.pi / 4 - 1e-9
    curve = sp.Curve(np.arange(len(loads) + 1) / len(loads), [(0.0, 0.0, load) for load in (0.0, *loads)])
    scene = sp.Scene(
        [sp.Body("beam", mesh, sp.StVenantKirchhoff(youngs=1e7, poisson=0.0))],
        pins=[sp.Pin("beam", np.flatnonzero(angle < 1e-9))],
        loads=[sp.Traction("beam", curve, triangles_where(mesh, end))],
        gravity=(0, 0, 0),
    )
    frames = equilibria(scene, len(loads))
    center = (x[end].min(axis=0) + x[end].max(axis=0)) / 2
    middle = np.flatnonzero(end)[np.linalg.norm(x[end] - center, axis=1).argmin()]
    return [frame.positions["beam"][middle] for frame in frames], frames[-1]


def solve(divisions):
    places, frame = tips(divisions, (300.0, 450.0, 600.0))
    return Solution(dict(zip(REFERENCES, places, strict=True)), frame)


REFERENCES = {
    "place at 300 lb": Reference((22.33, 58.84, 40.08), "in", bound=0.017, scale=42.3),
    "place at 450 lb": Reference((18.62, 52.32, 48.39), "in", scale=52.8),
    "place at 600 lb": Reference((15.79, 47.23, 53.37), "in", scale=59.9),
}
CASE = Case(
    title="45 degree bend, 300, 450 and 600 lb",
    source="Simo, Vu-Quoc 1986",
    references=REFERENCES,
    solve=solve,
    meshes=((16, 1, 1), (32, 2, 2)),
    differs="The source uses eight beam elements, which are not converged: elements of high order (BeamDyn, Kynema) "
    "give (15.57, 47.06, 53.58) in for 600 lb.",
)
