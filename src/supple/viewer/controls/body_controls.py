"""The folders for bodies: parameters, squash and stretch, copy, remove and add."""

from __future__ import annotations

from typing import Any

from supple.viewer.controls.controller import Controller, sequential
from supple.viewer.controls.inputs import ParameterInput
from supple.viewer.protocol import limits
from supple.viewer.protocol.commands import AddBody, CopyBody, RemoveBody, Squash
from supple.viewer.protocol.parameters import PARAMETERS, Value
from supple.viewer.protocol.snapshots import SceneDescription, Snapshot
from supple.viewer.server.browser_values import number, one_of

ALL = "all bodies"
_SQUASH, _STRETCH = 0.5, 1.5


class BodyControls:
    """The folders "Bodies" and "Add a body"."""

    def __init__(self, gui: Any, controller: Controller) -> None:
        self._gui, self._controller = gui, controller
        self.inputs: dict[str, ParameterInput] = {}
        self._inputs_for: tuple[Any, ...] = ()
        scene = controller.snapshot.description
        size = float(max(scene.high - scene.low))
        with gui.add_folder("Bodies") as self._folder:
            self.squash = gui.add_button_group("All bodies", ("squash", "stretch"))
            self.which = gui.add_dropdown("Of", (ALL, *(body.name for body in scene.bodies)), initial_value=ALL)
            self.change = gui.add_button_group("This one", ("copy", "remove"), visible=False)
        with gui.add_folder("Add a body", expand_by_default=False) as self.new:
            self.shape = gui.add_dropdown("Shape", limits.SHAPES, initial_value="sphere")
            self.size = gui.add_number(
                "Size [m]", initial_value=round(0.3 * size, 3), min=1e-3, max=100.0, step=round(0.01 * size, 4) or 0.001
            )
            self.resolution = gui.add_slider("Edges across", limits.COARSEST, 16, 1, initial_value=6)
            self.youngs = gui.add_slider("Young's modulus 10^", 3.0, 8.0, 0.1, initial_value=5.0)
            self.add = gui.add_button("Add")
        self.squash.on_click(sequential(self._squash))
        self.which.on_update(lambda _: self.show(controller.snapshot))
        self.change.on_click(sequential(self._change))
        self.add.on_click(sequential(self._add))
        self.show(controller.snapshot)

    def show(self, snapshot: Snapshot) -> None:
        """Set the inputs to the values of the simulation."""
        with self._controller.lock:
            scene = snapshot.description
            names = (ALL, *(body.name for body in scene.bodies))
            if self.which.options != names:
                if self.which.value not in names:  # first: otherwise a removed body would be selected for a moment
                    self.which.value = ALL
                self.which.options = names
            values = self._values(scene)
            inputs_for = (self.which.value, *values)
            if inputs_for != self._inputs_for:
                for made in self.inputs.values():
                    made.remove()
                with self._folder:
                    self.inputs = {
                        name: ParameterInput(self._gui, self._controller, name, value, self._whose)
                        for name, value in values.items()
                    }
                self._inputs_for = inputs_for
                self.change.visible = self.which.value != ALL
            for name, made in self.inputs.items():
                made.show(values[name], snapshot.applied)

    def _whose(self) -> str | None:
        return None if self.which.value == ALL else str(self.which.value)

    def _values(self, scene: SceneDescription) -> dict[str, Value]:
        """Values of the selected body; for "all bodies", of the first body that has the parameter."""
        whose = self._whose()
        found: dict[str, Value] = {}
        for body in scene.bodies:
            if whose in (None, body.name):
                found = {**body.values, **found}
        return {name: found[name] for name in PARAMETERS if name in found}

    def _squash(self, event: Any) -> None:
        factor = _SQUASH if one_of(self.squash.value, ("squash", "stretch")) == "squash" else _STRETCH
        self._controller.send(event.client, lambda: Squash(factor))

    def _change(self, event: Any) -> None:
        whose = self._whose()
        if whose is not None:
            kind = CopyBody if one_of(self.change.value, ("copy", "remove")) == "copy" else RemoveBody
            self._controller.send(event.client, lambda: kind(whose))

    def _add(self, event: Any) -> None:
        self._controller.send(
            event.client,
            lambda: AddBody(
                one_of(self.shape.value, limits.SHAPES),
                size=self.new_size(),
                resolution=round(number(self.resolution.value, limits.COARSEST, 16)),
                youngs=self.new_youngs(),
            ),
        )

    def new_size(self) -> float:
        """Size of a new body [m]."""
        return number(self.size.value, 1e-3, 100.0)

    def new_youngs(self) -> float:
        """Young's modulus of a new body [Pa]."""
        return 10.0 ** number(self.youngs.value, 3.0, 8.0)
