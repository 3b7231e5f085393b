"""What Python does between the compiled stages of a substep; see `supple.solvers.xpbd.stages`.

The numbers of steps and equations are those of docs/theory/xpbd.md and docs/theory/contact.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from supple.model.energy_balance import add_works
from supple.model.system import System
from supple.solvers.xpbd.contact.admit import MOST_ROUNDS
from supple.solvers.xpbd.contact.tets import measure
from supple.solvers.xpbd.damping.kelvin_voigt import Damping
from supple.solvers.xpbd.frame.volumes import hold_volumes
from supple.solvers.xpbd.integration import first_lost, update_velocities
from supple.solvers.xpbd.moment import Substep
from supple.solvers.xpbd.momentum import restore_momenta
from supple.solvers.xpbd.record import CUT, FOUND, LATEST, LEFT, LOGGED, LOW, MOVED, ROWS, SWEEPS, share, share_touching
from supple.solvers.xpbd.stages import MOST_RIGID_SWEEPS, MOST_SWEEPS
from supple.solvers.xpbd.workspace import XPBDWorkspace


class SubstepRunner:
    """The substeps of a frame.

    Parameters
    ----------
    ws : with the state at its begin; time : of that, dt : its length [s]; count : of substeps
    damping : None where nothing is damped
    """

    def __init__(self, ws: XPBDWorkspace, time: float, dt: float, count: int, damping: Damping | None) -> None:
        self.ws, self.damping, self.h, self.count = ws, damping, dt / count, count
        self._time, self._targets = time, pin_targets(ws.system, time, self.h, count)
        self._recovered = ws.contact.recovered(dt, self.h)
        self._is_welded = len(ws.rigid.welding) > 0
        self._has_forces = damping is not None or ws.loads.push or self._is_welded
        self._has_pulls = ws.loads.pull or ws.actuators.between or self._is_welded
        self._acting = [(ws.loads.acting, False)] if ws.loads.push or ws.loads.pull else []
        self._acting += [] if damping is None else [(damping.acting, True)]
        others = ws.loads.pull, len(ws.joints) > 0, ws.actuators.within, ws.actuators.between, ws.works.held.is_needed
        self._has_works = self._has_forces or any(others)
        self.record = ws.record(self._targets, self._recovered, self.h)
        self._shared, self._stages = share(self.record), ws.stages()

    def renew(self) -> None:
        """Take the pairs of the workspace as they are, and the room for their rows."""
        touching, solving = self.ws.touching()
        self.record = self.record._replace(touching=touching, solving=solving)
        share_touching(self._shared, touching, solving)

    def run(self, k: int) -> bool:
        """Simulate substep k; returns whether all positions are known."""
        ws, h, last = self.ws, self.h, k == self.count - 1
        ws.time = self._time + (k + 1) * h
        now = ws.substep(ws.time, h)
        self._predict(now, k)  # 1, 2
        self._push(now, last)  # 3
        for stage in ws.element_stages:
            stage.begin(now.begun, now.velocities, h)
        for constraints in ws.sets:  # 4: (X1) to (X4)
            if last:
                ws.stitch_forces.project(constraints, ws.extended, h)
            else:
                constraints.project(ws.extended, h)
        ws.actuators.project_within(now)
        self._end_elastic(now)  # 5: (X5), 6
        if first_lost(ws.points, ws.velocities, len(ws.points)) >= 0:
            return False
        self._solve()  # 7: (C4), (X7)
        self._guard()  # 8: (C7)
        self._stages.account(self._shared, h)
        if self._has_works:
            self._end(now)
        return True

    def end(self) -> None:
        """Note the contact forces of the frame, and the works of loads, damping and contact."""
        ws, counts = self.ws, self.record.counts
        ws.contact.forces.end_substeps(counts[LATEST], counts[LOGGED], self.count)
        for forces, _ in self._acting:
            forces.add_works(ws.works.by_name)
        ws.works.add_contact(ws.values)

    def _predict(self, now: Substep, k: int) -> None:
        """1: lists and kept impulses; 2: prediction."""
        ws, contact, counts, h = self.ws, self.ws.contact, self.record.counts, self.h
        self._stages.begin(self._shared, h)
        contact.move_obstacles(ws.time, h)
        found = contact.renew(h)
        grown = contact.make_room_in_log(counts[LOGGED])
        if found or grown:
            counts[FOUND] |= found
            self.renew()
        contact.measure_walls()
        self._stages.predict(self._shared, k, h)
        ws.anchors.place(ws.extended, ws.origins, ws.time)

    def _push(self, now: Substep, last: bool) -> None:
        """3: forces; the last substep measures the stress that sweeps deliver."""
        ws = self.ws
        if self._has_forces:
            ws.loads.add_forces(now)
            push(ws, self.damping, self.h)  # (X6)
        elif len(ws.rigid):
            self._stages.move_rigid(self._shared, self.h)
        if last:
            ws.delivered.begin(ws.extended)

    def _end_elastic(self, now: Substep) -> None:
        """5: momenta; 6: forces between pieces."""
        ws, h, nodes = self.ws, self.h, self.record.nodes
        if ws.restores:
            restore_momenta(nodes.x, nodes.begin, nodes.v, h, *ws.momentum.arrays)
        else:
            update_velocities(nodes.x, nodes.begin, nodes.v, h, len(ws.points))
        if self._has_pulls:
            ws.loads.pull_to_targets(now)
            ws.loads.pull_springs(now)
            ws.actuators.project_between(now)
            ws.rigid.move(ws.points, ws.previous, ws.velocities, h)
        elif len(ws.rigid):
            self._stages.move_rigid(self._shared, h)

    def _solve(self) -> None:
        """7: rows of contacts and joints, and volumes."""
        nodes, tets, rows, h = self.record.nodes, self.record.tets.tets, self.record.solving.rows, self.h
        counts, values, solver = self.record.counts, self.record.values, self.ws.contact.solver
        counts[ROWS], counts[SWEEPS], values[LEFT] = 0, 0, 0.0
        if len(self.record.touching.pairs):
            self._stages.detect(self._shared, h, False)
        if len(self.ws.joints):
            solver.solve_joined(rows, counts[ROWS], self.ws.joints, h)
            values[LEFT] = solver.left
        elif counts[ROWS]:
            self._stages.solve_rows(self._shared, h, MOST_SWEEPS, MOST_RIGID_SWEEPS, True)
        counts[LOW] = measure(nodes.x, tets, True, 1.0)
        if counts[LOW]:
            hold_volumes(self.ws, self.record, self._shared, h, self._stages)

    def _guard(self) -> None:
        """8: nothing passes anything, no tet inverts."""
        contact, counts, h = self.ws.contact, self.record.counts, self.h
        # Pairs that were left out are asked again where something went farther than was expected.
        if self._stages.finish(self._shared, h):
            self._stages.detect(self._shared, h, True)
        self._cut(counts[LOW], counts[MOVED])
        if not contact or self._stages.are_covered(self._shared, h):
            return
        # Where a node has left what the lists expect of it: lists of this very motion, and the guarantee again. What
        # that cuts may have left its place, too.
        cut = counts[CUT]
        for _ in range(MOST_ROUNDS):
            off = contact.lists.search_again(contact.nodes.begin, contact.nodes.x, h, contact.frames[0])
            contact.make_room()
            self.renew()
            self.record.nodes.far[:] = off
            if len(self.record.touching.pairs):
                contact.measure_walls()
                self._stages.choose_again(self._shared)
                self._stages.detect(self._shared, h, True)
                self._cut(0, 0)
                cut += counts[CUT]
            contact.lists.tight.clock[0] += h
            contact.lists.measure(contact.nodes.x)
            if contact.lists.hold:
                break
        counts[CUT] = cut

    def _cut(self, low: int, moved: int) -> None:
        """8: cut motions, and give back what that takes from them; see `stages`."""
        counts = self.record.counts
        self._stages.cut(self._shared, low, moved)
        if counts[CUT]:
            self.ws.contact.give_back(counts[ROWS], counts[CUT], self.record.nodes.base)

    def _end(self, now: Substep) -> None:
        """Add up what forces did in a substep."""
        ws = self.ws
        if len(ws.joints):
            add_works(ws.works.by_name, {"joints": ws.joints.end_substep(ws.points, ws.previous, self.h)})
        ws.actuators.end_substep(now)
        more, counts = (ws.actuators.add_forces, ws.joints.add_forces), self.record.counts
        logged = int(counts[LATEST]), int(counts[LOGGED])
        ws.works.end_substep(now, self._acting, ws.contact, logged, ws.extended, more)


def pin_targets(system: System, time: float, h: float, substeps: int) -> NDArray[np.float64]:
    """(substeps, k, 3) positions of the pinned vertices at the end of each substep [m]."""
    if all(pin.pin.motion is None for pin in system.pins):
        return np.repeat(system.pin_targets(time)[None], substeps, axis=0)
    return np.stack([system.pin_targets(time + (k + 1) * h) for k in range(substeps)])


def push(ws: XPBDWorkspace, damping: Damping | None, h: float) -> None:
    """Apply viscous forces to the prediction."""
    if damping is not None:
        damping.push(ws.points, h)
    welded = ws.rigid.welding.vertices
    internal = (ws.points[welded, :3] - ws.previous[welded]) / h - ws.velocities[welded]
    ws.rigid.move(ws.points, ws.previous, ws.velocities, h)
    if len(welded):
        # Constraints use welded vertices at the places that their bodies will have. Momenta are restored to those
        # without internal forces, of which bodies have their part already.
        ws.velocities[welded] -= internal
