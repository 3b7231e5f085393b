"""The bounds of what is drawn, and the viewpoint from which all of it is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class View:
    """The bounds of a whole recording, and its viewpoint.

    Attributes
    ----------
    low, high : (3,) bounds of the bodies in all frames [m]
    up : (3,) unit vector against gravity; y where there is none
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    up: NDArray[np.float64]

    @property
    def center(self) -> NDArray[np.float64]:
        return 0.5 * (self.low + self.high)

    @property
    def radius(self) -> float:
        """Of the ball about `center` that contains all bodies at all times [m]."""
        return max(0.5 * float(np.linalg.norm(self.high - self.low)), 1e-6)

    def eye(self, angle: float) -> NDArray[np.float64]:
        """The viewpoint from which the ball fills a vertical angle of view [degrees], slightly above and aside."""
        side = np.eye(3)[int(np.argmin(np.abs(self.up)))]
        ahead = np.cross(side, self.up)
        side = np.cross(self.up, ahead / np.linalg.norm(ahead))
        direction = 0.45 * side + 0.3 * self.up + 0.84 * np.cross(side, self.up)
        distance = 1.05 * self.radius / np.sin(np.radians(0.5 * angle))
        return self.center + distance * direction / np.linalg.norm(direction)
