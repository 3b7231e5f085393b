"""The folder "Mouse" of the panel: mode, stiffness and radius."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from supple.app.viewer.controls.controller import Controller, sequential
from supple.app.viewer.controls.unit_slider import Scale, UnitSlider
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import RemovePusher, Unpin

DRAG, PUSH = "drag and pin", "push"
MODES = (DRAG, PUSH)


class MouseControls:
    """The folder "Mouse".

    Parameters
    ----------
    changed : called when another mode is selected
    """

    def __init__(self, gui: Any, controller: Controller, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._controller = controller
        scene = controller.snapshot.description
        size = max(float(max(scene.high - scene.low)), 10.0 * limits.SMALLEST_LENGTH)
        self._radii = 0.02 * size, 0.5 * size
        with gui.add_folder("Mouse"):
            self.mode = gui.add_dropdown("Left button", MODES, initial_value=DRAG, hint="What the left button does")
            self._hint = gui.add_markdown(_HINTS[DRAG])
            self.strength = UnitSlider(
                gui,
                "Strength",
                Scale(0.03, 30.0, limits.WEAKEST_GRAB, limits.STRONGEST_GRAB, logarithmic=True),
                1.0,
                hint="Stiffness of the spring, as a factor of one with which the body oscillates at 4 Hz",
            )
            self.radius_input = UnitSlider(
                gui,
                "Ball",
                Scale(*self._radii, *self._radii, "m"),
                0.15 * size,
                hint="Radius of the ball that pushes",
                visible=False,
            )
            self.unpin = gui.add_button("Unpin all", hint="Release all vertices that were pinned on the page")
        # In order, so that the backdrop exists exactly in the mode "push".
        self.mode.on_update(sequential(self._switch))
        self.unpin.on_click(sequential(lambda e: controller.send(e.client, Unpin)))

    @property
    def pushes(self) -> bool:
        """Whether the mouse moves the ball."""
        return self.mode.value == PUSH

    @property
    def stiffness(self) -> float:
        """Stiffness factor of grabs."""
        return self.strength.value

    @property
    def radius(self) -> float:
        """Radius of the ball [m]."""
        return self.radius_input.value

    def _switch(self, event: Any) -> None:
        pushes = self.pushes
        self._hint.content = _HINTS[PUSH if pushes else DRAG]
        self.strength.visible, self.radius_input.visible = not pushes, pushes
        if not pushes:
            self._controller.send(event.client, RemovePusher)
        self._changed()


_HINTS = {
    DRAG: "Drag a body to pull it; release it to throw it. Click to pin or unpin. Drag beside it to turn the camera.",
    PUSH: "Hold the button anywhere: a ball follows the pointer. The right button and the wheel move the camera.",
}
