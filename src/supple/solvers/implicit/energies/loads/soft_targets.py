"""Springs from vertices to target positions: k/2 |x - target|^2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.model.system import System
from supple.solvers.implicit.energies.potential import HessianBlocks, Potential, Projection


@dataclass(frozen=True, eq=False)
class SoftTargets(Potential):
    """Springs of rest length zero.

    Parameters
    ----------
    vertices : (k,), a vertex may occur several times; stiffness : (k,) [N/m]; targets : (k, 3) [m]
    """

    vertices: NDArray[np.int32]
    stiffness: NDArray[np.float64]
    targets: NDArray[np.float64]
    projection = Projection.UNNEEDED
    work = "soft_targets"

    def value(self, x: NDArray[np.float64]) -> float:
        d = x[self.vertices] - self.targets
        return 0.5 * float(np.einsum("i,ij,ij->", self.stiffness, d, d))

    def add_gradient(self, x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
        np.add.at(out, self.vertices, self.stiffness[:, None] * (x[self.vertices] - self.targets))

    def add_hessian(self, x: NDArray[np.float64], out: HessianBlocks, project: bool) -> None:
        np.add.at(out.vertices, self.vertices, self.stiffness[:, None, None] * np.eye(3))


def soft_targets_at(system: System, time: float) -> SoftTargets:
    """The scene's soft targets with their positions at `time` [s]."""
    parts = system.soft_targets
    return SoftTargets(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([np.full(len(part.vertices), part.target.stiffness) for part in parts]),
        np.concatenate([part.targets(time) for part in parts]),
    )
