"""Which bodies and obstacles may touch, and with how much friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class PairTable:
    """(p, p) arrays over bodies, and after them obstacles."""

    collide: NDArray[np.bool_]
    friction: NDArray[np.float64]


def pair_table(scene: Scene) -> PairTable:
    """An obstacle's coefficient holds for all bodies; two bodies have the geometric mean of theirs."""
    mu = np.array([part.friction for part in (*scene.bodies, *scene.obstacles)])
    body = np.arange(len(mu)) < len(scene.bodies)
    both = body[:, None] & body[None, :]
    one = body[:, None] | body[None, :]
    with_obstacle = np.where(body[:, None], mu[None, :], mu[:, None])
    friction = np.where(both, np.sqrt(np.outer(mu, mu)), with_obstacle)
    return PairTable(one, np.where(one, friction, 0.0))
