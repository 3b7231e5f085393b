"""What a recording keeps of its scene for `supple check`: laws of the bodies, and what holds them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic import EdgesAndVolume
from supple.materials.elastic_tets.active import GROWTH, MUSCLE, ActiveTets
from supple.materials.elastic_tets.quadratic import QUADRATURE_POINTS
from supple.materials.laws.internal import count_of
from supple.materials.material import Hyperelastic
from supple.materials.own.derivation import OwnLaw
from supple.materials.own.formula import Formula
from supple.materials.own.formula_law import FormulaLaw
from supple.materials.per_tet import BY_LAW, NOT_ELASTIC, Law, LawTets
from supple.materials.registry import ELASTIC_MATERIALS, RECORDED_FLOWS, RECORDED_LAWS
from supple.model.system import System
from supple.results.checkpoint.values import Rows
from supple.scene.contact_pairs import pair_table
from supple.scene.joints.axis_joint import AxisJoint

NOT_KNOWN = 255
GIVEN_BY_LAW = 254


@dataclass(frozen=True, eq=False)
class RecordedLaw:
    """Tets with one law that is not one of `registry.ELASTIC_MATERIALS`.

    Attributes
    ----------
    law : the name of a registered law, or its formula; flow : the name of how it flows, or None
    rows : (k,) the tets; parameters : (k, q); points : at how many points of each tet it is evaluated
    """

    law: str | Formula
    flow: str | None
    rows: Annotated[NDArray[np.int64], Rows("k", below="m")]
    parameters: Annotated[NDArray[np.float64], Rows("k", "q")]
    points: int

    @cached_property
    def here(self) -> LawTets | None:
        """The law itself; None where it is not known here."""
        law: Law | None = FormulaLaw(self.law) if isinstance(self.law, Formula) else RECORDED_LAWS.get(self.law)
        if law is None or self.parameters.shape[1] not in law.counts:
            return None
        flow = None if self.flow is None else RECORDED_FLOWS[self.flow]
        return LawTets(law, self.rows, self.parameters, flow, self.points)


@dataclass(frozen=True, eq=False)
class RecordedPhysics:
    """The laws of a recorded scene.

    Attributes
    ----------
    kind : (m,) row of `registry.ELASTIC_MATERIALS` of each tet, `GIVEN_BY_LAW` or `NOT_KNOWN`; mu, lam : (m,) [Pa]
    materials : names of `registry.ELASTIC_MATERIALS`
    recorded_laws : whose energies are added to those of `kind`
    internal : number of rows of internal variables of a frame
    active : growths and muscles; each frame has their values, see `SolverDetails`
    compliances : for each body those of its edges [m/N] and volumes [m^5/N], or None for a body of another law
    forces, soft_targets, scripted_pins : numbers of them in the scene
    held_joints, motors : numbers of the joints with the world or an obstacle, and of motors of joints
    """

    kind: Annotated[NDArray[np.uint8], Rows("m")]
    mu: Annotated[NDArray[np.float64], Rows("m")]
    lam: Annotated[NDArray[np.float64], Rows("m")]
    materials: tuple[str, ...]
    recorded_laws: tuple[RecordedLaw, ...]
    internal: int
    active: tuple[ActiveTets, ...]
    compliances: tuple[tuple[float, float] | None, ...]
    forces: int
    soft_targets: int
    scripted_pins: int
    held_joints: int
    motors: int

    @cached_property
    def laws(self) -> tuple[LawTets, ...]:
        """Those of the laws that are known here."""
        return tuple(law.here for law in self.recorded_laws if law.here is not None)

    @cached_property
    def tet_kinds(self) -> NDArray[np.int32]:
        """(m,) as of `TetMaterial`."""
        kind = self.kind.astype(np.int32)
        kind[self.kind == NOT_KNOWN] = NOT_ELASTIC
        kind[self.kind == GIVEN_BY_LAW] = BY_LAW
        for law in self.recorded_laws:
            if law.here is None:
                kind[law.rows] = NOT_ELASTIC
        return kind

    def knows_law(self, body: int, tets: slice) -> bool:
        """Whether the elastic energy of a body can be computed."""
        return self.compliances[body] is not None or bool((self.tet_kinds[tets] != NOT_ELASTIC).all())

    def check(self, bodies: int, curved: NDArray[np.bool_]) -> None:
        """Raise `ValueError` for what the annotations cannot say; curved : (m,) which tets are quadratic."""
        if len(self.compliances) != bodies:
            raise ValueError("it has the physics of another number of bodies")
        if list(self.materials) != [law.__name__ for law in ELASTIC_MATERIALS]:
            raise ValueError("it has other materials than this version")
        if ((self.kind >= len(self.materials)) & (self.kind < GIVEN_BY_LAW)).any():
            raise ValueError("a tet is of a material that does not exist")
        for law in self.recorded_laws:
            at = curved[law.rows]
            if at.any() != at.all() or law.points != (QUADRATURE_POINTS if at.all() else 1):
                raise ValueError("a law is not evaluated at the points of its tets")
            if law.flow is not None and law.flow not in RECORDED_FLOWS:
                raise ValueError(f"a material flows by a law {law.flow!r} that this version does not know")
        if self.internal != sum(len(tets.rows) * tets.points for tets in self.laws if tets.flow is not None):
            raise ValueError("its number of internal variables is not that of its materials")
        for each in self.active:
            rows, directions, curve = each.rows, each.directions, each.curve
            if each.kind not in (GROWTH, MUSCLE):
                raise ValueError(f"tets act by a {each.kind!r} that this version does not know")
            shapes = directions.shape[1:] == (3,) and curve.shape[1:] == (2,) and rows.ndim == 1
            inside = not rows.size or 0 <= rows.min() <= rows.max() < len(curved)
            enough = len(directions) in (len(rows), 0) and len(curve) > 0
            if not (shapes and inside and enough) or (each.kind == MUSCLE and len(directions) == 0):
                raise ValueError("a growth or muscle has other tets, or another number of directions")


@dataclass(frozen=True, eq=False)
class RecordedWeld:
    """Vertices (k,) that are points of a rigid body; soft, rigid : numbers of the bodies."""

    soft: int
    rigid: int
    vertices: Annotated[NDArray[np.int64], Rows("k", below="n")]


def recorded_physics(system: System) -> RecordedPhysics:
    """The laws of a scene."""
    m = len(system.tets)
    kind, mu, lam = np.full(m, NOT_KNOWN, dtype=np.uint8), np.zeros(m), np.zeros(m)
    compliances: list[tuple[float, float] | None] = []
    for part in system.bodies:
        material = part.body.material
        compliances.append(None)
        if isinstance(material, EdgesAndVolume):
            compliances[-1] = float(material.edge_compliance), float(material.volume_compliance)
        elif isinstance(material, Hyperelastic):
            rows = material.per_tet(part.tets.stop - part.tets.start)
            kind[part.tets] = np.where(rows.kind == BY_LAW, GIVEN_BY_LAW, rows.kind)
            mu[part.tets], lam[part.tets] = rows.mu, rows.lam
    laws = []
    for tets in system.laws.material.laws:
        named = _named(tets.law)
        if named is None:
            kind[tets.rows] = NOT_KNOWN
        else:
            flow = None if tets.flow is None else tets.flow.name
            laws.append(RecordedLaw(named, flow, tets.rows.astype(np.int64), tets.parameters, tets.points))
    active = system.laws_at(system.start_states[-1].time).active
    names = {part.name for part in system.bodies}
    return RecordedPhysics(
        kind=kind,
        mu=mu,
        lam=lam,
        materials=tuple(law.__name__ for law in ELASTIC_MATERIALS),
        recorded_laws=tuple(laws),
        internal=count_of(system.laws.material),
        active=tuple(replace(each, rows=each.rows.astype(np.int64), strength=float(each.strength)) for each in active),
        compliances=tuple(compliances),
        forces=len(system.loads) + sum(each.coordinate.is_anchored for each in system.actuators),
        soft_targets=len(system.soft_targets),
        scripted_pins=sum(part.pin.motion is not None for part in system.pins),
        held_joints=sum(joint.second not in names for joint in system.scene.joints),
        motors=sum(isinstance(joint, AxisJoint) and joint.motor is not None for joint in system.scene.joints),
    )


def _named(law: Law) -> str | Formula | None:
    """A law as recordings name it, or its formula; None where they cannot."""
    if isinstance(law, OwnLaw):
        return law.formula
    return law.name if law.name in RECORDED_LAWS else None


def untouching_pairs(system: System) -> tuple[tuple[int, int], ...]:
    """Pairs that the scene lets pass through each other: numbers of bodies, then obstacles."""
    collide = pair_table(system.scene).collide
    obstacle = np.arange(len(collide)) >= len(system.bodies)
    passing = np.argwhere(np.triu(~collide & ~(obstacle[:, None] & obstacle[None, :])))
    return tuple((int(i), int(j)) for i, j in passing)


def recorded_welds(system: System) -> tuple[RecordedWeld, ...]:
    """The welds of a scene."""
    number = {part.name: k for k, part in enumerate(system.bodies)}
    vertices, weld_of = system.welding.vertices.astype(np.int64), system.welding.weld
    welds = enumerate(system.scene.welds)
    return tuple(RecordedWeld(number[weld.body], number[weld.rigid], vertices[weld_of == k]) for k, weld in welds)
