"""The interface of a constraint set, and the constraint sets of each material.

A new constraint set is one file with one class, and one line in `CONSTRAINT_SETS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.materials.elastic import EdgesAndVolume, StableNeoHookean
from supple.materials.elastic_tets.regions import Regions
from supple.materials.material import Elastic, Material
from supple.model.system import BodyRange, System
from supple.scene.rod import Rod
from supple.scene.shell import Shell
from supple.solvers.xpbd.constraints.edges_and_volume import EdgeConstraints, VolumeConstraints
from supple.solvers.xpbd.constraints.rods import rod_constraints
from supple.solvers.xpbd.constraints.shells import shell_constraints
from supple.solvers.xpbd.constraints.stable_neo_hookean import StableNeoHookeanConstraints
from supple.solvers.xpbd.sweeps.ordering import Layout
from supple.solvers.xpbd.sweeps.sweep import Sweep


class ConstraintSet(Protocol):
    """All constraints of one kind in a scene, sorted for projection."""

    count: int
    work: int  # cost of a sweep, in edges or volumes
    sweep: Sweep  # over all of them

    def project(self, points: NDArray[np.float64], h: float) -> None:
        """Project every constraint once, in place.

        Parameters
        ----------
        points : (n, 4) positions [m] and inverse masses [1/kg], in the solver's numbering.
        h : length of the substep [s].
        """
        ...


@runtime_checkable
class ElementStage(Protocol):
    """A constraint set whose projections depend on those of the substep before."""

    def begin_frame(self, x: NDArray[np.float64], known: NDArray[np.float64] | None) -> None:
        """Begin a frame at places x (n, >= 3) [m], with the `memory` of the frame before, where it is known."""
        ...

    def begin(self, x: NDArray[np.float64], v: NDArray[np.float64], h: float) -> None:
        """Begin a substep of h [s] at places x (n, 3) [m], with velocities v (n, 3) [m/s]."""
        ...

    def memory(self) -> NDArray[np.float64]:
        """What the next frame must know of the last projections, in the numbering of the scene's elements."""
        ...


@dataclass(frozen=True)
class _Entry:
    material: type[Material]
    sets: tuple[Callable[[System, list[BodyRange], Layout], ConstraintSet], ...]

    def takes(self, material: Material) -> bool:
        """Whether this entry handles the material: it is of this kind, or all of its regions are."""
        if isinstance(material, Regions):
            return all(type(each) is self.material for each in material.materials)
        return type(material) is self.material


CONSTRAINT_SETS = (
    _Entry(EdgesAndVolume, (EdgeConstraints, VolumeConstraints)),
    _Entry(StableNeoHookean, (StableNeoHookeanConstraints,)),
)


def refuse_materials(system: System) -> None:
    """Raise `SolverError` where the material of a soft body has no constraints; the text names the body."""
    for part in system.bodies:
        material = part.body.material
        if (
            not part.rigid
            and not isinstance(part.body, (Shell, Rod))
            and not any(entry.takes(material) for entry in CONSTRAINT_SETS)
        ):
            raise SolverError(f"XPBD: {_why_not(part.name, material)}, or simulate with Implicit")


def build_constraint_sets(system: System, layout: Layout) -> list[ConstraintSet]:
    """The constraint sets of all soft bodies: one of each kind, for all bodies that need it.

    Parameters
    ----------
    system : in the solver's numbering (`supple.solvers.xpbd.sweeps.ordering.reordered`).
    layout : of this numbering.

    Raises
    ------
    SolverError : where a body's material has no constraints; the text names the body.
    """
    refuse_materials(system)
    soft = [part for part in system.bodies if not part.rigid]
    sets = []
    for entry in CONSTRAINT_SETS:
        parts = [part for part in soft if entry.takes(part.body.material)]
        if parts:
            sets += [build(system, parts, layout) for build in entry.sets]
    return [
        made for made in [*sets, *shell_constraints(system, layout), *rod_constraints(system, layout)] if made.count > 0
    ]


def _why_not(body: str, material: Material) -> str:
    known = [entry.material for entry in CONSTRAINT_SETS]
    if not isinstance(material, Regions):
        names = " or ".join(kind.__name__ for kind in known)
        return f"body {body!r} has the material {type(material).__name__}, which XPBD cannot simulate; use {names}"
    unknown = dict.fromkeys(type(each).__name__ for each in material.materials if type(each) not in known)
    names = " or ".join(kind.__name__ for kind in known if issubclass(kind, Elastic))
    return f"body {body!r} has regions of {', '.join(unknown)}, which XPBD cannot simulate; use regions of {names}"
