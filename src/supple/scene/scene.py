"""The scene: everything a user describes, checked, and free of any solver."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import finite_vector
from supple.kinds.described import Described
from supple.kinds.kind import declared
from supple.kinds.suggestion import suggestion
from supple.kinds.validators import BodyName
from supple.runtime.displayed import Showable, short_list, supplied
from supple.scene.body import PlacedBody
from supple.scene.contact_pairs import ContactPair, pair_table
from supple.scene.forces import Force, SoftTarget
from supple.scene.inputs import Input, inputs_among
from supple.scene.joints.axis_joint import AxisJoint
from supple.scene.joints.joint import Joint
from supple.scene.joints.motors import Motor
from supple.scene.joints.positions import at_positions
from supple.scene.joints.weld import Weld
from supple.scene.joints.welding import Welding, weld_together
from supple.scene.loads.cable import Cable
from supple.scene.loads.cavity import Cavity
from supple.scene.loads.load import Load
from supple.scene.loads.spring import Spring
from supple.scene.located import at
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.pins import Pin
from supple.scene.registry import PARTS
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rigid.stiffness import with_stiffness
from supple.scene.selection import InBox
from supple.scene.sensors import Sensor, SurfaceSensor
from supple.scene.stitches.stitch import Stitch
from supple.scene.stitches.stitching import Stitching, stitch_together

Named = TypeVar("Named", Obstacle, Joint, Weld)


@dataclass(frozen=True, eq=False, repr=False)
class Scene(Showable, metaclass=Described):
    """Bodies, obstacles, pins, loads and stitches under gravity.

    Parameters
    ----------
    bodies : soft (`Body`) and rigid (`RigidBody`); at least one.
    obstacles : rigid things that bodies collide with. No two bodies or obstacles have the same name.
    pins : fixed or scripted vertices.
    gravity : (3,) acceleration [m/s^2].
    forces, soft_targets : loads of these two kinds, which can also be given among `loads`.
    loads : of every kind: `Force`, `SoftTarget`, tractions, pressures, forces per mass, wind, springs between points,
        muscles, and growths. The scene keeps the first two in `forces` and `soft_targets`.
    stitches : joints of bodies with each other, and with triangle obstacles.
    sensors : of contact, angles and distances; no two have the same name.
    cavities : closed inner surfaces filled with gas or liquid; cables : through points of bodies. No two cavities and
        no two cables have the same name.
    contact_pairs : friction of some pairs of bodies and obstacles, and which of them may penetrate.
    joints : of rigid bodies with each other, with obstacles and with the world; no two have the same name.
    welds : vertices of soft bodies that are points of rigid ones; no two have the same name.

    Raises
    ------
    SceneError : where the parts contradict each other.
    """

    bodies: Sequence[PlacedBody]
    obstacles: Sequence[Obstacle] = ()
    pins: Sequence[Pin] = ()
    gravity: ArrayLike = (0.0, -9.81, 0.0)
    forces: Sequence[Force] = ()
    soft_targets: Sequence[SoftTarget] = ()
    stitches: Sequence[Stitch] = ()
    contact_pairs: Sequence[ContactPair] = ()
    loads: Sequence[Any] = ()  # of `Load`, `Force` and `SoftTarget`; then of `Load` alone
    sensors: Sequence[Sensor] = ()
    joints: Sequence[Joint] = ()
    welds: Sequence[Weld] = ()
    cavities: Sequence[Cavity] = ()
    cables: Sequence[Cable] = ()

    def __post_init__(self) -> None:
        for key, part in PARTS.items():
            try:
                items = tuple(getattr(self, key))
            except TypeError:
                raise SceneError(f"scene: {key} is {getattr(self, key)!r}; give a list") from None
            for i, item in enumerate(items):
                if not isinstance(item, part.bases):
                    raise SceneError(f"scene: {key}[{i}] is a {type(item).__name__}; give a {_name(part.bases)}")
            object.__setattr__(self, key, items)
        # Where a part was given, for errors; unless it is among `loads`, its number is that in its own list.
        given = {id(load): ("loads", i) for i, load in enumerate(self.loads)}
        for key, kind in (("forces", Force), ("soft_targets", SoftTarget)):
            object.__setattr__(self, key, (*getattr(self, key), *(one for one in self.loads if isinstance(one, kind))))
        object.__setattr__(self, "loads", tuple(load for load in self.loads if isinstance(load, Load)))
        if not self.bodies:
            raise SceneError("scene: bodies are missing; give at least one")
        object.__setattr__(self, "gravity", finite_vector(self.gravity, "scene: gravity"))
        object.__setattr__(self, "obstacles", _all_named(self.obstacles, [body.name for body in self.bodies]))
        object.__setattr__(self, "joints", _all_named(self.joints, []))
        object.__setattr__(self, "welds", _all_named(self.welds, []))
        named: dict[str | None, str] = {}
        for key, thing, items in (("bodies", "body", self.bodies), ("obstacles", "obstacle", self.obstacles)):
            for i, item in enumerate(items):
                with at(key, i, "name"):
                    if item.name in named:
                        things = f"{named[item.name]} {item.name!r} and {thing} {item.name!r}"
                        raise SceneError(f"{things} have the same name; give each body and obstacle a different name")
                named[item.name] = thing
        self._check_names(given)
        pinned = {body.name: np.zeros(len(body.points), dtype=bool) for body in self.bodies}
        for key in ("pins", "forces", "soft_targets"):
            for i, item in enumerate(getattr(self, key)):
                with at(*given.get(id(item), (key, i))):
                    self._check_selection(item, pinned)
        for key in ("sensors", "cavities", "cables", "joints", "welds"):
            self._require_own_names(key)
        for key in ("loads", "sensors", "cables"):
            for i, item in enumerate(getattr(self, key)):
                with at(*given.get(id(item), (key, i))):
                    item.check(self.bodies)
        for i, cavity in enumerate(self.cavities):
            with at("cavities", i):
                cavity.check(self.bodies, self.cavities[:i])
        self._check_welds(pinned)
        if self.contact_pairs:
            pair_table(self)
        self.inputs  # noqa: B018 - raises where two have the same name
        self._check_skins()
        pull = sum(load.pull_at_start(self.bodies) for load in self.loads if isinstance(load, Spring))
        object.__setattr__(self, "bodies", with_stiffness(self.bodies, np.asarray(self.gravity), pull))

    def save(self, path: str | Path) -> None:
        """Write a scene file that `load_scene` reads as the same scene, to the last bit of all its arrays.

        Meshes and long arrays go to a folder beside it: that of `scene.yaml` is `scene_files`. A mesh that was loaded
        from a file in the scene file's folder, or below, stays in that file. The scene file replaces an earlier one in
        one moment. It holds neither solver nor timing: add `solver`, `dt` and `steps` to it, or give these to
        `supple run`.

        Parameters
        ----------
        path : of the scene file, which ends with .yaml.

        Raises
        ------
        SceneError : where a scene file cannot hold a part of it, such as a motion that is a Python function.
        OutputError : where the system refuses to write.
        """
        supplied("save_scene")(self, path)

    def _facts(self) -> dict[str, str]:
        facts = {"bodies": short_list(body.name for body in self.bodies)}
        facts["tets"] = str(sum(len(body.mesh.tets) for body in self.bodies))
        facts["obstacles"] = short_list(obstacle.name for obstacle in self.obstacles)
        facts |= {key: str(len(getattr(self, key))) for key in PARTS if key not in facts}
        return {name: value for name, value in facts.items() if value not in ("", "0")}

    def _check_names(self, given: Mapping[int, tuple[str, int]]) -> None:
        """Raise where a declared field names a body or an obstacle that does not exist, or of the wrong kind."""
        soft = {body.name: not isinstance(body, RigidBody) for body in self.bodies}
        obstacles = [str(obstacle.name) for obstacle in self.obstacles]
        for key in PARTS:
            for i, item in enumerate(getattr(self, key)):
                for field, one in declared(type(item)).items():
                    name, of = getattr(item, field), one.validator
                    if not isinstance(of, BodyName) or name is None:
                        continue
                    known = [*soft, *(obstacles if of.obstacles else ())]
                    with at(*given.get(id(item), (key, i)), field):
                        if name not in known:
                            what = "body or obstacle" if of.obstacles else "body"
                            raise SceneError(f"{item.label}: {what} {name!r} does not exist; {suggestion(name, known)}")
                        if of.soft is not None and soft.get(name, of.soft) != of.soft:
                            what = "rigid" if of.soft else "soft"
                            raise SceneError(f"{item.label}: body {name!r} is {what}; {of.why}")

    def _require_own_names(self, key: str) -> None:
        taken: set[str | None] = set()
        for i, item in enumerate(getattr(self, key)):
            if item.name in taken:
                thing = key.removesuffix("s") if key != "cavities" else "cavity"
                with at(key, i):
                    raise SceneError(f"{item.label}: another {thing} has this name; give each a different name")
            taken.add(item.name)

    def _check_skins(self) -> None:
        """Raise for what acts on the surface of the tets of a body that touches with its skin."""
        skins = {body.name for body in self.bodies if body.touches_with_skin and not isinstance(body, RigidBody)}
        for key, names in (("stitches", ("first", "second")), ("welds", ("body",)), ("sensors", ("body",))):
            for i, item in enumerate(getattr(self, key)):
                if isinstance(item, Sensor) and not isinstance(item, SurfaceSensor):
                    continue
                for name in names:
                    if getattr(item, name) in skins:
                        with at(key, i, name):
                            raise SceneError(
                                f"{item.label}: body {getattr(item, name)!r} touches with its skin, which cannot carry "
                                f"{key}; give it collide='tets'"
                            )

    def _check_welds(self, pinned: dict[str, NDArray[np.bool_]]) -> None:
        vertices, weld_of, begin = self.welding.vertices, self.welding.weld, 0
        for body in self.bodies:
            count = len(body.mesh.vertices)
            own = (vertices >= begin) & (vertices < begin + count)
            held = pinned[body.name][vertices[own] - begin]
            if held.any():
                k, vertex = int(weld_of[own][held][0]), int((vertices[own] - begin)[held][0])
                with at("welds", k):
                    raise SceneError(
                        f"{self.welds[k].label}: vertex {vertex} is also held by a pin; pin the rigid body instead"
                    )
            begin += count

    def _check_selection(self, item: Pin | Force | SoftTarget, pinned: dict[str, NDArray[np.bool_]]) -> None:
        """Raise where vertices do not exist, or a pin selects vertices that are `pinned`, then mark these."""
        body, held = self.body(item.body), pinned[item.body]
        item.check_kind_of_body(isinstance(body, RigidBody))
        with at("box" if isinstance(item.vertices, InBox) else "vertices"):
            chosen = item.select(body.place(body.points))
            if isinstance(item, Pin):
                if held[chosen].any():
                    vertex = chosen[held[chosen]][0]
                    raise SceneError(f"{item.label}: vertex {vertex} is already held by another pin; hold it once")
                held[chosen] = True
        if isinstance(item, Force) and not callable(item.force):
            item.per_vertex(0.0, len(chosen))

    @cached_property
    def stitching(self) -> Stitching:
        """All stitches with their pairs, found where the scene places everything at time 0.

        Raises
        ------
        SceneError : where a pair does not exist, or none is within reach.
        """
        return stitch_together(self.bodies, self.obstacles, self.stitches)

    @cached_property
    def welding(self) -> Welding:
        """All welds with their vertices, found where the scene places everything.

        Raises
        ------
        SceneError : where a weld has no vertex, or a vertex has two welds.
        """
        return weld_together(self.welds, self.bodies)

    @cached_property
    def inputs(self) -> dict[str, Input]:
        """The inputs that move pins, soft targets and obstacles, and that are forces or drive motors, by name.

        Raises
        ------
        SceneError : where two of them have the same name.
        """
        moving = (*self.pins, *self.soft_targets, *self.obstacles)
        forces = (item.force for item in self.forces)
        return inputs_among([*(item.motion for item in moving), *forces, *(m.script for m in self.motors.values())])

    @property
    def motors(self) -> dict[str, Motor]:
        """The motors of hinges and sliders, by name of the joint."""
        driven = (joint for joint in self.joints if isinstance(joint, AxisJoint))
        return {str(joint.name): joint.motor for joint in driven if joint.motor is not None}

    def referring(self, name: str) -> dict[str, list[Any]]:
        """All that refers to a body of that name, by the lists of the scene; without contact pairs."""
        lists = [key for key in PARTS if key not in ("bodies", "obstacles", "contact_pairs")]
        return {key: [item for item in getattr(self, key) if name in item.bodies] for key in lists}

    def with_added(self, **parts: Sequence[Any]) -> Scene:
        """The same scene with further bodies, obstacles, pins, or other parts.

        Parameters
        ----------
        parts : lists of what is added, by the names of the arguments of `Scene`: `bodies=[cup], stitches=[seam]`.

        Raises
        ------
        SceneError : where the scene has no such parts, or they contradict each other.
        """
        for key in parts:
            if key not in PARTS:
                raise SceneError(f"scene: parts {key!r} do not exist; {suggestion(key, list(PARTS))}")
        return replace(self, **{key: (*getattr(self, key), *added) for key, added in parts.items()})

    def with_motors(self, motors: Mapping[str, Motor | None]) -> Scene:
        """The same scene with other motors of hinges and sliders, by name of the joint; None: no motor.

        Raises
        ------
        SceneError : where no hinge or slider has a name.
        """
        with_axis = {str(joint.name): joint for joint in self.joints if isinstance(joint, AxisJoint)}
        for name in motors:
            if name not in with_axis:
                raise SceneError(
                    f"scene: no hinge or slider has the name {name!r}; {suggestion(name, list(with_axis))}"
                )
        changed = {name: replace(with_axis[name], motor=motor) for name, motor in motors.items()}
        return replace(self, joints=[changed.get(str(joint.name), joint) for joint in self.joints])

    def with_joint_positions(self, positions: Mapping[str, float]) -> Scene:
        """The same scene with bodies placed so that hinges and sliders have other coordinates, where it starts.

        Everything that is connected to one side of a joint moves with it, as one: see the module
        `supple.scene.joints.positions`. Coordinates are set in the order in which they are given.

        Parameters
        ----------
        positions : by name of the joint, its coordinate [rad] or [m].

        Raises
        ------
        SceneError : where no hinge or slider has a name, a coordinate is outside of its joint's limits, or both sides
            of a joint are connected by others.
        """
        links: list[tuple[str | None, str | None]] = [(weld.body, weld.rigid) for weld in self.welds]
        obstacles = {obstacle.name for obstacle in self.obstacles}
        links += [(one.first, None if one.second in obstacles else one.second) for one in self.stitches]
        links += [(pin.body, None) for pin in self.pins]
        bodies, joints = at_positions(self.bodies, self.joints, links, positions)
        return replace(self, bodies=bodies, joints=joints)

    def body(self, name: str) -> PlacedBody:
        """The body of that name.

        Raises
        ------
        SceneError : where none exists.
        """
        for body in self.bodies:
            if body.name == name:
                return body
        raise SceneError(
            f"scene: body {name!r} does not exist; there are {', '.join(repr(b.name) for b in self.bodies)}"
        )


def _name(bases: Sequence[type]) -> str:
    return "Body or RigidBody" if bases == (PlacedBody,) else " or ".join(one.__name__ for one in bases)


def _all_named(things: Sequence[Named], bodies: Sequence[str]) -> tuple[Named, ...]:
    """The things; those without a name get a free one, their kind and number, such as `HalfSpace 1`."""
    taken = {*bodies, *(thing.name for thing in things)}
    numbers: Counter[str] = Counter()
    named = []
    for thing in things:
        kind = type(thing).__name__
        numbers[kind] += 1
        while thing.name is None and f"{kind} {numbers[kind]}" in taken:
            numbers[kind] += 1
        named.append(thing if thing.name else replace(thing, name=f"{kind} {numbers[kind]}"))
    return tuple(named)
