"""The trial solver: `XPBD` with contact by rows and one guarantee. Private: tests and benchmarks alone use it.

Scenes of soft and rigid bodies, half-spaces, rooms, triangle obstacles, pins, stitches and joints (which are solved
before the rows, once a substep); nothing sleeps, and contact forces are not reported. See notes/xpbd_rows.md.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from supple.model.actuator_readings import actuator_fields, start_of
from supple.model.state import State, Status, StepReport
from supple.model.system import System
from supple.solvers.xpbd.assessment.findings import Findings, count_inverted
from supple.solvers.xpbd.details import XPBDDetails
from supple.solvers.xpbd.frame.advance import cycles, damping_in, grow, pin_targets
from supple.solvers.xpbd.integration import first_lost
from supple.solvers.xpbd.memory import XPBDMemory
from supple.solvers.xpbd.solver import XPBD, lost_position_message
from supple.solvers.xpbd.workspace import XPBDWorkspace
from trials.xpbd_rows.contact import RowContact, RowCounts
from trials.xpbd_rows.substep import substep


@dataclass(eq=False)
class RowWorkspace(XPBDWorkspace):
    """The workspace of XPBD, with its contact; `counts` of the latest frame."""

    rows: RowContact | None = None
    latest: State | None = None

    @property
    def counts(self) -> RowCounts:
        assert self.rows is not None
        return self.rows.counts


@dataclass(frozen=True)
class RowsXPBD(XPBD):
    """See the module. Parameters are those of `XPBD`."""

    threads: int | None = 1
    sleep_after: float | None = None
    workspaces: list[RowWorkspace] = field(default_factory=list, repr=False, compare=False)

    def prepare(self, system: System) -> RowWorkspace:
        """See `XPBD.prepare`."""
        plain = super().prepare(system)
        names = [each for each in XPBDWorkspace.__dataclass_fields__ if XPBDWorkspace.__dataclass_fields__[each].init]
        values: dict[str, Any] = {name: getattr(plain, name) for name in names}
        ws = RowWorkspace(**values)
        ws.rows = RowContact(ws, self.contact)
        self.workspaces.append(ws)
        return ws

    def _step(self, system: System, state: State, dt: float, ws: XPBDWorkspace) -> tuple[State, StepReport]:
        assert isinstance(ws, RowWorkspace)
        assert ws.rows is not None
        time, memory = state.time + dt, state.memory if isinstance(state.memory, XPBDMemory) else XPBDMemory()
        _load(ws, state)
        if state is not ws.latest:
            ws.rows.lists.forget()
        used = self._first_choice(ws, state, dt, memory)
        h = dt / used.count
        ws.begin_frame(state.time, h)
        ws.joints.begin_frame(state, np.zeros(len(ws.system.bodies), dtype=np.bool_))
        ws.rows.begin_frame(state.time, dt, ws.origins[0].copy())
        targets, lengths = pin_targets(ws.system, state.time, h, used.count), cycles(used.count)
        damping = damping_in(ws, h)
        if damping is not None:
            damping.begin_step(memory.viscous, state.velocities)
        for k in range(used.count):
            end = state.time + (k + 1) * h
            if damping is not None and k in lengths:
                moving = ws.anchors.velocities(end - h, h)
                damping.begin_cycle(ws.extended, ws.velocities, moving, lengths[k], h)
            grow(ws, end)
            substep(ws, ws.rows, damping, targets[k], end, h)
            if first_lost(ws.points, ws.velocities) >= 0:
                break
        lost = first_lost(ws.points, ws.velocities)
        if lost >= 0:
            message = lost_position_message(ws.system, ws.layout, lost, time)
            return state, StepReport(Status.NOT_FINITE, used.count, message, details=self.initial_details(system, ws))
        return self._end(ws, time, h, used.count, memory, damping)

    def _end(self, ws: RowWorkspace, time: float, h: float, count: int, before: XPBDMemory, damping: Any) -> Any:
        assert ws.rows is not None
        counts, new = ws.rows.counts, ws.layout.new_from_old
        x, v = (ws.points[:, :3] + ws.origins)[new], ws.velocities[new]
        J = ws.rows.tets.now
        softening = ws.assessment.softening
        measured = softening.own(before.measured)
        shares = softening.by_body(h, measured)
        asleep = np.zeros(len(ws.system.bodies), dtype=np.bool_)
        ws.world[:] = ws.points[:, :3] + ws.origins
        findings = Findings(
            inverted=count_inverted(ws.system, J, ws.rows.tangled),
            overlaps=ws.assessment.overlaps(ws.world, time, asleep) if counts.crushed else [],
            held=counts.cut / count,
            softened=[(share, name) for name, share in shares.items() if share > self.accuracy],
        )
        memory = XPBDMemory(viscous=None if damping is None else damping.memory(v), measured=measured)
        details = replace(
            self.initial_details(ws.system, ws), contacts=counts.rows // count, substeps=count, softening=shares,
            held_back=counts.cut,
        )  # fmt: skip
        message = findings.message(time, f"take substeps={2 * count}")
        state = State(time, x, v, memory=memory)
        ws.latest = state
        return state, StepReport(findings.status, count, message, details=details)

    def initial_details(self, system: System, workspace: XPBDWorkspace) -> XPBDDetails:
        """See `Solver.initial_details`."""
        names = [part.name for part in system.bodies]
        return XPBDDetails(
            softening=dict.fromkeys(names, 0.0),
            asleep=dict.fromkeys(names, False),
            **actuator_fields(system, *start_of(system)),
        )


def _load(ws: XPBDWorkspace, state: State) -> None:
    """Copy a state into the arrays of the workspace, about one origin near the middle of the scene."""
    old = ws.layout.old_from_new
    x = state.positions[old]
    ws.time = state.time
    # Whole multiples of 1/1024 m: differences with positions within 8,000 km of it are exact.
    ws.origins[:] = np.round(x.mean(axis=0) * 1024.0) / 1024.0
    ws.points[:, :3] = x - ws.origins
    ws.rigid.place(ws.points[:, :3])
    ws.velocities[:] = state.velocities[old]
    ws.anchors.place(ws.extended, ws.origins, state.time)
    ws.grow(state.time)
