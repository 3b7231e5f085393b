"""The folder "Solver" of the panel: the solver and its parameters."""

from __future__ import annotations

from typing import Any

from supple.app.viewer.controls.controller import Controller, sequential
from supple.app.viewer.controls.parameter_input import ParameterInput, PendingValue
from supple.app.viewer.protocol.commands import SetSolver
from supple.app.viewer.protocol.parameters import PARAMETERS
from supple.app.viewer.protocol.snapshots import Snapshot

_KINDS = ("xpbd", "implicit")


class SolverControls:
    """The folder "Solver". Its inputs are the parameters of the current solver."""

    def __init__(self, gui: Any, controller: Controller) -> None:
        self._gui, self._controller = gui, controller
        self.inputs: dict[str, ParameterInput] = {}
        self._input_names: tuple[str, ...] = ()
        self._pending = PendingValue()
        self._kind = controller.snapshot.description.solver
        self._folder = gui.add_folder("Solver")
        with self._folder:
            self.kind = gui.add_dropdown(
                "Solver",
                _KINDS,
                initial_value=controller.snapshot.description.solver,
                hint="xpbd is fast; implicit solves each step to a tolerance. The state is kept.",
            )
        self.kind.on_update(sequential(self._switch))
        self.show(controller.snapshot)

    def show(self, snapshot: Snapshot) -> None:
        """Set the inputs to the values of the simulation."""
        with self._controller.lock:
            scene = snapshot.description
            names = tuple(name for name in PARAMETERS if name in scene.values)
            if names != self._input_names:
                for made in self.inputs.values():
                    made.remove()
                with self._folder:
                    self.inputs = {n: ParameterInput(self._gui, self._controller, n, scene.values[n]) for n in names}
                self._input_names = names
            for name, made in self.inputs.items():
                made.show(scene.values[name], snapshot.applied)
            # Compared with the last displayed kind, not with the input: a new choice of a visitor must not be lost.
            if self._kind != scene.solver and not self._pending.is_pending(snapshot.applied):
                self.kind.value = self._kind = scene.solver

    def _switch(self, event: Any) -> None:
        if event.client is not None:
            with self._controller.lock:
                self._kind = self.kind.value
                self._pending.requested(self._controller.send(event.client, lambda: SetSolver(self._kind)))
