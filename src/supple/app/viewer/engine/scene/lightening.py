"""Fewer tets, or another solver, for scenes that would be slower than real time on a page."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from supple.app.viewer.engine.scene.costs import slowness
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.scene.solvers import SOLVERS, kind_of
from supple.app.viewer.protocol.live_source import LiveSource
from supple.materials.elastic_tets.regions import Regions
from supple.mesh.coarser import coarser
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.mesh.topology import without_unused
from supple.scene.body import Body
from supple.solvers.implicit.solver import Implicit

_FEWEST = 60  # tets of a body: fewer do not bend
_LEAST_GAIN = 0.8  # what is not faster, or lighter, than this is not worth another method or shape


def linearized(live: LiveScene) -> tuple[LiveSource, str] | None:
    """The source with two linearizations of the implicit step, or one, where it is too slow, and what the page says.

    For one body whose solver nobody has chosen for the page; with many bodies XPBD is faster. Two are nearer to the
    whole method, above all where a body collapses; one takes two thirds of their time where it is pulled.
    """
    source, now = live.source, _slowness(live)
    if len(source.scene.bodies) > 1 or source.solver_given or now <= 1.0:
        return None
    solver = source.solver if kind_of(source.solver) == "implicit" else SOLVERS["implicit"]()
    if not isinstance(solver, Implicit) or solver.integrator in ("static", "newmark"):
        return None
    for fewer in range(min(2, solver.max_iterations - 1), 0, -1):
        faster = replace(solver, max_iterations=fewer)
        then = slowness(live.system, faster, source.dt)
        if then <= 1.0 or (fewer == 1 and then < _LEAST_GAIN * now):
            line = f"solves each step by {fewer} linearization{'s' * (fewer > 1)} of Implicit (status linearized)"
            return replace(source, solver=faster), line
    return None


def coarsened(live: LiveScene) -> tuple[LiveSource, str] | None:
    """The source with fewer tets where it is too slow, and what the page does then; None where no mesh is coarser.

    Bodies that something refers to, such as a pin or a stitch, keep their meshes, and so do bodies with several
    materials, with quadratic tets or with a deformed start. Skins stay; a body without one is drawn with its surface.
    """
    source, scene, tets = live.source, live.source.scene, len(live.system.tets)
    too_slow = _slowness(live)
    if too_slow <= 1.0:
        return None
    # The substeps of XPBD fall with the length of edges: with the third root of the number of tets.
    share = too_slow ** (-0.75 if kind_of(source.solver) == "xpbd" else -1.0)
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
        return None
    line = f"simulates {fewer:,} tets instead of {tets:,}, with the same skins"
    return replace(source, scene=replace(scene, bodies=changed)), line


def _slowness(live: LiveScene) -> float:
    return slowness(live.system, live.source.solver, live.source.dt)


def _is_free(body: Body, source: LiveSource) -> bool:
    """Whether the body may have another mesh."""
    if body.mesh.order != 1 or body.touches_with_skin or body.name in source.initial_positions:
        return False
    if isinstance(body.material, Regions) or any(
        np.ndim(getattr(body.material, one.name)) for one in fields(body.material)
    ):  # pyright: ignore[reportArgumentType]
        return False
    return not any(source.scene.referring(body.name).values())
