"""The base class of layers, which draw one part of a frame, and numbers in the form that the browser uses."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.view.model import RenderFrame


class Layer(ABC):
    """A drawn part of the picture, until `remove`. The `scene` of a layer is that of viser.

    Attributes
    ----------
    nodes : what it has added to the page
    """

    nodes: list[Any]

    @abstractmethod
    def update(self, frame: RenderFrame) -> None:
        """Draw this instant."""

    def remove(self) -> None:
        """Remove it from the page."""
        for node in self.nodes:
            node.remove()


def single(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Values in the precision that the browser uses."""
    return np.ascontiguousarray(values, dtype=np.float32)


def quaternion(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """(w, x, y, z) of a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_quat()[[3, 0, 1, 2]]


def turning_z_to(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """(w, x, y, z) of a rotation of the z axis to `direction` (3,), a unit vector."""
    from scipy.spatial.transform import Rotation

    return Rotation.align_vectors([direction], [[0.0, 0.0, 1.0]])[0].as_quat()[[3, 0, 1, 2]]
