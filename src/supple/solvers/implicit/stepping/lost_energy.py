"""Whether steps are too long for permanent flow.

Where things meet, an implicit method takes the square of each change of velocity in a step as its own loss. What is
elastic bounces less. What flows for good keeps a dent that is too small: the energy is missing in it. So the losses are
followed while something flows, and compared with the work of the flow so far and the energy that may still flow. What
surfaces lose that are stopped by contact depends on the mesh, not on the step, and does not count.

Measured on a clay cube of 4 x 4 x 4 cells that falls 0.45 m, where short steps leave a height of 4.3 cm: losses over
the work of flow of .08, .23, .26, .53 and .62 leave heights of 4.31, 4.64, 4.84, 5.65 and 5.79 cm.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from supple.model.diagnostics import measure
from supple.model.energy_balance import NUMERICAL, completed_works
from supple.model.state import State
from supple.model.system import System

# The losses, over the work of flow, at which a height differs by a tenth.
_LOST = 0.25
# Of the energy that is stored where flow begins: an impact is over where a step's flow takes less.
_OVER = 1e-3


def lost_in_flow(
    system: System,
    before: State,
    after: State,
    works: Mapping[str, float],
    residual: float,
    touching: NDArray[np.int32],
    so_far: tuple[float, float],
) -> tuple[tuple[float, float], str | None]:
    """The loss and the work of flow since a flow began [J], and in words that the loss is too large, else None.

    Parameters
    ----------
    before, after : without obstacles' vertices; works, residual : of the step, see `Report` [J]
    touching : vertices in contact at the end; so_far : the loss and the work of flow before the step [J]
    """
    stored = 0.0
    for tets, _ in system.laws.material.flowing_laws:
        densities = tets.flow.stored_at_yield(tets.parameters) if tets.flow is not None else None
        if densities is not None:
            stored += float(densities @ system.rest_volumes[tets.rows])
    if stored == 0.0 or not -works["flow"] > _OVER * stored:
        return (0.0, 0.0), None
    begun, ended = measure(system, before), measure(system, after)
    known = {name: work for name, work in works.items() if name != NUMERICAL}
    # Work that contact takes is also lost: what it touches does not get it.
    lost = -completed_works(known, residual, ended.energy - begun.energy)[NUMERICAL] - min(works["contact"], 0.0)
    stopped = after.velocities[touching] - before.velocities[touching]
    lost -= 0.5 * float(system.masses[touching] @ np.einsum("ij,ij->i", stopped, stopped))
    # What is pressed slowly has no motion to lose; its work, with the forces at the end of the step, is rough.
    lost = min(max(lost, 0.0), begun.kinetic_energy)
    lost, flow = so_far[0] + lost, so_far[1] - works["flow"]
    left = ended.kinetic_energy + ended.elastic_energy
    if not lost > _LOST * (flow + left) + stored:
        return (lost, flow), None
    text = (
        f"since flow began, steps have lost {lost:.2g} J and flow took {flow:.2g} J: the shape that is left depends on "
        "dt; take a quarter of dt, and integrator='bdf2'"
    )
    return (lost, flow), text
