"""The folder "View" of the panel: view options, for simulations and recordings."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from supple.viewer.drawing.camera import PRESETS, look_from
from supple.viewer.drawing.coloring.color_scale import bar_html
from supple.viewer.drawing.coloring.fields import FIELDS
from supple.viewer.drawing.options import COLOR_BY_BODY, SURFACES, ViewOptions
from supple.viewer.drawing.stage import Stage
from supple.viewer.server.browser_values import number, one_of

_AXES = ("x", "y", "z")


class ViewControls:
    """Inputs for the view options of a stage, and the color bar.

    Parameters
    ----------
    server : of viser; stage : draws with the options; changed : called with every change, before it is drawn
    """

    def __init__(
        self, server: Any, stage: Stage, changed: Callable[[ViewOptions], None] = lambda options: None
    ) -> None:
        self._stage, self._changed = stage, changed
        self._lock = threading.RLock()
        gui, options = server.gui, stage.options
        with gui.add_folder("View"):
            self.surface = gui.add_dropdown("Surface", SURFACES, initial_value=options.surface)
            self.color_by = gui.add_dropdown("Color", (COLOR_BY_BODY, *FIELDS), initial_value=options.color_by)
            self.explode = gui.add_slider("Apart", 0.05, 1.5, 0.05, initial_value=options.explode, visible=False)
            self.cut_axis = gui.add_dropdown("Cut across", _AXES, initial_value=options.cut_axis, visible=False)
            self.cut_place = gui.add_slider("Cut at", 0.0, 1.0, 0.01, initial_value=options.cut_place, visible=False)
            self._bar = gui.add_html("", visible=False)
            self.velocities = gui.add_checkbox("Velocities", initial_value=options.velocities)
            self.contacts = gui.add_checkbox("Contacts", initial_value=options.contacts)
            self.stitches = gui.add_checkbox("Stitches", initial_value=options.stitches)
            self._message = gui.add_markdown("", visible=False)
            self.camera = gui.add_button_group("Camera", PRESETS)
        shape = self.surface, self.color_by, self.explode, self.cut_axis, self.cut_place
        for handle in (*shape, self.velocities, self.contacts, self.stitches):
            handle.on_update(lambda _: self.apply())
        self.camera.on_click(self._look)

    def apply(self) -> None:
        """Draw with the options of the panel."""
        # Inputs that change together arrive in any order; the last one must see the values of all.
        with self._lock:
            options = replace(
                self._stage.options,
                surface=one_of(self.surface.value, SURFACES),
                color_by=one_of(self.color_by.value, (COLOR_BY_BODY, *FIELDS)),
                explode=number(self.explode.value, 0.05, 1.5),
                cut_axis=one_of(self.cut_axis.value, _AXES),
                cut_place=number(self.cut_place.value, 0.0, 1.0),
                velocities=bool(self.velocities.value),
                contacts=bool(self.contacts.value),
                stitches=bool(self.stitches.value),
            )
            self.explode.visible = options.surface == "exploded tets"
            self.cut_axis.visible = self.cut_place.visible = options.surface == "cut"
            self._changed(options)
            self._stage.apply(options)
            self.refresh()

    def refresh(self) -> None:
        """Update the color bar and the text about contacts."""
        stage = self._stage
        field, limits = stage.field, stage.color_range
        bar = "" if field is None or limits is None else bar_html(field, *limits)
        self._bar.content, self._bar.visible = bar, bool(bar)
        found = stage.moment.contact_points
        self._message.content = f"Contacts: {'not known' if found is None else len(found)}."
        self._message.visible = stage.options.contacts

    def _look(self, event: Any) -> None:
        if event.client is not None:
            look_from(event.client, one_of(self.camera.value, PRESETS), self._stage.model.view)
