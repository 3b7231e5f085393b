"""Triangles of a surface that agree with their neighbours and face outward."""

from __future__ import annotations

import logging

import numpy as np
from numpy.typing import NDArray

from supple.mesh.surface import SurfaceMesh
from supple.mesh.surface_checks import SurfaceReport
from supple.mesh.topology import edge_keys, graph_components

logger = logging.getLogger(__name__)


def facing_outward(surface: SurfaceMesh) -> tuple[SurfaceMesh, SurfaceReport]:
    """Drop unused vertices, turn triangles that disagree with their neighbours, and bodies that face inward.

    A body inside a body is unchanged: is it a cavity?
    """
    report = surface.check()
    if len(report.unused_vertices):
        logger.info("dropped %d vertices that no triangle uses", len(report.unused_vertices))
        surface = surface.compact()
        report = surface.check()
    steps: list[str] = []
    surface = consistently_oriented(surface, steps)
    if steps:
        logger.warning("%s", steps[0])
        report = surface.check()
    wrong = report.wrong_facing_components
    if len(wrong) == 0 or report.self_intersecting:
        return surface, report
    flipped = np.isin(surface.components.labels, wrong)
    # If all are wrong, the surface is inside out. Otherwise only bodies are reoriented: a cavity could be a mistake.
    if len(wrong) < report.component_count:
        for k in wrong:
            alone = SurfaceMesh(
                surface.vertices, surface.triangles[surface.components.labels == k], shares_vertices=True
            )
            if alone.volume > 0.0:
                flipped[surface.components.labels == k] = False
    if not flipped.any():
        return surface, report
    logger.warning("reoriented %d of %d triangles that faced inward", np.count_nonzero(flipped), len(flipped))
    triangles = surface.triangles.copy()
    triangles[flipped] = triangles[flipped][:, ::-1]
    reoriented = SurfaceMesh(surface.vertices, triangles)
    return reoriented, reoriented.check()


def consistently_oriented(surface: SurfaceMesh, steps: list[str]) -> SurfaceMesh:
    """Turn triangles to agree with their neighbours, where all can; `steps` gets a line about it."""
    report = surface.check()
    if len(report.inconsistent_edges) == 0 or len(report.non_manifold_edges):
        return surface
    reoriented = _disagreeing(surface.triangles, len(surface.vertices))
    if reoriented is None:
        return surface
    steps.append(f"reoriented {np.count_nonzero(reoriented)} triangles to agree with their neighbours")
    return SurfaceMesh(surface.vertices, np.where(reoriented[:, None], surface.triangles[:, ::-1], surface.triangles))


def _disagreeing(triangles: NDArray[np.int32], n_vertices: int) -> NDArray[np.bool_] | None:
    """Which triangles to turn so that neighbours agree (the smaller part of each piece); None if one-sided.

    The nodes of a graph are (triangle, side 0 or 1). Two nodes are connected where neighbours with these sides agree.
    """
    starts, keys = triangles.ravel(), edge_keys(triangles, n_vertices).ravel()
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    a, b = order[same], order[same + 1]
    m = len(triangles)
    # Neighbours that agree run along their common edge in opposite directions.
    agree = starts[a] != starts[b]
    ta, tb = a // 3, b // 3
    rows = np.concatenate([ta, ta + m])
    columns = np.concatenate([np.where(agree, tb, tb + m), np.where(agree, tb + m, tb)])
    labels = graph_components(2 * m, rows, columns)
    if (labels[:m] == labels[m:]).any():
        return None
    # Each piece appears twice in the graph, as it is and reoriented; the lower label is one of the two.
    reoriented = labels[:m] > labels[m:]
    piece = np.minimum(labels[:m], labels[m:])
    share = np.bincount(piece, weights=reoriented) / np.maximum(np.bincount(piece), 1)
    return reoriented ^ (share[piece] > 0.5)
