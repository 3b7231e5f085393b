"""The folder "View" of the panel: view options."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.controls.controller import sequential
from supple.app.viewer.controls.view.cameras import Cameras
from supple.app.viewer.controls.view.color_scale import ColorRange, arrows_html, bar_html
from supple.app.viewer.controls.view.overlay import Overlay, set_theme
from supple.app.viewer.protocol.quantities import written
from supple.results.view.camera import PRESETS
from supple.results.view.fields import FIELDS
from supple.results.view.options import COLOR_BY_BODY, SURFACES, ViewOptions
from supple.results.view.stage import Stage


class Probe:
    """A label at the tet on which a visitor has clicked with Shift, which moves with it.

    Parameters
    ----------
    server : of viser; stage : draws the bodies
    """

    def __init__(self, server: Any, stage: Stage) -> None:
        self._server, self._stage = server, stage
        self._tet: int | None = None
        self._label: Any = None
        stage.prepare_bodies(self._add_handlers)

    def refresh(self) -> None:
        """Update the label; remove it where no field is drawn, or the tet was removed."""
        stage, tet = self._stage, self._tet
        value = None if tet is None else stage.value_at(tet)
        if tet is None or value is None or stage.field is None:
            if self._label is not None:
                self._label.remove()
            self._label = self._tet = None
            return
        body = next(body.name for body in stage.model.bodies if body.tets.start <= tet < body.tets.stop)
        text = f"{written(value, stage.field.unit)} · {body}"
        place = tuple(stage.frame.finite_positions[stage.model.tets[tet]].mean(axis=0))
        if self._label is None:
            self._label = self._server.scene.add_label("/probe", text, position=place)
        else:
            self._label.text, self._label.position = text, place

    def _add_handlers(self, handles: list[Any]) -> None:
        for handle in handles:
            handle.on_click(modifier="shift")(self._clicked)

    async def _clicked(self, event: Any) -> None:
        self._tet = self._stage.tet_on_ray(event.ray_origin, event.ray_direction)
        self.refresh()


# A key of viser, and what it does.
Actions = Mapping[str, tuple[str, Callable[[Any], object]]]


def add_keys(gui: Any, cameras: Cameras, actions: Actions) -> None:
    """Add keys for the camera, and others.

    Parameters
    ----------
    actions : by key, the name of an action, and what it does for a visitor
    """
    views: dict[str, tuple[str, Callable[[Any], object]]] = {
        "F": ("Fit the picture to the bodies", cameras.fit),
    }
    for number, preset in enumerate(PRESETS, start=1):
        views[str(number)] = (f"View from: {preset}", lambda client, preset=preset: cameras.look(client, preset))
    for key, (name, act) in (*actions.items(), *views.items()):
        command = gui.add_command(name, hotkey=key)
        command.on_trigger(sequential(lambda event, act=act: event.client is not None and act(event.client)))


_AXES = ("x", "y", "z")


class ViewControls:
    """Inputs for the view options of a stage, and the legend.

    Parameters
    ----------
    server : of viser; stage : draws with the options; overlay : has the legend
    changed : called with every change, before it is drawn
    """

    def __init__(
        self,
        server: Any,
        stage: Stage,
        overlay: Overlay,
        changed: Callable[[ViewOptions], None],
    ) -> None:
        self._server, self._stage, self._overlay, self._changed = server, stage, overlay, changed
        self._lock = threading.RLock()
        gui, options = server.gui, stage.options
        with gui.add_folder("View"):
            self.surface = gui.add_dropdown(
                "Surface", SURFACES, initial_value=options.surface, hint="What is drawn of the bodies"
            )
            self.color_by = gui.add_dropdown(
                "Color", (COLOR_BY_BODY, *FIELDS), initial_value=options.color_by, hint="The legend is in the picture"
            )
            self.range = ColorRange(gui, stage, self.apply)
            self.explode = gui.add_slider(
                "Explode", 0.05, 1.5, 0.05, initial_value=options.explode, visible=False, hint="Distance between tets"
            )
            self.cut_axis = gui.add_dropdown(
                "Cut across", _AXES, initial_value=options.cut_axis, visible=False, hint="Axis across the section"
            )
            self.cut_place = gui.add_slider(
                "Cut at", 0.0, 1.0, 0.01, initial_value=options.cut_place, visible=False, hint="Share of each body"
            )
            self.velocities = gui.add_checkbox(
                "Velocities", initial_value=options.velocities, hint="Arrows: the distance in 0.15 s"
            )
            self.contacts = gui.add_checkbox(
                "Contacts", initial_value=options.contacts, hint="Where surfaces touch, with arrows of the forces"
            )
            self.stitches = gui.add_checkbox(
                "Stitches", initial_value=options.stitches, hint="Lines between stitched surfaces"
            )
            self.dark = gui.add_checkbox("Dark", initial_value=False, hint="A dark page, for all who look at it")
            self._message = gui.add_markdown("", visible=False)
            self.cameras = Cameras(server, stage)
        self.probe = Probe(server, stage)
        shape = self.surface, self.color_by, self.explode, self.cut_axis, self.cut_place
        for handle in (*shape, self.velocities, self.contacts, self.stitches):
            handle.on_update(lambda _: self.apply())
        self.dark.on_update(lambda _: self._theme())

    def apply(self) -> None:
        """Draw with the options of the panel."""
        # Inputs that change together arrive in any order; the last one must see the values of all.
        with self._lock:
            options = replace(
                self._stage.options,
                surface=self.surface.value,
                color_by=self.color_by.value,
                ends=self.range.ends,
                explode=self.explode.value,
                cut_axis=self.cut_axis.value,
                cut_place=self.cut_place.value,
                velocities=self.velocities.value,
                contacts=self.contacts.value,
                stitches=self.stitches.value,
                dark=self.dark.value,
            )
            self.explode.visible = options.surface == "exploded tets"
            self.cut_axis.visible = self.cut_place.visible = options.surface == "cut"
            self._changed(options)
            self._stage.apply(options)
            self.range.show()
            self.refresh()

    def _theme(self) -> None:
        set_theme(self._server, self.dark.value)
        self.apply()

    def refresh(self) -> None:
        """Update the legend, the value at a chosen place, and the text about contacts."""
        stage = self._stage
        field = stage.field if stage.options.surface != "wireframe" else None
        legend = "" if field is None else bar_html(field, stage.color_range)
        self._overlay.show("legend", legend)
        self.probe.refresh()
        full = stage.force_scale
        self._overlay.show("arrows", "" if full is None else arrows_html(full))
        found = stage.frame.contact_points
        forces = "" if full is not None or not found_some(found) else " Their forces are not known."
        self._message.content = f"Contacts: {'not known' if found is None else len(found)}.{forces}"
        self._message.visible = stage.options.contacts
        self.cameras.refresh()


def found_some(points: NDArray[np.float64] | None) -> bool:
    """Whether there are contacts."""
    return points is not None and len(points) > 0
