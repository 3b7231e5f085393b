"""Keys of the page; viser lists them in its palette of commands (Ctrl+K)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from supple.app.viewer.controls.controller import sequential
from supple.results.view.camera import PRESETS, fit, look_from
from supple.results.view.stage import Stage

# A key of viser, and what it does.
Actions = Mapping[str, tuple[str, Callable[[Any], object]]]


def add_keys(gui: Any, stage: Stage, actions: Actions) -> None:
    """Add keys for the camera, and others.

    Parameters
    ----------
    actions : by key, the name of an action, and what it does for a visitor
    """
    views: dict[str, tuple[str, Callable[[Any], object]]] = {
        "F": ("Fit the picture to the bodies", lambda client: fit(client, stage.moment.finite_positions)),
    }
    for number, preset in enumerate(PRESETS, start=1):
        views[str(number)] = (
            f"View from: {preset}",
            lambda client, preset=preset: look_from(client, preset, stage.model.view),
        )
    for key, (name, act) in (*actions.items(), *views.items()):
        command = gui.add_command(name, hotkey=key)
        command.on_trigger(sequential(lambda event, act=act: event.client is not None and act(event.client)))
