"""The solver's own numbering of vertices, and the division of constraints into chunks that can run in parallel.

Vertices are numbered along breadth-first levels, body by body: neighbours in space become neighbours in memory. The
levels are divided into consecutive chunks. A constraint spans at most two neighbouring levels, so the graph of chunks
is a path, and two colors are enough: all even chunks run at the same time, then all odd ones. A sweep over a constraint
set takes two parallel regions for any mesh; a sweep with a coloring of single constraints takes about forty.

The chunks depend on the mesh only, and the order within a chunk is fixed: the result has the same bits on any number of
threads.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.numerics.coloring import breadth_first_order

# Smaller chunks are not worth the start of a thread (about 10 us), and more of their groups are not full.
SMALLEST_CHUNK = 4096
MOST_CHUNKS = 64


@dataclass(frozen=True, eq=False)
class Layout:
    """The numbering of vertices and their chunks.

    Attributes
    ----------
    old_from_new, new_from_old : (n,) int32, between the System's vertex numbers and the solver's.
    old_points : (p,) int32, the System's number of each of the solver's points.
    rank : (n,) int32, position of each vertex (solver's number) along the levels.
    chunk : (n,) int32, the chunk of each vertex (solver's number); a constraint belongs to its lowest vertex's chunk.
    body : (n,) int32, the body of each vertex (solver's number).
    n_chunks : number of chunks.
    """

    old_from_new: NDArray[np.int32]
    new_from_old: NDArray[np.int32]
    old_points: NDArray[np.int32]
    rank: NDArray[np.int32]
    chunk: NDArray[np.int32]
    body: NDArray[np.int32]
    n_chunks: int

    def sort(self, constraints: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
        """The order of constraints (m, k) of the solver's vertex numbers, and the chunk of each one in that order.

        They are sorted by chunk, then by body, then along the levels.
        """
        ranks = self.rank[constraints]
        lowest = constraints[np.arange(len(constraints)), ranks.argmin(axis=1)]
        chunk = self.chunk[lowest]
        order = np.lexsort((ranks.min(axis=1), self.body[lowest], chunk))
        return order, chunk[order].astype(np.int32)


def make_layout(system: System) -> Layout:
    """Number the vertices of a system and divide it into chunks."""
    n = len(system.masses)
    joined = [system.edges]
    if system.shells is not None:
        joined.append(system.shells.hinges)
    if system.rods is not None:
        joined += [system.rods.nodes, system.rods.joint_nodes[0]]
    order, level_of_old = breadth_first_order(joined, n)
    rank_of_old = np.empty(n, dtype=np.int32)
    rank_of_old[order] = np.arange(n, dtype=np.int32)
    body_of_old = np.full(n, len(system.bodies), dtype=np.int32)
    for k, part in enumerate(system.bodies):
        body_of_old[part.vertices] = k
    # The vertices of a body stay contiguous, as its range requires, and follow the levels. Stitched points are last.
    old_from_new = np.lexsort((rank_of_old, body_of_old)).astype(np.int32)
    stitched = system.stitching.rigid
    body_of_old[stitched.numbers] = body_of_old[stitched.control[:, 0]]
    new_from_old = np.empty(n, dtype=np.int32)
    new_from_old[old_from_new] = np.arange(n, dtype=np.int32)
    levels = level_of_old[old_from_new]
    work = np.bincount(np.minimum.reduce(level_of_old[system.tets], axis=1), minlength=levels.max() + 1)
    work = work + np.bincount(np.minimum.reduce(level_of_old[system.edges], axis=1), minlength=levels.max() + 1)
    size = max(SMALLEST_CHUNK, -(-int(work.sum()) // MOST_CHUNKS))
    chunk_of_level = (np.concatenate([[0], np.cumsum(work)[:-1]]) // size).astype(np.int64)
    # A level larger than a chunk skips chunk numbers; they are made consecutive.
    chunk_of_level = np.unique(chunk_of_level, return_inverse=True)[1].astype(np.int32)
    return Layout(
        old_from_new=old_from_new,
        new_from_old=new_from_old,
        old_points=_old_points(system, old_from_new),
        rank=rank_of_old[old_from_new],
        chunk=chunk_of_level[levels],
        body=body_of_old[old_from_new],
        n_chunks=int(chunk_of_level[-1]) + 1,
    )


def _old_points(system: System, old_from_new: NDArray[np.int32]) -> NDArray[np.int32]:
    """Points of soft bodies follow their vertices; those of rigid bodies keep their order."""
    parts = []
    for part in system.bodies:
        begin, end = part.points.start, part.points.stop
        own = old_from_new[part.vertices] - part.vertices.start
        parts.append(np.arange(begin, end) if part.rigid else own + begin)
    return np.concatenate(parts).astype(np.int32)


def reordered(system: System, layout: Layout) -> System:
    """The same system in the solver's numbering: vertices are permuted within their bodies, nothing else changes."""
    old, new = layout.old_from_new, layout.new_from_old
    points = system.points.taken(layout.old_points)
    new_points = np.empty(len(points), dtype=np.int32)
    new_points[layout.old_points] = np.arange(len(points), dtype=np.int32)
    return replace(
        system,
        pins=tuple(replace(pin, vertices=new[pin.vertices]) for pin in system.pins),
        loads=tuple(load.renumbered(new) for load in system.loads),
        actuators=tuple(actuator.renumbered(new) for actuator in system.actuators),
        soft_targets=tuple(replace(target, vertices=new[target.vertices]) for target in system.soft_targets),
        rest_positions=np.ascontiguousarray(system.rest_positions[old]),
        masses=np.ascontiguousarray(system.masses[old]),
        tets=np.ascontiguousarray(new[system.tets]),
        edges=np.ascontiguousarray(new[system.edges]),
        shells=None if system.shells is None else system.shells.renumbered(new),
        rods=None if system.rods is None else system.rods.renumbered(new),
        triangles=np.ascontiguousarray(new_points[system.triangles]),
        points=replace(points, vertices=new[points.vertices]),
        components=np.ascontiguousarray(system.components[old]),
        stitching=system.stitching.renumbered(new),
        welding=system.welding.renumbered(new),
        effective_masses=None if system.effective_masses is None else system.effective_masses[old],
    )
