"""What commands change of a live scene, and where it starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from supple.app.viewer.engine.scene.grab_spring import GrabSpring
from supple.app.viewer.engine.scene.pusher import Pusher
from supple.model.state import State
from supple.model.system import System
from supple.scene.forces import Force, SoftTarget
from supple.scene.pins import Pin
from supple.scene.scene import Scene
from supple.solvers.solver import Solver
from supple.solvers.xpbd.workspace import XPBDWorkspace


@dataclass(frozen=True, eq=False)
class Setup:
    """Everything that commands change, apart from the state.

    Attributes
    ----------
    scene : without what the page adds to it:
    page_pins : pins made on the page, by body and vertex; grabs : by number; pusher : or None
    added : names of bodies that were added on the page
    """

    scene: Scene
    solver: Solver
    dt: float
    page_pins: Mapping[tuple[str, int], Pin] = field(default_factory=lambda: MappingProxyType({}))
    grabs: Mapping[int, GrabSpring] = field(default_factory=lambda: MappingProxyType({}))
    pusher: Pusher | None = None
    added: frozenset[str] = frozenset()

    def whole_scene(self) -> Scene:
        """The scene with pins, grabs and pusher of the page."""
        if not self.page_pins and not self.grabs and self.pusher is None:
            return self.scene
        pulls = [spring.load for spring in self.grabs.values()]
        return replace(
            self.scene,
            pins=(*self.scene.pins, *self.page_pins.values()),
            forces=(*self.scene.forces, *(load for load in pulls if isinstance(load, Force))),
            soft_targets=(*self.scene.soft_targets, *(load for load in pulls if isinstance(load, SoftTarget))),
            obstacles=(*self.scene.obstacles, *([self.pusher.obstacle] if self.pusher else [])),
        )


@dataclass(frozen=True, eq=False)
class Start:
    """Where a setup starts, and what the solver computed for it once."""

    setup: Setup
    state: State
    system: System
    workspace: XPBDWorkspace

    def serves(self, setup: Setup) -> bool:
        """Whether a reset with this setup leads here. Grabs, pins of the page and the pusher end with a reset."""
        same = self.setup
        return setup.scene is same.scene and setup.solver is same.solver and setup.added == same.added
