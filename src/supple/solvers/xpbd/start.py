"""The error for a scene whose bodies begin inside of something: XPBD would push them apart slowly, or never."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import contact_mesh
from supple.contact.mesh.obstacles import ObstaclePoses, placed_with_obstacles, with_obstacles
from supple.contact.search.distances import edge_edge_square, point_triangle_square
from supple.contact.search.patch_search import pairs_nearer
from supple.contact.start.intersections import intersections_of
from supple.contact.start.separation import Mover, default_gap
from supple.contact.start.surfaces import start_surfaces
from supple.errors import SceneError
from supple.model.system import System
from supple.scene.contact_pairs import PairTable, pair_table
from supple.solvers.xpbd.assessment.surfaces import TOLERATED_DEPTH, SurfaceCheck
from supple.solvers.xpbd.contact.settings import XPBDContact, colliding_pairs

# Of the thickness of shells: by how much less things may be apart. At rest they may be.
TOLERATED = 0.05
_REMEDY = "run `supple run --separate`, which moves it, or give XPBD(start='push_out')"


def raise_if_inside(
    system: System, positions: NDArray[np.float64], time: float, settings: XPBDContact | None, edge_length: float
) -> None:
    """Raise where a body begins inside of an obstacle, of another body or of itself, deeper than contact tolerates.

    Parameters
    ----------
    positions : (n, 3) of the system's vertices [m]; time : [s], where scripted obstacles are
    settings : of contact; edge_length : mean surface edge [m]

    Raises
    ------
    SceneError : one line: which things, where, how deep, and the remedy.
    """
    deep = SurfaceCheck(system, settings, edge_length).depths(positions, time)
    if deep:
        raise SceneError(f"{deep[0]} at the start; move it out, {_REMEDY}{_more(len(deep))}")
    collide = colliding_pairs(system, settings)
    # Obstacles without triangles were measured exactly above; a polyhedron about them is larger.
    bodies = len(system.bodies)
    for k, obstacle in enumerate(system.obstacles):
        if obstacle.contact_mesh is None:
            collide[bodies + k] = collide[:, bodies + k] = False
    table = PairTable(collide, pair_table(system.scene).friction, bodies)
    found = intersections_of(start_surfaces(system, positions, time), table)
    found = [item for item in found if item.kind != "touches" and item.depth > TOLERATED_DEPTH * edge_length]
    if found:
        worst = max(found, key=lambda item: item.depth)
        text = Mover(system, table, default_gap(system)).description(worst)
        raise SceneError(f"{text}, about {worst.depth:.2g} m deep; move it out, {_REMEDY}{_more(len(found))}")


def raise_if_within_thickness(
    system: System, positions: NDArray[np.float64], time: float, settings: XPBDContact | None
) -> None:
    """Raise where a shell begins nearer to something than its thickness; the parameters are those of `raise_if_inside`.

    Raises
    ------
    SceneError : one line: which things, by how much, and the remedy.
    """
    extended, ranges = with_obstacles(system)
    solid = tuple(part for part in ranges if part.obstacle.contact_mesh is not None)
    x = placed_with_obstacles(extended, ranges, positions, time)
    collide = colliding_pairs(system, settings)
    mesh = contact_mesh(extended, solid, collide, x)
    if not mesh.offsets.any():
        return
    places, offsets = mesh.points.positions(x), mesh.offsets
    found: list[tuple[float, int, int]] = [(0.0, 0, 0)]
    points, edges = pairs_nearer(places, mesh.parts, mesh.patches, 2.0 * float(offsets.max()))
    for k, t in points.tolist():
        other = mesh.triangles[t, 0]
        lack = offsets[k] + offsets[other] - math.sqrt(point_triangle_square(places, k, mesh.triangles, t))
        found.append((float(lack), int(mesh.owner[k]), int(mesh.owner[other])))
    for e, f in edges.tolist():
        one, other = mesh.edges[e, 0], mesh.edges[f, 0]
        lack = offsets[one] + offsets[other] - math.sqrt(edge_edge_square(places, mesh.edges, e, f))
        found.append((float(lack), int(mesh.owner[one]), int(mesh.owner[other])))
    R, t = ObstaclePoses(system.obstacles).at(time)
    sheets = np.flatnonzero(offsets > 0.0)
    for k, obstacle in enumerate(system.obstacles):
        mine = sheets[collide[mesh.owner[sheets], len(system.bodies) + k]]
        if obstacle.contact_mesh is None and len(mine):
            lacks = offsets[mine] - obstacle.signed_distance((places[mine] - t[k]) @ R[k])[0]
            worst = int(lacks.argmax())
            found.append((float(lacks[worst]), int(mesh.owner[mine[worst]]), len(system.bodies) + k))
    lack, *pair = max(found)
    one, other = sorted(pair)
    if lack > TOLERATED * 2.0 * float(offsets.max()):
        names = [f"body {name!r}" for name in mesh.names[: mesh.body_count]] + [o.label for o in system.obstacles]
        things = f"{names[one]} and {'itself' if one == other else names[other]}"
        raise SceneError(
            f"{things} are nearer at the start than the thickness of shells, by {lack:.2g} m; move them apart, make "
            "shells thinner, or give XPBD(start='push_out'), which keeps that distance"
        )


def _more(count: int) -> str:
    return f" ({count - 1} more such {'pair' if count == 2 else 'pairs'})" if count > 1 else ""
