"""What XPBD cannot work with, as one line that names the thing and the remedy."""

from __future__ import annotations

from supple.errors import SolverError
from supple.model.system import System
from supple.solvers.xpbd.sweeps.ordering import Layout


def refuse_unsupported(system: System) -> None:
    """Check that XPBD can simulate the bodies of a system.

    Raises
    ------
    SolverError : where it cannot.
    """
    for part in system.bodies:
        if part.body.touches_with_skin and not part.rigid:
            raise SolverError(f"XPBD: body {part.name!r} touches with its skin; simulate it with Implicit")
    quadratic = [part.name for part in system.bodies if part.body.mesh.order == 2]
    if quadratic:
        raise SolverError(
            f"XPBD: body {quadratic[0]!r} has quadratic tets; simulate it with Implicit, or give linear tets: "
            "mesh.to_order(1)"
        )


def lost_position_message(system: System, layout: Layout, vertex: int, time: float) -> str:
    """The message of a frame that ended because the position of a vertex (in the solver's numbering) is lost."""
    part = next(p for p in system.bodies if p.vertices.start <= vertex < p.vertices.stop)
    number = int(layout.old_from_new[vertex]) - part.vertices.start
    return (
        f"XPBD: body {part.name!r}, vertex {number}: its position is lost (not finite, or beyond 1e12 m) "
        f"at t = {time:g} s; take more substeps or a shorter dt"
    )
