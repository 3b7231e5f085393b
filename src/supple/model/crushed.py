"""Tets that have lost nearly all of their volume, and bodies that their own weight crushes.

The energies of most materials are finite at J = 0: pressed hard enough, such a tet would turn over. What keeps it from
that is the solver: `Implicit` by a barrier, `XPBD` by projections. Below J = `CRUSHED` they carry more than the
material: the barrier presses with 1.2 (mu + lam) at half of its onset of J = 0.1, stable Neo-Hookean nowhere with more
than mu + lam. So the J of such a tet is not what its material asks for, and forces near it are not its material's.
Where the energy goes to infinity at J = 0 (`NeoHookean`), any J above zero is the material's answer.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.stress import least_ratios, mean_deformation_gradients
from supple.materials.kinds import infinite_when_flat
from supple.model.state import State
from supple.model.system import BodyRange, System

# J below which a tet is crushed; and one of a body that cannot carry its weight, which `XPBD` holds below this.
CRUSHED, HELD = 0.05, 0.25


def crushed_tets(system: System, state: State) -> NDArray[np.int64]:
    """The tets that are crushed, of bodies that had none where the simulation began; the flattest one first."""
    J, limits = _ratios(system, state), np.full(len(system.tets), CRUSHED)
    for part in system.bodies:
        if too_soft(system, part):
            limits[part.tets] = HELD
    crushed = (limits > J) & ~infinite_when_flat(system.laws_at(state.time).material)
    if crushed.any():
        begun = _ratios(system, system.start_states[0]) < limits
        for part in system.bodies:
            crushed[part.tets] &= not begun[part.tets].any()
    rows = np.flatnonzero(crushed)
    return rows[np.argsort(J[rows])]


def crushed_message(system: System, state: State, tets: NDArray[np.int64]) -> str:
    """Which body is crushed, where, and what helps; of tets from `crushed_tets`."""
    worst = int(tets[0])
    part = next(p for p in system.bodies if p.tets.start <= worst < p.tets.stop)
    count = int(np.count_nonzero((tets >= part.tets.start) & (tets < part.tets.stop)))
    place = ", ".join(f"{value:.3g}" for value in state.positions[system.tets[worst]].mean(axis=0))
    J = float(_ratios(system, state)[worst])
    others = f" (as {count} tets of the body have too little)" if count > 1 else ""
    text = f"body {part.name!r}, tet {worst - part.tets.start} at ({place}) m has {J:.2g} of its volume{others}"
    remedy = "its material does not stop what presses there: take a stiffer one, a smaller load or a shorter step; or "
    remedy += "NeoHookean and Implicit, where it is meant"
    return f"{text}; {too_soft(system, part) or remedy}"


def too_soft(system: System, part: BodyRange) -> str:
    """What is wrong with the stiffness of a body that its own weight crushes; "" where it carries its weight."""
    youngs = getattr(part.body.material, "youngs", None)
    gravity = math.hypot(*system.gravity)
    if part.rigid or part.body.offset > 0.0 or youngs is None or not gravity or not (system.obstacles or system.pins):
        return ""
    heights = system.start_states[0].positions[part.vertices] @ (system.gravity / gravity)
    density = float(system.masses[part.vertices].sum() / system.rest_volumes[part.tets].sum())
    weight, stiffest = density * gravity * float(np.ptp(heights)), float(np.max(youngs))
    if stiffest >= weight:
        return ""
    text = f"body {part.name!r}: E = {stiffest:.3g} Pa is less than density x gravity x height = {weight:.3g} Pa: "
    return f"{text}its own weight crushes it; did you mean {stiffest:.3g} MPa (youngs={1e6 * stiffest:.3g})?"


def _ratios(system: System, state: State) -> NDArray[np.float64]:
    """(m,) the smallest J of every tet."""
    laws, x = system.laws_at(state.time), state.positions
    return least_ratios(laws, x, mean_deformation_gradients(laws, x))
