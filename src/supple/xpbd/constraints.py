"""What a constraint set is, and which material has which one.

A new constraint set is one file with one class, and one line in `CONSTRAINT_SETS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.material import Material
from supple.materials.stable_neo_hookean import StableNeoHookean
from supple.system import BodyRange, System
from supple.xpbd.constraints_edges_volume import EdgeConstraints, VolumeConstraints
from supple.xpbd.constraints_stable_neo_hookean import StableNeoHookeanConstraints
from supple.xpbd.ordering import Layout


class ConstraintSet(Protocol):
    """All constraints of one kind in a scene, sorted for projection."""

    count: int

    def project(self, points: NDArray[np.float64], previous: NDArray[np.float64], h: float, parallel: bool) -> None:
        """Project every constraint once, in place.

        Parameters
        ----------
        points : (n, 4) positions [m] and inverse masses [1/kg], solver's numbering.
        previous : (n, 3) positions at the beginning of the substep [m], for damping.
        h : length of the substep [s].
        parallel : whether independent chunks run on several threads.
        """
        ...


@dataclass(frozen=True)
class _Entry:
    material: type[Material]
    sets: tuple[Callable[[System, list[BodyRange], Layout], ConstraintSet], ...]


CONSTRAINT_SETS = (
    _Entry(EdgesAndVolume, (EdgeConstraints, VolumeConstraints)),
    _Entry(StableNeoHookean, (StableNeoHookeanConstraints,)),
)


def build_constraint_sets(system: System, layout: Layout) -> list[ConstraintSet]:
    """The constraint sets of all bodies, each kind once, however many bodies share it.

    Parameters
    ----------
    system : in the solver's numbering (`supple.xpbd.ordering.reordered`).
    layout : the same numbering.

    Raises
    ------
    SolverError : where a body's material has no constraints; the text names the body.
    """
    known = [entry.material for entry in CONSTRAINT_SETS]
    for part in system.bodies:
        if type(part.body.material) not in known:
            names = " or ".join(kind.__name__ for kind in known)
            raise SolverError(
                f"XPBD: body {part.name!r} is made of {type(part.body.material).__name__}, which XPBD has no "
                f"constraints for; give it {names}, or simulate with Implicit"
            )
    sets = []
    for entry in CONSTRAINT_SETS:
        parts = [part for part in system.bodies if type(part.body.material) is entry.material]
        if parts:
            sets += [build(system, parts, layout) for build in entry.sets]
    return [made for made in sets if made.count > 0]
