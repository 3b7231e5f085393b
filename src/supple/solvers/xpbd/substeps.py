"""How many substeps a frame needs, found before it is simulated.

The largest of:

- what keeps every body's stiffness within the accuracy, as measured in the frame before (`assessment.softening`);
- what lets surfaces approach each other by less than half the mean height of a tet in a substep: contact may not find
  surfaces that pass each other within one substep, and the guard of volumes stops a compression by less than that;
- what lets rigid bodies turn by less than a tenth of a radian in a substep;
- what lets rigid bodies fall from rest by less than a small part of the height of their tets in a substep;
- what lets a heavy body sink little into what is below a light rigid one between them: the light one passes on about
  m / M of the load in each pass, and the separation of the others lifts the heavy one;
- after a frame that had to be repeated with more substeps: a number that falls back from there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from supple.model.system import System
from supple.scene.rod import Rod
from supple.scene.shell import Shell
from supple.solvers.xpbd.assessment.softening import MeasuredWork, Softening
from supple.solvers.xpbd.moment import Moment
from supple.solvers.xpbd.rigid.bodies import RigidBodies

# Fewer substeps damp slow oscillations too much: a mode of frequency w decays at h w^2 / 2.
FEWEST = 10
# Rigid bodies alone have no such modes.
FEWEST_RIGID = 7
# Of the mean height of a tet: how far surfaces may approach each other in a substep.
APPROACH = 0.5
# By how much a rigid body may turn in a substep [rad]; see `supple.solvers.xpbd.rigid.bodies`.
MOST_TURN = 0.1
# Largest r g h^2 / H in a substep h, with the ratio r of the masses of a body and of a lighter rigid one near it, and
# the mean height H of a tet; and the ratio above which this is required. See docs/theory/rigid_bodies.md.
MOST_SINKING, LEAST_RATIO = 1.5e-4, 4.0
# Largest g h^2 / H, with the height H of the smallest rigid body's tet: a stack that sinks farther into itself at an
# impact gains energy when it is separated again. See notes/measured_trials.md.
MOST_FALL = 3e-3
# By which a number from an earlier frame falls in every frame.
FALL = 0.8
# How many times the number of the other criteria it may be: a blow that lasts for some frames must not raise it to any
# height.
MOST_KEPT = 4


class Substeps(NamedTuple):
    """A number of substeps, and the reason for it."""

    count: int
    reason: str


class SubstepChoice:
    """What is needed to choose the number of substeps for a system.

    Parameters
    ----------
    system : in the solver's numbering; softening : of its bodies; touches : whether there is any contact
    rigid : its rigid bodies
    """

    def __init__(self, system: System, softening: Softening, touches: bool, rigid: RigidBodies) -> None:
        self.system, self.softening, self.touches, self.rigid = system, softening, touches, rigid
        Dm_inv = system.rest_shape_inverse
        b = np.concatenate([-Dm_inv.sum(axis=1, keepdims=True), Dm_inv], axis=1)
        heights = 1.0 / np.linalg.norm(b, axis=2).max(axis=1)
        shells, of_bodies = system.shells, [0.0] * len(system.bodies)
        for k, part in enumerate(system.bodies):
            if shells is not None and isinstance(part.body, Shell):
                own = shells.gradients[shells.rows_of(part.vertices)]
                of_bodies[k] = float((1.0 / np.linalg.norm(own, axis=2).max(axis=1)).mean())
            elif system.rods is not None and isinstance(part.body, Rod):
                of_bodies[k] = float(system.rods.lengths[system.rods.rows_of(part.vertices)].mean())
            else:
                of_bodies[k] = float(heights[part.tets].mean())
        self.height = min(of_bodies)
        self._smallest = min((of_bodies[k] for k in rigid.numbers[~rigid.held]), default=math.inf)
        free = np.where(
            system.inverse_masses > 0.0, system.masses, 0.0
        )  # what pins hold is heavy, and rests on nothing
        self._masses = np.array([free[part.vertices].sum() for part in system.bodies])
        heaviest = self._masses.max(initial=0.0)
        self._light = rigid.numbers[~rigid.held & (self._masses[rigid.numbers] * LEAST_RATIO < heaviest)]
        scene = system.scene
        swings = len(rigid) < len(system.bodies) or scene.joints or scene.stitches or scene.forces or system.actuators
        self._fewest = FEWEST if swings else FEWEST_RIGID
        self._begins = [part.points.start for part in system.bodies]

    def choose(
        self, moment: Moment, dt: float, accuracy: float, earlier: float, measured: MeasuredWork | None
    ) -> Substeps:
        """The number of substeps for a frame that begins at a moment.

        Parameters
        ----------
        dt : length of the frame [s]; accuracy : how much of its stiffness a body may lack
        earlier : what the frame before asks for, zero or more
        measured : by the frames before; None at the start
        """
        stiff, body = self.softening.substeps(dt, accuracy, measured)
        reach = self._closing_speed(moment, dt) * dt if self.touches else 0.0
        found = max(
            Substeps(self._fewest, "the least number"),
            Substeps(stiff, f"the stiffness of body {body!r}"),
            Substeps(_count(reach / (APPROACH * self.height)), "the speed of approach"),
            self._for_spins(moment, dt),
            self._for_falls(dt),
            self._for_masses(moment, dt, reach),
            key=lambda each: each.count,
        )
        kept = min(math.ceil(FALL * earlier), MOST_KEPT * found.count)
        return found if found.count >= kept else Substeps(kept, "the frame before")

    def _for_spins(self, moment: Moment, dt: float) -> Substeps:
        if not len(self.rigid):
            return Substeps(0, "")
        spins = self.rigid.spins(moment.points[:, :3], moment.velocities)
        fastest = int(spins.argmax())
        return Substeps(
            _count(float(spins[fastest]) * dt / MOST_TURN), f"the spin of body {self.rigid.names[fastest]!r}"
        )

    def _for_falls(self, dt: float) -> Substeps:
        fall = math.hypot(*self.system.gravity) * dt**2 if self.touches else 0.0
        return Substeps(_count(math.sqrt(fall / self._smallest / MOST_FALL)), "the weight of small rigid bodies")

    def _for_masses(self, moment: Moment, dt: float, reach: float) -> Substeps:
        """For heavy bodies on light rigid ones, where surfaces may approach each other by `reach` [m]."""
        if not self.touches or not len(self._light):
            return Substeps(0, "")
        x = self.system.points.positions(moment.points[:, :3] + moment.origins)
        margin = 0.5 * reach + APPROACH * self.height
        low, high = np.minimum.reduceat(x, self._begins) - margin, np.maximum.reduceat(x, self._begins) + margin
        light = self._light[:, None]
        near = ((low[light] <= high) & (low <= high[light])).all(axis=2)
        ratios = np.where(near, self._masses / self._masses[light], 0.0).max(axis=1)
        worst = int(ratios.argmax())
        sinking = ratios[worst] * math.hypot(*self.system.gravity) * dt**2 / self.height
        count = _count(math.sqrt(sinking / MOST_SINKING)) if ratios[worst] > LEAST_RATIO else 0
        name = self.system.bodies[self._light[worst]].name
        return Substeps(count, f"a body {ratios[worst]:.3g} times as heavy as {name!r}")

    def _closing_speed(self, moment: Moment, dt: float) -> float:
        """An upper bound of the speed at which surfaces approach each other in the frame [m/s]."""
        v = self.system.points.positions(moment.velocities)
        falling = math.hypot(*self.system.gravity) * dt
        fastest = 0.0
        if self.system.obstacles:
            fastest = float(np.sqrt(np.einsum("ij,ij->i", v, v).max())) + self._obstacle_speed(moment, dt) + falling
        if len(self.system.bodies) > 1:
            relative = v - (self.system.masses @ moment.velocities) / self.system.masses.sum()
            fastest = max(fastest, 2.0 * float(np.sqrt(np.einsum("ij,ij->i", relative, relative).max())))
        return fastest

    def _obstacle_speed(self, moment: Moment, dt: float) -> float:
        """The largest mean speed of an obstacle over the frame, at the corners of the box about all bodies [m/s]."""
        moving = [obstacle for obstacle in self.system.obstacles if obstacle.motion is not None]
        if not moving:
            return 0.0
        x = moment.points[:, :3] + moment.origins
        low, high = x.min(axis=0), x.max(axis=0)
        corners = np.array([[(low, high)[k >> a & 1][a] for a in range(3)] for k in range(8)])
        ends = [obstacle.carried(corners, moment.time, moment.time + dt) for obstacle in moving]
        return max(float(np.linalg.norm(end - corners, axis=1).max()) for end in ends) / dt


def _count(number: float) -> int:
    return math.ceil(number) if math.isfinite(number) else 0
