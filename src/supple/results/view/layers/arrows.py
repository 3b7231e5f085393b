"""Arrows: forces of contacts, and velocities of the surface."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.results.view.fields import round_up
from supple.results.view.layers.layer import Layer, single
from supple.results.view.model import RenderFrame

COLOR = (200, 30, 90)
_LONGEST = 0.5  # length of the arrow of `full`, as a share of the size of the scene
_HEAD = 0.04  # length of the head of an arrow, as a share of the size of the scene


class ForceView(Layer):
    """An arrow from each contact, along its force on the first of its two bodies.

    Attributes
    ----------
    full : the force of an arrow of half the size of the scene [N], a round number that follows the strongest one; None
        where none exists
    """

    def __init__(self, scene: Any, frame: RenderFrame) -> None:
        self._size = frame.model.view.radius
        self.full: float | None = None
        head = _HEAD * self._size
        self._arrows = scene.add_arrows(
            "/forces",
            np.zeros((1, 2, 3)),
            COLOR,
            shaft_radius=0.15 * head,
            head_radius=0.4 * head,
            head_length=head,
            visible=False,
        )
        self.nodes = [self._arrows]
        self.update(frame)

    def update(self, frame: RenderFrame) -> None:
        points, forces = frame.contact_forces or (np.zeros((0, 3)), np.zeros((0, 3)))
        sizes = np.linalg.norm(forces, axis=1)
        known = np.isfinite(sizes) & (sizes > 1e-9)
        strongest = float(sizes[known].max(initial=0.0))
        self._arrows.visible = strongest > 0.0
        if strongest <= 0.0:
            self.full = None
            return
        # It grows at once, and shrinks late: otherwise all arrows would flicker.
        if self.full is None or strongest > self.full or strongest < 0.15 * self.full:
            self.full = round_up(strongest)
        ends = points[known] + _LONGEST * self._size / self.full * forces[known]
        self._arrows.points = single(np.stack([points[known], ends], axis=1))


_MOST = 400  # arrows; more cannot be distinguished
_SECONDS = 0.15  # the length of an arrow is the distance in this time


class VelocityView(Layer):
    """Arrows at some vertices of the surface."""

    def __init__(self, scene: Any, frame: RenderFrame) -> None:
        model = frame.model
        chosen = np.linspace(0, len(model.surface_vertices) - 1, min(_MOST, len(model.surface_vertices)))
        self._rows = model.surface_vertices[np.unique(chosen.astype(np.int64))]
        self._longest = 0.5 * model.view.radius
        self._head = _HEAD * model.view.radius
        self._arrows = scene.add_arrows(
            "/velocities",
            np.zeros((1, 2, 3)),
            (40, 60, 90),
            shaft_radius=0.15 * self._head,
            head_radius=0.4 * self._head,
            head_length=self._head,
            visible=False,
        )
        self.nodes = [self._arrows]
        self.update(frame)

    def update(self, frame: RenderFrame) -> None:
        if frame.velocities is None:
            return
        start = frame.finite_positions[self._rows]
        displacement = np.nan_to_num(_SECONDS * frame.velocities[self._rows], posinf=0.0, neginf=0.0)
        length = np.linalg.norm(displacement, axis=1, keepdims=True)
        displacement *= np.minimum(1.0, self._longest / np.maximum(length, 1e-300))
        some = np.linalg.norm(displacement, axis=1) >= self._head  # shorter arrows than their head are not drawn
        self._arrows.visible = bool(some.any())
        if some.any():
            self._arrows.points = single(np.stack([start[some], (start + displacement)[some]], axis=1))
