"""The balance of energy of a step: what the bodies gained, and the works of all that acts on them.

The energy of bodies is kinetic, elastic, potential (of gravity), and that of their stitches. Everything else does work:
the sum of its forces, as they act in the equations of the step, times the displacements of the step. With the works W,

    change of energy = sum W + numerical + residual.

The residual is what the forces of the step leave open: those that Newton's method did not balance (`Implicit`), or the
difference between the contact forces that are reported and those that act (`XPBD`). The rest is what the method makes
or loses: for example, backward Euler takes the square of each change of velocity, and XPBD what its projections miss.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.laws import TetLaws
from supple.materials.elastic_tets.stress import elastic_energy
from supple.materials.laws.internal import DISSIPATED
from supple.model.state import State
from supple.model.system import System

NUMERICAL = "numerical"
BREAKING = "breaking"
# Of the change of growth in a step, for its rate of work.
_DIFFERENCE = 5e-3


def no_works(system: System) -> dict[str, float]:
    """The names of all works that a scene can have; each is zero."""
    names = ["pins"] if system.pins else []
    names += [load.work for load in system.loads]
    names += ["soft_targets"] if system.soft_targets else []
    names += [actuator.work for actuator in system.actuators]
    names += ["joints"] if system.scene.joints else []
    names += ["anchors"] if len(system.stitching.anchors) else []
    names += [BREAKING] if system.scene.stitching.names.breakable else []
    names += ["contact", "friction", "damping"]
    names += ["flow"] if system.laws.material.flowing_laws else []
    return dict.fromkeys([*names, NUMERICAL], 0.0)


def add_works(works: dict[str, float], more: Mapping[str, float]) -> None:
    """Add works to those of the same names."""
    for name, work in more.items():
        works[name] = works.get(name, 0.0) + work


def works_of_actuators(system: System, works: Sequence[NDArray[np.float64]]) -> dict[str, float]:
    """By name [J], of the work (p,) on the parts of each actuator's coordinate."""
    named: dict[str, float] = {}
    for actuator, work in zip(system.actuators, works, strict=True):
        add_works(named, {actuator.work: float(work.sum())})
    return named


def work_of_growth(system: System, before: State, after: State) -> dict[str, float]:
    """The elastic energy that growth between two states adds [J].

    The mean of its rates at the beginning and at the end of the step, each for the change of the whole step: growth
    without stress does no work, neither does the rotation of a body.
    """
    begun, ended = (system.laws_at(state.time) for state in (before, after))
    if begun.growth is None or begun.growth.equals(ended.growth):
        return {}
    work = 0.0
    for state, laws in ((before, begun), (after, ended)):
        more, less = (_grown_by(laws, begun, ended, share) for share in (_DIFFERENCE, -_DIFFERENCE))
        work += elastic_energy(more, state.positions, state.internal)
        work -= elastic_energy(less, state.positions, state.internal)
    return {"growth": work / (4.0 * _DIFFERENCE)}


def _grown_by(laws: TetLaws, begun: TetLaws, ended: TetLaws, share: float) -> TetLaws:
    """The laws with this share of the change of all growths added."""
    changes = (new.value - old.value for old, new in zip(begun.active, ended.active, strict=True))
    return replace(laws, active=tuple(at.at(at.value + share * d) for at, d in zip(laws.active, changes, strict=True)))


def completed_works(works: Mapping[str, float], residual: float, change: float) -> dict[str, float]:
    """The works with the numerical one, which closes the balance of a change of the energy [J]."""
    known = {name: work for name, work in works.items() if name != NUMERICAL}
    return known | {NUMERICAL: change - sum(known.values()) - residual}


def dissipated_energy(laws: TetLaws, internal: NDArray[np.float64]) -> float:
    """The energy that flow has dissipated since the start [J]; internal : (k, 11) variables of tets that flow."""
    if not len(internal):
        return 0.0
    dissipated = internal[:, DISSIPATED]
    parts = laws.material.flowing_laws
    return float(sum(laws.volumes[part.rows] @ laws.means(part, dissipated[own]) for part, own in parts))
