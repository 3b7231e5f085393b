"""The base class of layers, which draw one part of a moment."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.results.view.model import Moment


class Layer(ABC):
    """A drawn part of the picture, until `remove`. The `scene` of a layer is that of viser.

    Attributes
    ----------
    nodes : what it has added to the page
    """

    nodes: list[Any]

    @abstractmethod
    def update(self, moment: Moment) -> None:
        """Draw this moment."""

    def remove(self) -> None:
        """Remove it from the page."""
        for node in self.nodes:
            node.remove()


def single(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Values in the precision that the browser uses."""
    return np.ascontiguousarray(values, dtype=np.float32)
