"""What a recording keeps of its scene for `supple check`: laws of the bodies, loads, and pairs that may touch.

Recordings from before version 0.1 do not have it; checks that need it are skipped.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from supple.materials.edges_and_volume import EdgesAndVolume
from supple.materials.material import Elastic
from supple.materials.per_tet import NO_REGION
from supple.materials.registry import ELASTIC_MATERIALS
from supple.output.recording.checked_hdf5 import CheckedFile
from supple.scene.contact_pairs import pair_table
from supple.system import System

NOT_KNOWN = 255
_GROUP = "supple/physics"


@dataclass(frozen=True, eq=False)
class RecordedPhysics:
    """The laws of a recorded scene.

    Attributes
    ----------
    region : (m,) the region over whose patches the energy of a tet is averaged, or `NO_REGION`
    kind : (m,) row of `registry.ELASTIC_MATERIALS` of each tet, or `NOT_KNOWN`; mu, lam : (m,) [Pa]
    compliances : for each body those of its edges [m/N] and volumes [m^5/N], or None for a body of another law
    forces, soft_targets, scripted_pins, stitches : numbers of them in the scene
    """

    kind: NDArray[np.uint8]
    mu: NDArray[np.float64]
    lam: NDArray[np.float64]
    compliances: tuple[tuple[float, float] | None, ...]
    forces: int
    soft_targets: int
    scripted_pins: int
    stitches: int
    region: NDArray[np.int32]

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
        elif isinstance(material, Elastic):
            rows = material.per_tet(part.tets.stop - part.tets.start)
            kind[part.tets], mu[part.tets], lam[part.tets] = rows.kind, rows.mu, rows.lam
            region[part.tets] = rows.region
    group = own.create_group("physics")
    group["kind"], group["mu"], group["lam"] = kind, mu, lam
    if (region != NO_REGION).any():
        group["region"] = region
    return {
        "laws": [law.__name__ for law in ELASTIC_MATERIALS],
        "compliances": compliances,
        "forces": len(system.loads) + sum(each.coordinate.is_anchored for each in system.actuators),
        "soft_targets": len(system.soft_targets),
        "scripted_pins": sum(part.pin.motion is not None for part in system.pins),
        "stitches": len(system.stitching),
        "patches": bool((region != NO_REGION).any()),
        "untouching": _untouching(system),
    }


def _untouching(system: System) -> list[list[int]]:
    """Pairs that the scene lets pass through each other: numbers of bodies, then obstacles."""
    collide = pair_table(system.scene).collide
    obstacle = np.arange(len(collide)) >= len(system.bodies)
    passing = np.argwhere(np.triu(~collide & ~(obstacle[:, None] & obstacle[None, :])))
    return passing.tolist()


def read_physics(file: CheckedFile, header: dict[str, Any], m: int) -> RecordedPhysics | None:
    """The laws of a recording with m tets, or None where it does not contain them.

    Raises
    ------
    OutputError : where the data are contradictory.
    """
    physics = header.get("physics")
    if physics is None:
        return None
    try:
        counts = [int(physics[key]) for key in ("forces", "soft_targets", "scripted_pins", "stitches")]
        laws = [str(law) for law in physics["laws"]]
        compliances = tuple(
            None if pair is None else (float(pair[0]), float(pair[1])) for pair in physics["compliances"]
        )
    except (KeyError, TypeError, ValueError, IndexError):
        raise file.broken("the physics in its header is not described as it should be") from None
    if len(compliances) != len(header["bodies"]):
        raise file.broken("its header describes the physics of another number of bodies")
    here = [law.__name__ for law in ELASTIC_MATERIALS]
    number = np.full(256, NOT_KNOWN, dtype=np.uint8)
    for k, law in enumerate(laws[:NOT_KNOWN]):
        number[k] = here.index(law) if law in here else NOT_KNOWN
    kind = number[file.array(f"{_GROUP}/kind", "u", (m,)).astype(np.uint8)]
    mu, lam = file.array(f"{_GROUP}/mu", "f", (m,)), file.array(f"{_GROUP}/lam", "f", (m,))
    region = np.full(m, NO_REGION, dtype=np.int32)
    if physics.get("patches", False):
        region = file.array(f"{_GROUP}/region", "i", (m,)).astype(np.int32)
    return RecordedPhysics(kind, mu, lam, compliances, *counts, region=region)


def read_untouching(file: CheckedFile, header: dict[str, Any]) -> tuple[tuple[int, int], ...]:
    """The pairs that may pass through each other: numbers of bodies, then obstacles.

    Raises
    ------
    OutputError : where a body or obstacle does not exist.
    """
    if header.get("physics") is None:
        return ()
    try:
        pairs = tuple((int(i), int(j)) for i, j in header["physics"]["untouching"])
    except (KeyError, TypeError, ValueError):
        raise file.broken("the pairs that may touch are not described as they should be") from None
    owners = len(header["bodies"]) + len(header["obstacles"])
    if not all(0 <= number < owners for pair in pairs for number in pair):
        raise file.broken("what may touch names a body or obstacle that does not exist")
    return pairs
