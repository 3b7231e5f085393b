"""The effect of each command on a live scene."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import fields, replace
from fnmatch import fnmatchcase
from functools import singledispatch
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.engine.scene.clearance import moved_out
from supple.app.viewer.engine.scene.grab_spring import make_spring
from supple.app.viewer.engine.scene.live_scene import LiveScene
from supple.app.viewer.engine.scene.new_bodies import check_size, new_body, place_for, unused_name
from supple.app.viewer.engine.scene.solvers import SOLVERS, kind_of, with_value
from supple.app.viewer.protocol import commands, limits
from supple.app.viewer.protocol.parameters import Value, find_parameter
from supple.errors import CommandError
from supple.materials.elastic_tets.laws import tet_material
from supple.materials.elastic_tets.regions import Regions
from supple.materials.laws.internal import at_rest, checked, count_of, tets_of
from supple.materials.material import Material
from supple.materials.viscoelastic import Viscoelastic
from supple.model.state import State
from supple.model.system import BodyRange, initial_state
from supple.scene.body import Body, PlacedBody
from supple.scene.contact_pairs import ContactPair
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


@change.register
def _(command: commands.Squash, live: LiveScene) -> None:
    pinned = set(live.system.pinned_vertices.tolist())
    free = [
        part.vertices
        for part in live.system.bodies
        if not part.rigid and pinned.isdisjoint(range(part.vertices.start, part.vertices.stop))
    ]
    if not free:
        raise CommandError("every body is pinned or rigid; unpin a soft one to squash it")
    rows = np.concatenate([np.arange(part.start, part.stop) for part in free])
    x, v = live.state.positions.copy(), live.state.velocities.copy()
    x[rows] = flattened(x[rows], live.up, command.factor)
    v[rows] = 0.0
    live.adopt_checked(live.setup, replace(live.state, positions=x, velocities=v, memory=None))


def flattened(points: NDArray[np.float64], up: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    """Points (k, 3) with their height along `up`, above the lowest one, times `factor`, and their width / sqrt(factor).

    One linear map of determinant 1 for all points: no tet changes its volume, and separate bodies stay separate.
    """
    heights = points @ up
    low = heights.min()
    flat = points - heights[:, None] * up
    middle = flat.mean(axis=0)
    return middle + (flat - middle) / np.sqrt(factor) + (low + factor * (heights - low))[:, None] * up


@change.register
def _(command: commands.AddBody, live: LiveScene) -> None:
    _add(live, new_body(command, live.setup.scene, live.state.positions, live.up))


@change.register
def _(command: commands.CopyBody, live: LiveScene) -> None:
    body = live.part(command.body).body
    place = place_for(body.mesh, command.position, live.state.positions, live.up)
    _add(
        live,
        body.changed(
            name=unused_name(live.setup.scene, re.sub(r" \d+$", "", body.name)),  # a copy of "ball 1" is named "ball 2"
            position=place,
            rotation=np.zeros(3),
            velocity=np.zeros(3),
            angular_velocity=np.zeros(3),
        ),
    )


def _add(live: LiveScene, body: PlacedBody) -> None:
    scene = live.setup.scene
    check_size(scene, body.mesh)
    grown = replace(scene, bodies=(*scene.bodies, body))
    alone = initial_state(Scene([body]))
    laws = tet_material(body.material, len(body.mesh.tets), body.mesh.order)
    state = State(
        live.state.time,
        np.concatenate([live.state.positions, alone.positions]),
        np.concatenate([live.state.velocities, alone.velocities]),
        internal=np.concatenate([_internal(live), at_rest(count_of(laws))]),
        hinge_angles=live.state.hinge_angles,
        broken_stitches=live.state.broken_stitches,
        separated_stitches=live.state.separated_stitches,
    )
    live.adopt_checked(replace(live.setup, scene=grown, added=live.setup.added | {body.name}), state)


def _internal(live: LiveScene) -> NDArray[np.float64]:
    """The internal variables of the materials that flow."""
    return checked(live.system.laws.material, live.state.internal)


@change.register
def _(command: commands.RemoveBody, live: LiveScene) -> None:
    part, setup = live.part(command.body), live.setup
    if len(setup.scene.bodies) == 1:
        raise CommandError(f"body {part.name!r} is the only one; add another body first")
    keep = np.ones(len(live.state.positions), dtype=bool)
    keep[part.vertices] = False
    owners = tets_of(live.system.laws.material)
    internal = _internal(live)[(owners < part.tets.start) | (owners >= part.tets.stop)]
    x, v, angles = live.state.positions[keep], live.state.velocities[keep], live.state.hinge_angles
    stitches = live.system.scene.stitching.names
    others = ~np.isin(
        stitches.owner, [k for k, one in enumerate(setup.scene.stitches) if part.name in (one.first, one.second)]
    )
    old = live.state.broken_stitches, live.state.separated_stitches
    broken, separated = (np.flatnonzero(np.isin(np.flatnonzero(others), numbers)) for numbers in old)
    more = {"hinge_angles": angles, "broken_stitches": broken, "separated_stitches": separated}
    state = State(live.state.time, x, v, internal=internal, **more)
    smaller = replace(
        setup,
        scene=without_body(setup.scene, part.name),
        page_pins={key: pin for key, pin in setup.page_pins.items() if key[0] != part.name},
        grabs={number: spring for number, spring in setup.grabs.items() if spring.command.body != part.name},
        added=setup.added - {part.name},
    )
    live.adopt(smaller, state)


def without_body(scene: Scene, name: str) -> Scene:
    """The scene without a body and all that refers to it."""
    bodies = [body for body in scene.bodies if body.name != name]
    gone = scene.referring(name)
    left: dict[str, Any] = {key: [one for one in getattr(scene, key) if one not in gone[key]] for key in gone}
    pairs = _pairs_among([thing.name for thing in (*bodies, *scene.obstacles)], scene.contact_pairs)
    return replace(scene, bodies=bodies, contact_pairs=pairs, **left)


def _pairs_among(things: Sequence[str | None], pairs: Sequence[ContactPair]) -> list[ContactPair]:
    """The contact pairs without the names and patterns that match none of these bodies and obstacles."""

    def known(names: str | Sequence[str]) -> list[str]:
        patterns = {name: name.replace("[", "[[]") for name in names}  # only `*` and `?` are special
        return [name for name, pattern in patterns.items() if any(fnmatchcase(str(item), pattern) for item in things)]

    sides = [(pair, known(pair.first), known(pair.second)) for pair in pairs]
    return [replace(pair, first=first, second=second) for pair, first, second in sides if first and second]
