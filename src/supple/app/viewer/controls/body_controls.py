"""The folders for bodies: parameters, squash and stretch, copy, remove and add."""

from __future__ import annotations

from typing import Any

from supple.app.viewer.controls.controller import Controller, sequential
from supple.app.viewer.controls.number_input import NumberInput
from supple.app.viewer.controls.parameter_input import ParameterInput
from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.commands import AddBody, CopyBody, RemoveBody, Squash
from supple.app.viewer.protocol.parameters import PARAMETERS, Value
from supple.app.viewer.protocol.snapshots import SceneDescription, Snapshot

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
            self.squash = gui.add_button_group(
                "All bodies", ("squash", "stretch"), hint="Deform all bodies along gravity, without a change of volume"
            )
            self.which = gui.add_dropdown(
                "Of",
                (ALL, *(body.name for body in scene.bodies)),
                initial_value=ALL,
                hint="The body whose values are below",
            )
            self.change = gui.add_button_group(
                "This one", ("copy", "remove"), visible=False, hint="Add a copy of this body, or remove it"
            )
        with gui.add_folder("Add a body", expand_by_default=False):
            self.shape = gui.add_dropdown("Shape", limits.SHAPES, initial_value="sphere", hint="Of the new body")
            self.size = NumberInput(gui, "Size", 0.3 * size, 1e-3, 100.0, unit="m", hint="Largest side of the new body")
            self.resolution = NumberInput(
                gui,
                "Edges across",
                6,
                limits.COARSEST,
                limits.FINEST,
                whole=True,
                hint="Edges of the mesh across the new body",
            )
            self.youngs = NumberInput(
                gui, "Young's modulus", 1e5, 1e2, 1e11, unit="kPa", factor=1e3, hint="Stiffness of the new body"
            )
            self.add = gui.add_button("Add", hint="Add this shape above all bodies")
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
        factor = _SQUASH if self.squash.value == "squash" else _STRETCH
        self._controller.send(event.client, lambda: Squash(factor))

    def _change(self, event: Any) -> None:
        whose = self._whose()
        if whose is not None:
            kind = CopyBody if self.change.value == "copy" else RemoveBody
            self._controller.send(event.client, lambda: kind(whose))

    def _add(self, event: Any) -> None:
        self._controller.send(
            event.client,
            lambda: AddBody(
                self.shape.value,
                size=self.size.value,
                resolution=round(self.resolution.value),
                youngs=self.youngs.value,
            ),
        )
