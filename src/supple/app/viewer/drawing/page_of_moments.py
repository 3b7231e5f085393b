"""Exports moments as an HTML page that plays them: one self-contained file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from supple.app.viewer.drawing.layers.skin import drawn_points
from supple.app.viewer.drawing.moments.model import Model, Moment
from supple.app.viewer.drawing.options import ViewOptions
from supple.app.viewer.drawing.stage import Stage
from supple.results.page import quantum_of, titled
from supple.results.view.gate import new_token
from supple.results.view.server import gated_server

MOST_BYTES = 36_000_000  # of moving points before compression; longer sequences keep fewer moments


def most_moments(model: Model, options: ViewOptions) -> int:
    """Number of moments for a page of at most MOST_BYTES."""
    size = 12 * (drawn_points(model) if options.surface in ("skin", "wireframe") else 24 * len(model.tets))
    return max(2, MOST_BYTES // max(1, size))


def evenly(count: int, most: int) -> list[int]:
    """At most `most` numbers below `count`, evenly spaced, with the first and the last one."""
    return [int(i) for i in np.unique(np.linspace(0, count - 1, min(count, most)).round())]


def page_of_moments(moments: Sequence[tuple[float, Moment]], options: ViewOptions) -> str:
    """The HTML of a page that plays moments in a loop.

    Parameters
    ----------
    moments : at least one, each with its time on the page [s], ascending
    options : how they are drawn
    """
    first = moments[0][1].model
    moments = [moments[i] for i in evenly(len(moments), most_moments(first, options))]
    with gated_server(new_token()) as server:  # nobody knows the token
        stage = Stage(server, _rounded(moments[0][1]), options)
        serializer = server.get_scene_serializer()
        previous = moments[0][0]
        for seconds, moment in moments[1:]:
            serializer.insert_sleep(max(0.0, seconds - previous))
            previous = seconds
            stage.show(_rounded(moment))
        serializer.insert_sleep(0.1)
        text = serializer.as_html()
    return titled(text, ", ".join(body.name for body in first.bodies))


def _rounded(moment: Moment) -> Moment:
    """The moment with rounded positions, which compress well."""
    quantum = quantum_of(moment.model.view)
    return replace(moment, positions=np.round(moment.finite_positions / quantum) * quantum)
