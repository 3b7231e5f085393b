"""Fewer tets, or another solver, for scenes that would be slower than real time on a page."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np

from supple.app.viewer.engine.scene.costs import allowed, in_substeps
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.scene.solvers import SOLVERS, kind_of
from supple.app.viewer.protocol.live_source import LiveSource
from supple.materials.elastic_tets.regions import Regions
from supple.mesh.meshing.coarser import coarser
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.mesh.topology import without_unused
from supple.scene.body import Body
from supple.scene.scene import Scene

_FEWEST = 60  # tets of a body: fewer do not bend
_LEAST_GAIN = 0.8  # what is not lighter than this is not worth another shape
# So many substeps for the stiffness of one body take longer than the two to five iterations of `Implicit`.
_STIFF = 100


def lightened(live: LiveScene, measured: float = 0.0) -> Iterator[tuple[LiveSource, str]]:
    """Sources that keep up with real time, or nearly, and one line about each, the best one first.

    There is none where the scene keeps up with real time, or no source is faster. One stiff body gets the solver
    `Implicit`.

    Bodies that something refers to, such as a pin or a stitch, keep their meshes, and so do bodies with several
    materials, with quadratic tets or with a deformed start. Skins stay; a body without one is drawn with its surface.

    Parameters
    ----------
    live : after a step, which tells the number of substeps; measured : what a step takes [s], where that is known
    """
    source, scene, substeps = live.source, live.source.scene, live.report.iterations
    tets, bodies = len(live.system.tets), len(scene.bodies)
    taken, may_take = max(in_substeps(live.system, substeps), measured), allowed(live.system, source.dt)
    if kind_of(source.solver) != "xpbd" or taken <= may_take:
        return
    if bodies == 1 and substeps > _STIFF and not source.solver_given:
        line = (
            f"the page simulates with Implicit: XPBD takes {substeps} substeps a frame for so stiff a body, and more "
            "time; supple view --full keeps the solver"
        )
        yield replace(source, solver=SOLVERS["implicit"]()), line
    # The number of substeps falls with the length of edges: with the third root of the number of tets.
    share = (may_take / taken) ** 0.75
    made: dict[int, TetMesh | None] = {}
    changed = []
    for body in scene.bodies:
        if isinstance(body, Body) and _is_free(body, source):
            if id(body.mesh) not in made:
                made[id(body.mesh)] = coarser(body.mesh, max(_FEWEST, int(share * len(body.mesh.tets))))
            mesh = made[id(body.mesh)]
            if mesh is not None:
                skin = body.skin or SurfaceMesh(*without_unused(body.mesh.vertices, body.mesh.surface.triangles))
                body = replace(body, mesh=mesh, skin=skin)
        changed.append(body)
    fewer = sum(len(body.mesh.tets) for body in changed)
    if fewer > _LEAST_GAIN * tets:
        return
    line = (
        f"the page simulates {fewer:,} tets instead of {tets:,}, with the same skins, to keep up with real time; "
        "supple view --full keeps the meshes"
    )
    yield replace(source, scene=replace(scene, bodies=changed)), line


def _is_free(body: Body, source: LiveSource) -> bool:
    """Whether the body may have another mesh."""
    if body.mesh.order != 1 or body.touches_with_skin or body.name in source.initial_positions:
        return False
    if isinstance(body.material, Regions) or any(
        np.ndim(getattr(body.material, one.name)) for one in fields(body.material)
    ):  # pyright: ignore[reportArgumentType]
        return False
    return body.name not in _referred_to(source.scene)


def _referred_to(scene: Scene) -> set[str | None]:
    """The names of the bodies that something else of the scene acts on, measures or joins."""
    single = (*scene.pins, *scene.forces, *scene.soft_targets, *scene.welds)
    several = (*scene.loads, *scene.cavities, *scene.cables, *scene.sensors)
    named = {one.body for one in single} | {name for one in several for name in one.bodies}
    return named | {name for stitch in scene.stitches for name in (stitch.first, stitch.second)}
