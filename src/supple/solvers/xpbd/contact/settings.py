"""User settings for contact of bodies with each other and with themselves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.kinds.kind import Kind
from supple.kinds.validators import POSITIVE, Boolean
from supple.model.system import System
from supple.scene.contact_pairs import pair_table


@dataclass(frozen=True)
class XPBDContact(Kind):
    """Contact of surfaces in XPBD. Obstacles always act.

    Parameters
    ----------
    thickness : gap that surfaces keep [m], a hundredth of it from half-spaces and rooms. None: of each side at each
        place the smallest of 0.003 of its diagonal, a twentieth of its mean surface edge, and a twentieth of its
        thickness there; of two sides the smaller one. What begins nearer keeps that distance.
    body_collision : whether bodies collide with each other.
    self_collision : whether a body collides with itself.

    Raises
    ------
    SolverError : where a value is of the wrong kind or out of range.
    """

    kind: ClassVar[str] = "xpbd_contact"
    title: ClassVar[str] = "XPBDContact"
    error = SolverError

    thickness: Annotated[float | None, POSITIVE] = None
    body_collision: Annotated[bool, Boolean()] = True
    self_collision: Annotated[bool, Boolean()] = True


def colliding_pairs(system: System, settings: XPBDContact | None, joined: bool = False) -> NDArray[np.bool_]:
    """(p, p) which things must stay apart: bodies, then obstacles, without those that are stitched or welded.

    joined : with bodies that are stitched or welded to each other
    """
    bodies = len(system.bodies)
    collide = pair_table(system.scene).collide.copy()
    if settings is None or not settings.body_collision:
        collide[:bodies, :bodies] &= np.eye(bodies, dtype=np.bool_)
    if settings is None or not settings.self_collision:
        collide[np.arange(bodies), np.arange(bodies)] = False
    names = [part.name for part in system.bodies] + [str(obstacle.name) for obstacle in system.obstacles]
    joints = [(stitch.first, stitch.second) for stitch in system.stitching.seamed]
    for first, second in [*joints, *((weld.body, weld.rigid) for weld in system.scene.welds)]:
        a, b = names.index(first), names.index(second)
        if not joined or max(a, b) >= bodies:
            collide[a, b] = collide[b, a] = False
    return collide
