"""The 3D picture of the page: layers, selected by the options and updated for every moment."""

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
from supple.results.view.model import Model, Moment
from supple.results.view.options import COLOR_BY_BODY, ViewOptions

_PIN_COLOR, _CONTACT_COLOR = (20, 20, 24), (220, 40, 110)

# Called with new meshes of bodies, for example to add mouse handlers.
Prepare = Callable[[list[Any]], None]


class Stage:
    """All layers of the 3D picture.

    Parameters
    ----------
    server : of viser; moment : the first one; options : see `ViewOptions`
    """

    def __init__(self, server: Any, moment: Moment, options: ViewOptions) -> None:
        self._server, self._scene = server, server.scene
        self._prepares: list[Prepare] = []
        # Options change in threads of the server; moments come from the drawing thread.
        self._lock = threading.RLock()
        self.options, self.moment = options, moment
        self._layers: list[Layer] = []
        set_initial_camera(server, moment.model.view)
        self._build()

    @property
    def model(self) -> Model:
        """The model of the current moment."""
        return self.moment.model

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

    def show(self, moment: Moment) -> None:
        """Draw a moment; one of another model creates all layers again."""
        with self._lock, self._server.atomic():
            changed = moment.model is not self.moment.model
            self.moment = moment
            if changed:
                self._build()
                return
            for layer in self._layers:
                layer.update(moment)
        self._server.flush()  # otherwise viser waits for more, up to a sixtieth of a second

    def apply(self, options: ViewOptions) -> None:
        """Draw the same moment with other options."""
        with self._lock, self._server.atomic():
            if options != self.options:
                self.options = options
                self._build()

    def _build(self) -> None:
        for layer in self._layers:
            layer.remove()
        scene, moment, options = self._scene, self.moment, self.options
        self._bodies = self._make_bodies()
        scene.set_background_image(background(options.dark), format="png")
        self._layers = [
            self._bodies,
            Ground(scene, moment, options.dark),
            ObstacleView(scene, moment, options.dark),
            SpringView(scene, moment),
        ]
        self._layers.append(ShadowView(scene, moment))
        self._layers.append(Dots(scene, moment, "/pins", _PIN_COLOR, 0.04, _pins))
        self._layers.append(JointView(scene, moment))
        if options.velocities:
            self._layers.append(VelocityView(scene, moment))
        self._forces = ForceView(scene, moment) if options.contacts else None
        if self._forces is not None:
            self._layers.append(self._forces)
            self._layers.append(Dots(scene, moment, "/contacts/points", _CONTACT_COLOR, 0.02, _contacts))
        if options.stitches:
            self._layers.append(StitchView(scene, moment))
        for prepare in self._prepares:
            prepare(self._bodies.nodes)

    def _make_bodies(self) -> Layer:
        options, field = self.options, self.field
        if options.surface == "wireframe":
            return SkinView(self._scene, self.moment, lines=True)
        if options.surface == "skin" and field is None:
            return SkinView(self._scene, self.moment)
        explode = options.explode if options.surface == "exploded tets" else 0.0
        cut = Cut("xyz".index(options.cut_axis), options.cut_place) if options.surface == "cut" else None
        return TetView(self._scene, self.moment, field, options.ends, explode, cut)


def _pins(moment: Moment) -> NDArray[np.float64]:
    return moment.finite_positions[moment.pinned]


def _contacts(moment: Moment) -> NDArray[np.float64]:
    return np.zeros((0, 3)) if moment.contact_points is None else moment.contact_points
