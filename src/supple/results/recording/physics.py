"""What a recording keeps of its scene for `supple check`: laws of the bodies, loads, and pairs that may touch."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.elastic_tets.active import GROWTH, MUSCLE, ActiveTets
from supple.materials.elastic_tets.quadratic import QUADRATURE_POINTS
from supple.materials.flows.internal import count_of
from supple.materials.flows.registry import RECORDED_FLOWS
from supple.materials.laws.registry import RECORDED_LAWS
from supple.materials.material import Hyperelastic
from supple.materials.own.derivation import OwnLaw
from supple.materials.own.formula import VARIABLES, Formula
from supple.materials.own.formula_law import FormulaLaw
from supple.materials.per_tet import BY_LAW, NO_REGION, NOT_ELASTIC, Law, LawTets
from supple.materials.registry import ELASTIC_MATERIALS
from supple.model.system import System
from supple.results.recording.actions.actuators import write_actuators
from supple.results.recording.actions.joints import joints_of
from supple.results.recording.actions.loads import write_loads
from supple.results.recording.checked_hdf5 import CheckedFile
from supple.scene.contact_pairs import pair_table
from supple.scene.joints.axis_joint import AxisJoint

NOT_KNOWN = 255
GIVEN_BY_LAW = 254
_GROUP = "supple/physics"


@dataclass(frozen=True, eq=False)
class RecordedPhysics:
    """The laws of a recorded scene.

    Attributes
    ----------
    region : (m,) the region over whose patches the energy of a tet is averaged, or `NO_REGION`
    kind : (m,) row of `registry.ELASTIC_MATERIALS` of each tet, `GIVEN_BY_LAW` or `NOT_KNOWN`; mu, lam : (m,) [Pa]
    laws : whose energies are added to those of `kind`
    internal : number of rows of internal variables of a frame
    active : growths and muscles; each frame has their values, see `SolverDetails`
    compliances : for each body those of its edges [m/N] and volumes [m^5/N], or None for a body of another law
    forces, soft_targets, scripted_pins, stitches : numbers of them in the scene
    held_joints, motors : numbers of the joints with the world or an obstacle, and of motors of joints
    """

    kind: NDArray[np.uint8]
    mu: NDArray[np.float64]
    lam: NDArray[np.float64]
    compliances: tuple[tuple[float, float] | None, ...]
    forces: int
    soft_targets: int
    scripted_pins: int
    stitches: int
    held_joints: int
    motors: int
    region: NDArray[np.int32]
    laws: tuple[LawTets, ...] = ()
    internal: int = 0
    active: tuple[ActiveTets, ...] = ()

    @property
    def tet_kinds(self) -> NDArray[np.int32]:
        """(m,) as of `TetMaterial`."""
        kind = self.kind.astype(np.int32)
        kind[self.kind == NOT_KNOWN] = NOT_ELASTIC
        kind[self.kind == GIVEN_BY_LAW] = BY_LAW
        return kind

    def knows_law(self, body: int, tets: slice) -> bool:
        """Whether the elastic energy of a body can be computed."""
        return self.compliances[body] is not None or bool((self.kind[tets] != NOT_KNOWN).all())


def write_physics(own: h5py.Group, system: System) -> dict[str, Any]:
    """Write the arrays to the group of the recording; returns the part that belongs in its header."""
    m = len(system.tets)
    kind, mu, lam = np.full(m, NOT_KNOWN, dtype=np.uint8), np.zeros(m), np.zeros(m)
    region = np.full(m, NO_REGION, dtype=np.int32)
    compliances: list[list[float] | None] = []
    for part in system.bodies:
        material = part.body.material
        compliances.append(None)
        if isinstance(material, EdgesAndVolume):
            compliances[-1] = [float(material.edge_compliance), float(material.volume_compliance)]
        elif isinstance(material, Hyperelastic):
            rows = material.per_tet(part.tets.stop - part.tets.start)
            kind[part.tets] = np.where(rows.kind == BY_LAW, GIVEN_BY_LAW, rows.kind)
            mu[part.tets], lam[part.tets], region[part.tets] = rows.mu, rows.lam, rows.region
    known = [tets for tets in system.laws.material.laws if _described(tets.law) is not None]
    for tets in system.laws.material.laws:
        if _described(tets.law) is None:
            kind[tets.rows] = NOT_KNOWN
    group = own.create_group("physics")
    group["kind"], group["mu"], group["lam"] = kind, mu, lam
    group["region"] = region
    for k, tets in enumerate(known):
        group[f"law_{k}/rows"] = tets.rows.astype(np.int32)[:, None]
        group[f"law_{k}/parameters"] = tets.parameters
    active = system.laws_at(system.start_states[-1].time).active
    for k, each in enumerate(active):
        group[f"active_{k}/rows"] = each.rows.astype(np.int32)[:, None]
        group[f"active_{k}/directions"], group[f"active_{k}/curve"] = each.directions, each.curve
    return {
        "active": [[each.kind, each.strength] for each in active],
        "laws": [law.__name__ for law in ELASTIC_MATERIALS],
        "by_law": [_described(tets.law) for tets in known],
        "flows": [None if tets.flow is None else tets.flow.name for tets in known],
        "points": [tets.points for tets in known],
        "internal": count_of(system.laws.material),
        "compliances": compliances,
        "forces": len(system.loads) + sum(each.coordinate.is_anchored for each in system.actuators),
        "soft_targets": len(system.soft_targets),
        "scripted_pins": sum(part.pin.motion is not None for part in system.pins),
        "stitches": len(system.stitching),
        "held_joints": sum(joint.second not in {part.name for part in system.bodies} for joint in system.scene.joints),
        "motors": sum(isinstance(joint, AxisJoint) and joint.motor is not None for joint in system.scene.joints),
        "untouching": _untouching(system),
        "welds": _welds(system),
        "loads": write_loads(group, system),
        "actuators": write_actuators(group, system),
        "joints": [joint.described() for joint in joints_of(system)],
    }


def _described(law: Law) -> str | dict[str, Any] | None:
    """A law as recordings name it, or write it out; None where they cannot."""
    if not isinstance(law, OwnLaw):
        return law.name if law.name in RECORDED_LAWS else None
    return None if law.formula is None else asdict(law.formula)


def _law_of(entry: object) -> Law | None:
    """The law that `_described` gave; None where it is not known here.

    Raises
    ------
    SceneError : where a formula is no formula.
    """
    if not isinstance(entry, dict):
        return RECORDED_LAWS.get(str(entry))
    text, of, names = (entry.get(key) for key in ("text", "of", "parameters"))
    if not isinstance(text, str) or of not in VARIABLES or not isinstance(names, list):
        raise SceneError("its entry is incomplete")
    return FormulaLaw(Formula(text, of, tuple(map(str, names))))


def _untouching(system: System) -> list[list[int]]:
    """Pairs that the scene lets pass through each other: numbers of bodies, then obstacles."""
    collide = pair_table(system.scene).collide
    obstacle = np.arange(len(collide)) >= len(system.bodies)
    passing = np.argwhere(np.triu(~collide & ~(obstacle[:, None] & obstacle[None, :])))
    return passing.tolist()


def _welds(system: System) -> list[tuple[int, int, list[int]]]:
    """The soft and the rigid body of each weld, and its vertices."""
    number = {part.name: k for k, part in enumerate(system.bodies)}
    vertices, weld_of = system.welding.vertices, system.welding.weld
    welds = enumerate(system.scene.welds)
    return [(number[weld.body], number[weld.rigid], vertices[weld_of == k].tolist()) for k, weld in welds]


def read_physics(file: CheckedFile, header: dict[str, Any], quadratic: NDArray[np.bool_]) -> RecordedPhysics:
    """The laws of a recording; quadratic : (m,) which tets are.

    Raises
    ------
    OutputError : where the data are contradictory.
    """
    physics = header["physics"]
    try:
        names = ("forces", "soft_targets", "scripted_pins", "stitches", "held_joints", "motors")
        counts = [int(physics[key]) for key in names]
        laws = [str(law) for law in physics["laws"]]
        laws_here = [_law_of(entry) for entry in physics["by_law"]]
        flows = list(physics["flows"])
        points = [int(number) for number in physics["points"]]
        internal = int(physics["internal"])
        compliances = tuple(
            None if pair is None else (float(pair[0]), float(pair[1])) for pair in physics["compliances"]
        )
    except SceneError as error:
        raise file.broken(f"the energy of a material: {error}") from None
    except (KeyError, TypeError, ValueError, IndexError):
        raise file.broken("the physics in its header is not described as it should be") from None
    if len(compliances) != len(header["bodies"]):
        raise file.broken("its header describes the physics of another number of bodies")
    m = len(quadratic)
    if laws != [law.__name__ for law in ELASTIC_MATERIALS]:
        raise file.of_another_version("it has other materials")
    kind = file.array(f"{_GROUP}/kind", "u", (m,)).astype(np.uint8)
    if ((kind >= len(laws)) & (kind < GIVEN_BY_LAW)).any():
        raise file.broken("a tet is of a material that does not exist")
    mu, lam = file.array(f"{_GROUP}/mu", "f", (m,)), file.array(f"{_GROUP}/lam", "f", (m,))
    region = file.array(f"{_GROUP}/region", "i", (m,)).astype(np.int32)
    known = []
    for k, (law, flow, at) in enumerate(zip(laws_here, flows, points, strict=False)):
        tets = file.indices(f"{_GROUP}/law_{k}/rows", 1, m)[:, 0].astype(np.int64)
        parameters = file.array(f"{_GROUP}/law_{k}/parameters", "f", (len(tets), None))
        if at != (QUADRATURE_POINTS if quadratic[tets].all() else 1) or quadratic[tets].any() != quadratic[tets].all():
            raise file.broken("a law is not evaluated at the points of its tets")
        if flow is not None and flow not in RECORDED_FLOWS:
            raise file.of_another_version(f"a material flows by a law {flow!r} that this version does not know")
        if law is not None and parameters.shape[1] in law.counts:
            parameters = np.ascontiguousarray(parameters)
            known.append(LawTets(law, tets, parameters, None if flow is None else RECORDED_FLOWS[flow], at))
        else:
            kind[tets] = NOT_KNOWN
    if internal != sum(len(tets.rows) * tets.points for tets in known if tets.flow is not None):
        raise file.broken("its number of internal variables is not that of its materials")
    active = _read_active(file, physics, m)
    here = kind, mu, lam, compliances, *counts
    return RecordedPhysics(*here, region=region, laws=tuple(known), internal=internal, active=active)


def _read_active(file: CheckedFile, physics: dict[str, Any], m: int) -> tuple[ActiveTets, ...]:
    try:
        described = [(str(kind), float(strength)) for kind, strength in physics["active"]]
    except (KeyError, TypeError, ValueError):
        raise file.broken("its growths and muscles are not described as they should be") from None
    found = []
    for k, (kind, strength) in enumerate(described):
        if kind not in (GROWTH, MUSCLE):
            raise file.of_another_version(f"tets act by a {kind!r} that this version does not know")
        rows = file.indices(f"{_GROUP}/active_{k}/rows", 1, m)[:, 0].astype(np.int64)
        directions = file.array(f"{_GROUP}/active_{k}/directions", "f", (None, 3))
        curve = file.array(f"{_GROUP}/active_{k}/curve", "f", (None, 2))
        if len(directions) not in (len(rows), 0) or len(curve) == 0 or (kind == MUSCLE and len(directions) == 0):
            raise file.broken("a growth or muscle has another number of directions than of tets")
        found.append(ActiveTets(kind, rows, directions, 1.0, strength, curve))
    return tuple(found)


def read_untouching(file: CheckedFile, header: dict[str, Any]) -> tuple[tuple[int, int], ...]:
    """The pairs that may pass through each other: numbers of bodies, then obstacles.

    Raises
    ------
    OutputError : where a body or obstacle does not exist.
    """
    try:
        pairs = tuple((int(i), int(j)) for i, j in header["physics"]["untouching"])
    except (KeyError, TypeError, ValueError):
        raise file.broken("the pairs that may touch are not described as they should be") from None
    owners = len(header["bodies"]) + len(header["obstacles"])
    if not all(0 <= number < owners for pair in pairs for number in pair):
        raise file.broken("what may touch names a body or obstacle that does not exist")
    return pairs


@dataclass(frozen=True, eq=False)
class RecordedWeld:
    """Vertices (k,) that are points of a rigid body; soft, rigid : numbers of the bodies."""

    soft: int
    rigid: int
    vertices: NDArray[np.int64]


def read_welds(file: CheckedFile, header: dict[str, Any], n: int) -> tuple[RecordedWeld, ...]:
    """The welds of a recording with n vertices.

    Raises
    ------
    OutputError : where a body or a vertex does not exist.
    """
    bodies = len(header["bodies"])
    try:
        described = header["physics"]["welds"]
        welds = tuple(RecordedWeld(int(a), int(b), np.array(rows, dtype=np.int64)) for a, b, rows in described)
    except (KeyError, TypeError, ValueError, OverflowError):
        raise file.broken("its welds are not described as they should be") from None
    for weld in welds:
        numbers = weld.vertices
        right = numbers.ndim == 1 and len(numbers) and numbers.min() >= 0 and numbers.max() < n
        if not (0 <= weld.soft < bodies and 0 <= weld.rigid < bodies and right):
            raise file.broken("a weld names a body or a vertex that does not exist")
    return welds
