"""What XPBD reports of a step."""

from __future__ import annotations

from dataclasses import dataclass

from supple.state import SolverDetails


@dataclass(frozen=True, eq=False)
class XPBDDetails(SolverDetails):
    """What `XPBD` reports of a step.

    Attributes
    ----------
    contacts : number of contacts that the last substep resolved
    smallest_gap : smallest signed distance of a vertex from a surface at the beginnings of the substeps [m], below zero
        where they overlapped; None where no gap was smaller than about one edge length. Pairs of edges are not in it.
    """

    smallest_gap: float | None = None
