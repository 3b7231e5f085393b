"""The 3D picture of the page: layers, selected by the options and updated for every frame."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.results.view.camera import set_initial_camera
from supple.results.view.fields import FIELDS, Field
from supple.results.view.layers.arrows import ForceView, VelocityView
from supple.results.view.layers.connections import SpringView, StitchView
from supple.results.view.layers.dots import Dots
from supple.results.view.layers.floor import Ground, ShadowView
from supple.results.view.layers.joints import JointView
from supple.results.view.layers.layer import Layer
from supple.results.view.layers.section import Cut
from supple.results.view.layers.surfaces import ObstacleView, SkinView
from supple.results.view.layers.tets import TetView
from supple.results.view.look import background
from supple.results.view.model import Model, RenderFrame
from supple.results.view.options import COLOR_BY_BODY, ViewOptions

_PIN_COLOR, _CONTACT_COLOR = (20, 20, 24), (220, 40, 110)

# Called with new meshes of bodies, for example to add mouse handlers.
Prepare = Callable[[list[Any]], None]


class Stage:
    """All layers of the 3D picture.

    Parameters
    ----------
    server : of viser; frame : the first one; options : see `ViewOptions`
    """

    def __init__(self, server: Any, frame: RenderFrame, options: ViewOptions) -> None:
        self._server, self._scene = server, server.scene
        self._prepares: list[Prepare] = []
        # Options change in threads of the server; frames come from the drawing thread.
        self._lock = threading.RLock()
        self.options, self.frame = options, frame
        self._layers: list[Layer] = []
        set_initial_camera(server, frame.model.view)
        self._build()

    @property
    def model(self) -> Model:
        """The model of the current frame."""
        return self.frame.model

    @property
    def field(self) -> Field | None:
        """The field for coloring, or None."""
        return None if self.options.color_by == COLOR_BY_BODY else FIELDS[self.options.color_by]

    @property
    def color_range(self) -> tuple[float, float] | None:
        """(low, high) of the color bar, or None, also where no value is known."""
        return self._bodies.range if isinstance(self._bodies, TetView) else None

    @property
    def force_scale(self) -> float | None:
        """The force of an arrow of half the size of the scene [N]; None where no forces are drawn."""
        return None if self._forces is None else self._forces.full

    def tet_on_ray(self, origin: ArrayLike, direction: ArrayLike) -> int | None:
        """The tet that a ray meets first; None where none exists, or where no tets are drawn."""
        return self._bodies.tet_on_ray(origin, direction) if isinstance(self._bodies, TetView) else None

    def value_at(self, tet: int) -> float | None:
        """The value of the field in a tet; None where none exists."""
        values = self._bodies.values if isinstance(self._bodies, TetView) else None
        return None if values is None or tet >= len(values) else float(values[tet])

    def prepare_bodies(self, prepare: Prepare) -> None:
        """Call a function with the meshes of bodies, now and whenever they are made again."""
        with self._lock:
            self._prepares.append(prepare)
            prepare(self._bodies.nodes)

    @property
    def body_handles(self) -> list[Any]:
        """The meshes of the drawn bodies."""
        return self._bodies.nodes

    def show(self, frame: RenderFrame) -> None:
        """Draw a frame; one of another model creates all layers again."""
        with self._lock, self._server.atomic():
            changed = frame.model is not self.frame.model
            self.frame = frame
            if changed:
                self._build()
                return
            for layer in self._layers:
                layer.update(frame)
        self._server.flush()  # otherwise viser waits for more, up to a sixtieth of a second

    def apply(self, options: ViewOptions) -> None:
        """Draw the same frame with other options."""
        with self._lock, self._server.atomic():
            if options != self.options:
                self.options = options
                self._build()

    def _build(self) -> None:
        for layer in self._layers:
            layer.remove()
        scene, frame, options = self._scene, self.frame, self.options
        self._bodies = self._make_bodies()
        scene.set_background_image(background(options.dark), format="png")
        self._layers = [
            self._bodies,
            Ground(scene, frame, options.dark),
            ObstacleView(scene, frame, options.dark),
            SpringView(scene, frame),
        ]
        self._layers.append(ShadowView(scene, frame))
        self._layers.append(Dots(scene, frame, "/pins", _PIN_COLOR, 0.04, _pins))
        self._layers.append(JointView(scene, frame))
        if options.velocities:
            self._layers.append(VelocityView(scene, frame))
        self._forces = ForceView(scene, frame) if options.contacts else None
        if self._forces is not None:
            self._layers.append(self._forces)
            self._layers.append(Dots(scene, frame, "/contacts/points", _CONTACT_COLOR, 0.02, _contacts))
        if options.stitches:
            self._layers.append(StitchView(scene, frame))
        for prepare in self._prepares:
            prepare(self._bodies.nodes)

    def _make_bodies(self) -> Layer:
        options, field = self.options, self.field
        if options.surface == "wireframe":
            return SkinView(self._scene, self.frame, lines=True)
        if options.surface == "skin" and field is None:
            return SkinView(self._scene, self.frame)
        explode = options.explode if options.surface == "exploded tets" else 0.0
        cut = Cut("xyz".index(options.cut_axis), options.cut_place) if options.surface == "cut" else None
        return TetView(self._scene, self.frame, field, options.ends, explode, cut)


def _pins(frame: RenderFrame) -> NDArray[np.float64]:
    return frame.finite_positions[frame.pinned]


def _contacts(frame: RenderFrame) -> NDArray[np.float64]:
    return np.zeros((0, 3)) if frame.contact_points is None else frame.contact_points
