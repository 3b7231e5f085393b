"""Constraints sorted for projection: into chunks, and within these into runs that share their constants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.system import BodyRange
from supple.xpbd.sweeps.ordering import Layout


@dataclass(frozen=True, eq=False)
class Segments:
    """Runs of constraints of one kind within one chunk.

    Attributes
    ----------
    order : (m,) the constraints in the order of projection
    chunk_pointers : (n_chunks + 1,) the segments of chunk c are chunk_pointers[c] .. chunk_pointers[c + 1]
    bounds : (s, 2) first constraint of a segment, and the one after its last
    kinds : (s,) the kind of each segment
    """

    order: NDArray[np.int64]
    chunk_pointers: NDArray[np.int64]
    bounds: NDArray[np.int64]
    kinds: NDArray[np.int64]


def sort_into_segments(layout: Layout, constraints: NDArray[np.int32], kind: NDArray[np.int64]) -> Segments:
    """Sort constraints (m, k) by chunk and kind (m,) and find the runs."""
    order, chunk = layout.sort(constraints, kind)
    kind = kind[order]
    changes = np.flatnonzero((np.diff(chunk) != 0) | (np.diff(kind) != 0)) + 1
    starts = np.concatenate([[0], changes]) if len(order) else np.zeros(0, dtype=np.int64)
    ends = np.concatenate([changes, [len(order)]]) if len(order) else np.zeros(0, dtype=np.int64)
    pointers = np.searchsorted(chunk[starts], np.arange(layout.n_chunks + 1))
    return Segments(
        order=order,
        chunk_pointers=pointers.astype(np.int64),
        bounds=np.ascontiguousarray(np.stack([starts, ends], axis=1), dtype=np.int64),
        kinds=kind[starts] if len(order) else np.zeros(0, dtype=np.int64),
    )


def gather(
    parts: list[BodyRange], which: str, constants: list[NDArray[np.float64]]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """The constraints of several bodies, and the constants of each.

    Parameters
    ----------
    parts : the bodies; which : "edges" or "tets"
    constants : for each body, (c,) for all of its constraints or (count, c) for each of them.

    Returns
    -------
    rows : (m,) of the System's edges or tets; kind : (m,) rows of the table; table : (kinds, c) distinct constants.
    """
    ranges = [getattr(part, which) for part in parts]
    rows = np.concatenate([np.arange(r.start, r.stop) for r in ranges])
    shapes = [(r.stop - r.start, np.shape(given)[-1]) for r, given in zip(ranges, constants, strict=True)]
    every = np.concatenate([np.broadcast_to(given, shape) for given, shape in zip(constants, shapes, strict=True)])
    table, kind = np.unique(every, axis=0, return_inverse=True)
    return rows, kind.reshape(-1), table
