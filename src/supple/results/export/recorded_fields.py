"""The fields of a recording on the surfaces that other programs get."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording
from supple.results.view.fields import nodal_values
from supple.results.view.model import RenderFrame
from supple.results.view.surfaces import SoftSurface


def fields_on(
    surface: SoftSurface, recording: Recording, frame: RecordedFrame, render_frame: RenderFrame
) -> dict[str, NDArray]:
    """By name, recorded fields (k, components) at the vertices of a surface; of tets, means of those around each."""
    found = {}
    for field in recording.fields:
        values = np.nan_to_num(frame.field(field.name).values_of_all)
        columns = values.reshape(len(values), -1).T
        if field.at == "tets":
            columns = [nodal_values(render_frame, column) for column in columns]
        drawn = [surface.of(np.repeat(column[:, None], 3, axis=1))[:, 0] for column in columns]
        found[field.name] = np.stack(drawn, axis=1)
    return found
