"""What a recording keeps of joints, stitches, cavities and cables.

Of joints, what they hold and where the scene places their sides; of stitches, what they join and the laws of their
energy; of cavities and cables, what they act on: their pressures and tensions are in the details."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.actuators.cables import CableLength
from supple.model.loads.actuators.enclosed_volume import EnclosedVolume
from supple.model.system import System, initial_state
from supple.results.checkpoint.values import Rows
from supple.scene.joints.joint import Conditions, Function
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rotation import rotation_matrix
from supple.scene.stitches.elements import PairNames
from supple.scene.stitches.measures import attachments
from supple.scene.stitches.stitching import no_stitching

RecordedFunction = Function

# How many vectors a function of each form has, and the names of those of a joint.
_VECTORS = {"angle": 3, "product": 2, "cosine": 2, "twist": 4}
_NAMES = {"apart", *(f"{side}.{k}" for side in ("first", "second") for k in range(3))}


@dataclass(frozen=True, eq=False)
class RecordedJoint:
    """One joint.

    Attributes
    ----------
    name : of the joint; kind : as scene files write it
    sides : numbers of what it joins: bodies, then obstacles; None for the world
    placed : (2, 3, 4) rotations and translations of the sides where the scene places everything, where the coordinate
        of the joint is zero
    point : (3,) there, in the world [m]; axes : (3, 3) unit vectors there (rows), which `conditions` numbers
    conditions : what it holds and measures
    max_force : of its motor [N m] or [N]; max_velocity : of its coordinate [rad/s] or [m/s]; infinite where there is
        none
    """

    name: str
    kind: str
    sides: tuple[int, int | None]
    placed: Annotated[NDArray[np.float64], Rows(2, 3, 4, finite=True)]
    point: Annotated[NDArray[np.float64], Rows(3, finite=True)]
    axes: Annotated[NDArray[np.float64], Rows(3, 3, finite=True)]
    conditions: Conditions
    max_force: float
    max_velocity: float

    def check(self, jointed: Sequence[bool], bodies: int) -> None:
        """Raise `ValueError` where it joins what does not exist or is soft, or a number of it is not finite.

        `jointed` tells of bodies, then obstacles, whether a joint may hold them.
        """
        first, second = self.sides
        ends = [first] if second is None else [first, second]
        there = first < bodies and all(0 <= end < len(jointed) and jointed[end] for end in ends)
        holds, upright = self.conditions, np.allclose(self.axes @ self.axes.T, np.eye(3), atol=1e-6)
        named = {*holds.lines, *(name for one in holds.functions for name in one.vectors)}
        known = named <= _NAMES and "apart" not in holds.lines and {*holds.parallel} <= {0, 1, 2}
        if not there or not known or any(len(one.vectors) != _VECTORS.get(one.form) for one in holds.functions):
            raise ValueError(f"joint {self.name!r} is not between rigid bodies of the scene, or not one that is known")
        if not upright:
            raise ValueError(f"the axes of joint {self.name!r} are not perpendicular unit vectors")


def joints_of(system: System) -> tuple[RecordedJoint, ...]:
    """The joints of a scene."""
    bodies = {body.name: body for body in system.scene.bodies}
    obstacles = {str(obstacle.name): obstacle for obstacle in system.obstacles}
    number: dict[str | None, int] = {name: k for k, name in enumerate([*bodies, *obstacles])}
    joints = []
    for joint in system.scene.joints:
        placed = []
        for name in (joint.first, joint.second):
            R, t = np.eye(3), np.zeros(3)
            if name in bodies:
                R, t = rotation_matrix(bodies[name].rotation), np.asarray(bodies[name].position)
            elif name in obstacles:
                R, t = obstacles[name].pose(0.0)
            placed.append(np.column_stack([R, t]))
        R, shift = joint.motion_to_start()
        placed[0] = np.column_stack([R.T @ placed[0][:, :3], R.T @ (placed[0][:, 3] - shift)])  # at coordinate zero
        first = bodies[joint.first]
        assert isinstance(first, RigidBody)
        most = [getattr(getattr(joint, "motor", None), "max_force", None), getattr(joint, "max_velocity", None)]
        sides = number[joint.first], number.get(joint.second)
        where = np.array(placed), np.asarray(joint.place(first), dtype=np.float64), joint.axes()
        ends = [np.inf if end is None else float(end) for end in most]
        joints.append(RecordedJoint(str(joint.name), joint.kind, sides, *where, joint.conditions(), *ends))
    return tuple(joints)


@dataclass(frozen=True, eq=False)
class StitchLaws:
    """The energies of recorded stitches: tets first, then springs.

    Attributes
    ----------
    rest_shape_inverse : (t, 3, 3) Dm^-1 of the tets [1/m]; moduli : (t, 2) mu and lam of their energy density [Pa]
    springs : (s, 2) stiffness [N/m] and rest length [m]
    """

    rest_shape_inverse: Annotated[NDArray[np.float64], Rows("t", 3, 3)]
    moduli: Annotated[NDArray[np.float64], Rows("t", 2)]
    springs: Annotated[NDArray[np.float64], Rows("s", 2)]


@dataclass(frozen=True, eq=False)
class RecordedStitches:
    """The stitches of a recording, each from a vertex to the point that was nearest to it at the start.

    Attributes
    ----------
    nodes : (k, 4) the vertex, then the corners of what it is stitched to; from n on, points of rigid bodies, and then
        vertices of obstacles
    weights : (k, 3) of the corners
    rigid_control, rigid_weights : (r, 4) vertices, and the combination of these that each point of a rigid body is
    anchor_owners : (a,) which obstacle those vertices belong to; anchors : (a, 3) at time 0, before its pose [m]
    names : of the pairs, with their strength; frames of breakable ones tell which have broken
    """

    nodes: Annotated[NDArray[np.int32], Rows("k", 4)]
    weights: Annotated[NDArray[np.float64], Rows("k", 3)]
    rigid_control: Annotated[NDArray[np.int32], Rows("r", 4, below="n")]
    rigid_weights: Annotated[NDArray[np.float64], Rows("r", 4)]
    anchor_owners: Annotated[NDArray[np.int32], Rows("a", below="obstacles")]
    anchors: Annotated[NDArray[np.float64], Rows("a", 3)]
    laws: StitchLaws
    names: PairNames

    def check(self, n: int) -> None:
        """Raise `ValueError` where a node is none of a scene with n vertices, or a stitch has no law."""
        count = n + len(self.rigid_control) + len(self.anchors)
        if len(self.nodes) and not 0 <= self.nodes.min() <= self.nodes.max() < count:
            raise ValueError(f"a stitch joins node {self.nodes.max()} of {count}")
        if len(self.laws.moduli) + len(self.laws.springs) != len(self.nodes):
            raise ValueError("there is another number of laws of stitches than of stitches")
        names, count = self.names, len(self.nodes)
        if names.pairs.shape != (count, 2) or not len(names.owner) == len(names.strength) == count:
            raise ValueError("there is another number of names of stitches than of stitches")
        if count and not 0 <= names.owner.min() <= names.owner.max() < len(names.labels):
            raise ValueError("a pair is of a stitch that does not exist")

    def __len__(self) -> int:
        return len(self.nodes)

    def corners(self, x: NDArray[np.float64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 4, 3) where the nodes are [m].

        Parameters
        ----------
        x : (n, 3) vertices of bodies [m]; poses : (obstacles, 3, 4) as of `RecordedFrame.obstacle_poses`
        """
        pose = poses[self.anchor_owners]
        there = np.einsum("aij,aj->ai", pose[:, :, :3], self.anchors) + pose[:, :, 3]
        on_rigid = np.einsum("rk,rki->ri", self.rigid_weights, x[self.rigid_control])
        return np.concatenate([x, on_rigid, there])[self.nodes]

    def segments(
        self, x: NDArray[np.float64], poses: NDArray[np.float64], broken: NDArray[np.int64] | None = None
    ) -> NDArray[np.float64]:
        """(k, 2, 3) ends of the stitches [m], of broken ones (b,) the same point twice; parameters as of `corners`."""
        corners = self.corners(x, poses)
        ends = np.stack([corners[:, 0], np.einsum("kc,kci->ki", self.weights, corners[:, 1:])], axis=1)
        if broken is not None:
            ends[broken, 1] = ends[broken, 0]
        return ends


def recorded_stitches(system: System) -> RecordedStitches:
    """The stitches of a system, those that have broken too."""
    stitching = system.scene.stitching
    nodes, weights = attachments(stitching, stitching.points(initial_state(system.scene).positions, 0.0))
    rigid, anchors, tets, springs = stitching.apart, stitching.anchors, stitching.tets, stitching.springs
    laws = StitchLaws(
        tets.rest_shape_inverse,
        np.column_stack([tets.mu, tets.lam]),
        np.column_stack([springs.stiffness, springs.rest_lengths]),
    )
    return RecordedStitches(
        nodes, weights, rigid.control, rigid.weights, anchors.owner, anchors.points, laws, stitching.names
    )


def no_stitches() -> RecordedStitches:
    """Of a scene without stitches."""
    nothing, rows = np.zeros(0, dtype=np.int32), np.zeros((0, 4), dtype=np.int32)
    laws = StitchLaws(np.zeros((0, 3, 3)), np.zeros((0, 2)), np.zeros((0, 2)))
    names = no_stitching(0).names
    return RecordedStitches(rows, np.zeros((0, 3)), rows, np.zeros((0, 4)), nothing, np.zeros((0, 3)), laws, names)


@dataclass(frozen=True, eq=False)
class RecordedCavity:
    """A cavity; triangles : (t, 3) vertices of the surface around it, seen counter-clockwise from inside."""

    name: str
    triangles: Annotated[NDArray[np.int32], Rows("t", 3, below="n")]


@dataclass(frozen=True, eq=False)
class RecordedCable:
    """A cable through points W x + offset, of some vertices.

    Attributes
    ----------
    vertices : (v,); weights : (p, v); offsets : (p, 3) [m]
    """

    name: str
    vertices: Annotated[NDArray[np.int32], Rows("v", below="n")]
    weights: Annotated[NDArray[np.float64], Rows("p", "v", finite=True)]
    offsets: Annotated[NDArray[np.float64], Rows("p", 3, finite=True)]


def cavities_of(system: System) -> tuple[RecordedCavity, ...]:
    """The cavities of a scene."""
    volumes = ((each.name, each.coordinate) for each in system.actuators)
    return tuple(
        RecordedCavity(name, one.vertices[one.triangles]) for name, one in volumes if isinstance(one, EnclosedVolume)
    )


def cables_of(system: System) -> tuple[RecordedCable, ...]:
    """The cables of a scene."""
    lengths = ((each.name, each.coordinate) for each in system.actuators)
    return tuple(
        RecordedCable(name, one.vertices, one.weights, one.offsets)
        for name, one in lengths
        if isinstance(one, CableLength)
    )
