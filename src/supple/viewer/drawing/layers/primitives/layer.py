"""A layer of the picture: something drawn from a moment."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.viewer.drawing.moments.model import Moment


class Layer(ABC):
    """Something that stands on the page until it is removed. `scene` is viser's scene, wherever it is drawn to."""

    @abstractmethod
    def update(self, moment: Moment) -> None:
        """Draw this moment."""

    @abstractmethod
    def remove(self) -> None:
        """Take it off the page."""

    @property
    def handles(self) -> list[Any]:
        """Meshes of bodies, which can be clicked and dragged."""
        return []


def single(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """As the browser wants numbers."""
    return np.ascontiguousarray(values, dtype=np.float32)
