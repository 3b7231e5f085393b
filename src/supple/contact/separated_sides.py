"""When what was stitched together collides again: as soon as its sides are apart, after its stitches have broken.

At a seam surfaces may touch, or penetrate, and contact that began there would push them apart with energy
from nothing. So pairs that have broken stay excluded until nothing that they exclude is nearer than a small distance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.contact_mesh import contact_mesh, points_of_stitches
from supple.contact.mesh.obstacles import obstacle_positions, with_obstacles
from supple.contact.search.patch_search import pairs_nearer
from supple.model.breaking import without_broken
from supple.model.state import State
from supple.model.stitched_points import stitched_state
from supple.model.system import System, initial_state
from supple.numerics.geometry.triangle_crossings import crossing_triangles
from supple.numerics.geometry.triangle_tree import pair_distances

# Of the smallest body's diagonal: half of what IPC's barrier reaches by default, where it is still weak.
_APART = 5e-4


def with_separated_sides(system: System, state: State) -> tuple[System, State]:
    """The system in which broken pairs collide whose sides are apart at `state`, and the state with these.

    The same ones where nothing changes.
    """
    waiting = np.setdiff1d(state.broken_stitches, state.separated_stitches)
    if not len(waiting):
        return system, state
    least = _APART * min(float(np.linalg.norm(np.ptp(system.rest_points[p.points], axis=0))) for p in system.bodies)
    stitching = system.scene.stitching
    nodes = stitching.nodes()[waiting]
    partner = np.where(nodes[:, 1:] < 0, nodes[:, 1:2], nodes[:, 1:])
    places = stitching.points(state.positions, state.time)
    waiting = waiting[pair_distances(places[nodes[:, 0]], places, partner) > least]
    if len(waiting):
        tried = without_broken(system, state.broken_stitches, np.union1d(state.separated_stitches, waiting))
        near = tried.stitching.broken[_are_near(tried, state, waiting, least)]
        waiting = np.setdiff1d(waiting, near)
    if not len(waiting):
        return system, state
    state = replace(state, separated_stitches=np.union1d(state.separated_stitches, waiting))
    return without_broken(system, state.broken_stitches, state.separated_stitches), state


def _are_near(system: System, state: State, waiting: NDArray[np.int64], least: float) -> NDArray[np.bool_]:
    """(b,) which of the broken pairs have a node on what is nearer than `least` [m] to what it was stitched to."""
    extended, obstacles = with_obstacles(system)
    stitching, scene = system.scene.stitching, system.scene
    things = [thing.name for thing in (*scene.bodies, *scene.obstacles)]
    collide = np.zeros((len(things), len(things)), dtype=np.bool_)
    for number in np.unique(stitching.names.owner[waiting]):
        a, b = (things.index(name) for name in (scene.stitches[number].first, scene.stitches[number].second))
        collide[a, b] = collide[b, a] = True

    def places(state: State) -> NDArray[np.float64]:
        return np.concatenate([stitched_state(extended, state).positions, obstacle_positions(obstacles, state.time)])

    mesh = contact_mesh(extended, obstacles, collide, places(initial_state(scene)))
    x = np.ascontiguousarray(mesh.points.positions(places(state)))
    points, edges = pairs_nearer(x, mesh.parts, mesh.patches, least)
    owner = mesh.owner[mesh.triangles[:, 0]]
    ignored = None if mesh.stitched is None else mesh.stitched.crossing
    crossing, _ = crossing_triangles(x, mesh.triangles, owner, mesh.collide, -1, ignored)
    found = points[:, 0], mesh.triangles[points[:, 1]], mesh.edges[edges], mesh.triangles[crossing]
    near = np.zeros(len(x) + 1, dtype=np.bool_)  # the last one is for nodes that are not on a surface
    near[np.concatenate([rows.ravel() for rows in found])] = True
    return np.asarray(near[points_of_stitches(extended, obstacles)[extended.stitching.old_nodes]].any(axis=1))
