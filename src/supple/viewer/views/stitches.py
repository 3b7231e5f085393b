"""Stitches between bodies: from each stitched vertex to the middle of its triangle."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.viewer.model import Moment
from supple.viewer.views.layer import Layer, single


class StitchView(Layer):
    """A line for each stitch; nothing where there are none."""

    def __init__(self, scene: Any, moment: Moment) -> None:
        self._handle = None
        if len(moment.model.stitches):
            self._handle = scene.add_line_segments(
                "/stitches", _ends(moment), (30, 30, 34), thickness=2.5, thickness_units="screen"
            )

    def update(self, moment: Moment) -> None:
        if self._handle is not None:
            self._handle.points = _ends(moment)

    def remove(self) -> None:
        if self._handle is not None:
            self._handle.remove()


def _ends(moment: Moment) -> NDArray[np.float32]:
    x, stitches = moment.shown_positions, moment.model.stitches
    return single(np.stack([x[stitches[:, 0]], x[stitches[:, 1:]].mean(axis=1)], axis=1))
