"""Other grabs, without computing again what does not depend on them: a body must follow the pointer at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from supple.app.viewer.engine.scene.grab_spring import GrabSpring
from supple.model.loads.build import applied_force
from supple.model.system import SoftTargetRange, System
from supple.scene.forces import Force, SoftTarget
from supple.scene.scene import Scene
from supple.solvers.solver import Solver
from supple.solvers.xpbd.workspace import XPBDWorkspace


def grabbed(system: System, scene: Scene, grabs: Mapping[int, GrabSpring]) -> System:
    """The System of a scene that differs from that of `system` only by its grabs.

    Parameters
    ----------
    scene : with the loads of `grabs` and of no other grab
    """
    loads = dict(zip(system.scene.forces, system.loads, strict=False))
    targets = {part.target: part for part in system.soft_targets}
    for spring in grabs.values():
        part = next(part for part in system.bodies if part.name == spring.command.body)
        placed = part.body.place(part.body.points)
        rows = spring.load.select(placed)
        if isinstance(spring.load, Force):
            loads.setdefault(spring.load, applied_force(spring.load, part.body, part.vertices.start, rows))
        elif isinstance(spring.load, SoftTarget):
            vertices = (rows + part.vertices.start).astype(np.int32)
            targets.setdefault(spring.load, SoftTargetRange(spring.load, vertices, placed[rows]))
    made = replace(
        system,
        scene=scene,
        loads=(*(loads[force] for force in scene.forces), *system.loads[len(system.scene.forces) :]),
        soft_targets=tuple(targets[target] for target in scene.soft_targets),
    )
    # What a System computes when it is asked for depends neither on forces nor on soft targets.
    own = {field.name for field in fields(system)}
    vars(made).update({name: value for name, value in vars(system).items() if name not in own})
    return made


def workspace_for(solver: Solver, system: System, before: Any) -> Any:
    """The workspace of a solver for a system that `grabbed` made, from that for the system before."""
    return before.with_loads(system) if isinstance(before, XPBDWorkspace) else solver.prepare(system)
