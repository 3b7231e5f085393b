"""Velocities that agree with joints, at the start and the ends of steps of the midpoint rule.

The rule gives a coordinate that has to move with a mean rate r in a step the rate 2 r - q' at its end: it bounces off
limits, and alternates about the rate of a motor; so does what a start gives a joint against its conditions. There, the
velocities are replaced by those that agree with all conditions and with the rates of limits, dry friction and velocity
motors that act, and are nearest in the norm of kinetic energy: an inelastic impact. Its impulses act along gradients of
conditions, so that it keeps both momenta. Pieces in which nothing of this kind acts keep the velocities of the rule,
and with them their energy.

Source: Moreau, "Unilateral contact and dry friction in finite freedom dynamics" (1988), for inelastic impacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_array, csc_array, csr_array, eye_array
from scipy.sparse.linalg import splu

from supple.model.joints.laws import Law, Laws
from supple.solvers.implicit.joints.potential import JointPotential
from supple.solvers.implicit.joints.rigidity import Rigidity

# Of the mean of the diagonal: conditions may repeat each other.
_REPEATED = 1e-11

# Of a symmetric matrix (3, 3).
_COMPONENTS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def stop_at_laws(
    potential: JointPotential, rigidity: Rigidity, x: NDArray[np.float64], velocities: NDArray[np.float64], begin: float
) -> tuple[JointPotential, float] | None:
    """Where laws act at the end x (n, 3) of a step from `begin` [s], give their pieces rates that agree, in place.

    `potential` has the multipliers that were found in the step. Returned is the potential whose forces at x have the
    impulses of this change within the step, and their work [J].
    """
    geometry, laws, efforts = potential.geometry, potential.laws, potential.law_multipliers
    acting = (efforts > laws.low) & (efforts < laws.high) & ~np.isin(laws.function, geometry.across)
    if not acting.any() or not len(rigidity.corners):
        return None
    rates = dict(zip(laws.function[acting].tolist(), laws.rate[acting].tolist(), strict=True))
    corners = geometry.corners[geometry.arguments[0].joint[list(rates)], 0]
    pieces = np.unique(geometry.system.joined_components[corners])
    of_functions, of_differences, work = agree(potential, rigidity, x, velocities, begin, rates, pieces)
    h = potential.time - begin
    # A motor is the last law of its function, whose impulse it has where it acts.
    motors = laws.function[acting & laws.is_motor].tolist()
    made, efforts = Laws.of(
        [
            Law(row, 0.0, 0.0, multiplier=-impulse / h, adapts=False, is_motor=row in motors)
            for row, impulse in of_functions.items()
        ]
    )
    changed = {"laws": made, "law_multipliers": efforts, "multipliers": -of_differences / h}
    return replace(potential, stiffness=np.zeros_like(potential.stiffness), **changed), work


def agree(
    potential: JointPotential,
    rigidity: Rigidity,
    x: NDArray[np.float64],
    velocities: NDArray[np.float64],
    begin: float,
    rates: dict[int, float],
    pieces: NDArray[np.int32],
) -> tuple[dict[int, float], NDArray[np.float64], float]:
    """Give some pieces of the system velocities (n, 3) that agree with their joints at x (n, 3), in place.

    Returned are the impulses by the functions of the joints and of the differences (f, 3) [N s], and their work [J].

    Parameters
    ----------
    rates : of functions of the joints, by number; those across sliders have the rate zero
    begin : since when obstacles have the velocities that they have now [s]
    """
    geometry, linear = potential.geometry, potential.geometry.differences
    earlier = replace(potential, time=begin)
    h = potential.time - begin
    rows = np.array([*rates, *geometry.across], dtype=np.int64)
    joint = geometry.arguments[0].joint[rows]
    wanted = np.array([*rates.values()] + [0.0] * len(geometry.across))
    wanted -= ((potential.coordinates(x) - earlier.coordinates(x)) / h)[rows]
    apart = (earlier.differences(x) - potential.differences(x)) / h
    groups = [(geometry.corners[joint], potential.gradients_of_functions(x)[rows], wanted)]
    for axis, along in zip(np.eye(3), apart.T, strict=True):
        groups.append((geometry.corners[linear.joint], linear.coefficients[:, :, None] * axis, along))
    for a, b in _COMPONENTS:
        groups.append((rigidity.corners, rigidity.gradients(x, a, b), np.zeros(len(rigidity.corners))))
    owner = geometry.system.joined_components
    impulses = [np.zeros(len(of)) for of, _, _ in groups]
    kept = [np.isin(owner[corners[:, 0]], pieces) for corners, _, _ in groups]
    groups = [(of[keep], by[keep], to[keep]) for (of, by, to), keep in zip(groups, kept, strict=True)]

    free = rigidity.corners.ravel()
    column = np.full(len(x), -1)
    column[free] = np.arange(len(free))
    G = _matrix(groups, column, len(free))
    now = [np.einsum("cki,cki->c", gradients, velocities[corners]) for corners, gradients, _ in groups]
    change = np.concatenate([rate for _, _, rate in groups]) - np.concatenate(now)
    blocks = np.einsum("bkl,ij->bkilj", rigidity.inverse_masses, np.eye(3)).reshape(-1, 12, 12)
    inverse = bsr_array((blocks, np.arange(len(blocks)), np.arange(len(blocks) + 1)))
    S = csc_array(G @ inverse @ G.T)
    S = csc_array(S + _REPEATED * S.diagonal().mean() * eye_array(len(change)))
    solved = splu(S).solve(change)
    velocities[free] += (inverse @ (G.T @ solved)).reshape(-1, 3)
    ends = np.cumsum([len(rate) for rate in now])[:-1]
    for all_of, keep, some in zip(impulses, kept, np.split(solved, ends), strict=True):
        all_of[keep] = some
    of_functions = dict(zip(rows.tolist(), impulses[0].tolist(), strict=True))
    work = float(solved @ (np.concatenate(now) + 0.5 * change))
    return of_functions, np.stack(impulses[1:4], axis=1), work


def _matrix(
    groups: Sequence[tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]],
    column: NDArray[np.int64],
    count: int,
) -> csr_array:
    """(c, 3 count) of gradients (., p, 3) by vertices (., p), which have places among the `count` free ones, or -1."""
    rows, columns, values = [], [], []
    begin = 0
    for corners, gradients, _ in groups:
        places = column[corners]
        row, k = np.nonzero(places >= 0)
        rows.append(np.repeat(begin + row, 3))
        columns.append((3 * places[row, k][:, None] + np.arange(3)).ravel())
        values.append(gradients[row, k].ravel())
        begin += len(corners)
    ends = np.concatenate(rows), np.concatenate(columns)
    return csr_array((np.concatenate(values), ends), shape=(begin, 3 * count))
