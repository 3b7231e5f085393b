"""The effect of each command on a live scene."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import singledispatch

import numpy as np

from supple.app.viewer.engine.scene.clearance import moved_out
from supple.app.viewer.engine.scene.grab_spring import make_spring
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.scene.solvers import SOLVERS, kind_of, with_value
from supple.app.viewer.protocol import commands, limits
from supple.app.viewer.protocol.parameters import Value, find_parameter
from supple.errors import CommandError
from supple.materials.elastic_tets.regions import Regions
from supple.materials.material import Material
from supple.materials.viscoelastic import Viscoelastic
from supple.model.state import State
from supple.model.system import BodyRange
from supple.scene.body import Body, PlacedBody
from supple.scene.pins import Pin
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.scene import Scene

# Distance between vertices and obstacles at a change to the implicit solver, as a share of the mean edge length.
CLEARANCE = 1e-3


@singledispatch
def change(command: commands.Command, live: LiveScene) -> None:
    """Execute a command on the scene.

    Raises
    ------
    SuppleError : where this is impossible; then nothing is changed.
    """
    raise CommandError(f"a scene cannot execute the command {type(command).__name__}")


@change.register
def _(command: commands.Reset, live: LiveScene) -> None:
    live.reset()


@change.register
def _(command: commands.SetSolver, live: LiveScene) -> None:
    if kind_of(live.setup.solver) == command.kind:
        return
    setup = replace(live.setup, solver=live.solvers.get(command.kind) or SOLVERS[command.kind]())
    if command.kind == "xpbd":
        live.adopt(setup)
    else:
        live.adopt_checked(setup, clear_of_obstacles(live))


def clear_of_obstacles(live: LiveScene) -> State | None:
    """The state with a small gap between vertices and obstacles, for a solver that needs a distance above zero.

    XPBD leaves vertices exactly on an obstacle, or slightly inside. Returns None where nothing has to be moved.
    """
    system, state = live.system, live.state
    gap = CLEARANCE * float(system.rest_lengths.mean())
    x = state.positions
    free = np.setdiff1d(np.arange(len(x)), system.pinned_vertices)
    moved = x.copy()
    for obstacle in system.obstacles:
        moved[free] = moved_out(obstacle, moved[free], state.time, gap)
    return None if np.array_equal(moved, x) else replace(state, positions=moved, memory=None)


@change.register
def _(command: commands.SetParameter, live: LiveScene) -> None:
    setup, scene = live.setup, live.setup.scene
    match find_parameter(command.name).owner:
        case "solver":
            live.adopt_checked(replace(setup, solver=with_value(setup.solver, command.name, command.value)))
        case "scene" if command.name == "dt":
            live.adopt(replace(setup, dt=float(command.value)))
        case "scene":
            live.adopt(replace(setup, scene=replace(scene, gravity=-float(command.value) * live.up)))
        case _:
            live.adopt(replace(setup, scene=_with_body_value(live, command)))


def _with_body_value(live: LiveScene, command: commands.SetParameter) -> Scene:
    scene = live.setup.scene
    if command.body is not None:
        live.part(command.body)
    bodies = [
        _with_value(body, command.name, command.value) if command.body in (None, body.name) else None
        for body in scene.bodies
    ]
    if not any(bodies):
        if command.body is None:
            raise CommandError(f"no body here has {command.name}")
        raise CommandError(f"body {command.body!r} has no {command.name}")
    obstacles = scene.obstacles
    if command.name == "friction" and command.body is None:
        obstacles = [replace(obstacle, friction=float(command.value)) for obstacle in obstacles]
    return replace(
        scene, bodies=[new or old for new, old in zip(bodies, scene.bodies, strict=True)], obstacles=obstacles
    )


def _with_value(body: PlacedBody, name: str, value: Value) -> PlacedBody | None:
    """The body with this value, or None where it has no such parameter."""
    if name == "friction":
        return body.changed(friction=float(value))
    material = _material_with_value(body.material, name, float(value)) if isinstance(body, Body) else None
    return None if material is None else body.changed(material=material)


def _material_with_value(material: Material, name: str, value: float) -> Material | None:
    if isinstance(material, Regions):
        materials = [_material_with_value(item, name, value) or item for item in material.materials]
        return replace(material, materials=materials)
    if isinstance(material, Viscoelastic):
        inner = _material_with_value(material.material, name, value)
        return None if inner is None else replace(material, material=inner)
    if name not in {field.name for field in fields(material)}:
        return None
    return replace(material, **{name: value})


@change.register
def _(command: commands.Grab, live: LiveScene) -> None:
    part = live.part(command.body)
    others = {number: spring for number, spring in live.setup.grabs.items() if number != command.grab}
    if len(others) >= limits.MOST_GRABS:
        raise CommandError(f"there are {len(others)} grabs already; release one first")
    spring = make_spring(command, live.setup.scene, part, live.system.masses, live.state.positions)
    live.grab({**others, command.grab: spring})


@change.register
def _(command: commands.MoveGrab, live: LiveScene) -> None:
    live.move_grab(command)


@change.register
def _(command: commands.ReleaseGrab, live: LiveScene) -> None:
    grabs = dict(live.setup.grabs)
    if grabs.pop(command.grab, None) is not None:
        live.grab(grabs)


@change.register
def _(command: commands.Pin, live: LiveScene) -> None:
    part = live.part(command.body)
    if command.vertex >= len(part.body.mesh.vertices):
        raise CommandError(f"body {part.name!r} has no vertex {command.vertex}")
    if part.vertices.start + command.vertex in live.system.pinned_vertices:
        return
    pins = dict(live.setup.page_pins)
    if len(pins) >= limits.MOST_PINS:
        raise CommandError(f"{len(pins)} vertices are pinned on the page already; unpin some first")
    held = None if isinstance(part.body, RigidBody) else [command.vertex]  # a rigid body is held as a whole
    pins[command.body, command.vertex] = Pin(command.body, held, name="page")
    live.adopt(replace(live.setup, page_pins=pins))


@change.register
def _(command: commands.Unpin, live: LiveScene) -> None:
    setup = live.setup
    if command.body is None or command.vertex is None:
        if setup.page_pins:
            live.adopt(replace(setup, page_pins={}))
        return
    part = live.part(command.body)
    if (command.body, command.vertex) in setup.page_pins:
        left = {key: pin for key, pin in setup.page_pins.items() if key != (command.body, command.vertex)}
        live.adopt(replace(setup, page_pins=left))
        return
    _remove_from_pin(live, part, command.vertex)


def _remove_from_pin(live: LiveScene, part: BodyRange, vertex: int) -> None:
    """Remove a vertex from one of the pins of the scene."""
    row = part.vertices.start + vertex
    held = next((held for held in live.system.pins if row in held.vertices), None)
    if held is None:
        return
    keep = (held.vertices != row) & (not part.rigid)  # a rigid body is held as a whole
    pins = [pin for pin in live.setup.scene.pins if pin is not held.pin]
    anchors = {item.pin: item.anchors for item in live.system.pins}
    anchors |= {item.target: item.anchors for item in live.system.soft_targets}
    if keep.any():
        rest = replace(held.pin, vertices=held.vertices[keep] - part.vertices.start)
        pins.append(rest)
        anchors[rest] = held.anchors[keep]
    live.adopt(replace(live.setup, scene=replace(live.setup.scene, pins=pins)), anchors=anchors)
