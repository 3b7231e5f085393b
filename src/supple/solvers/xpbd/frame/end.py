"""The end of a frame: what it showed, its report, and the state with what later frames must know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from supple.model.pin_reactions import pin_labels
from supple.model.state import State, Status, StepReport
from supple.model.system import System
from supple.solvers.xpbd.assessment.findings import HELD_TOLERANCE, Findings
from supple.solvers.xpbd.assessment.softening import enough
from supple.solvers.xpbd.assessment.surfaces import Overlap, crossings
from supple.solvers.xpbd.details import XPBDDetails
from supple.solvers.xpbd.frame.advance import damping_in, overlaps_after
from supple.solvers.xpbd.integration import to_world
from supple.solvers.xpbd.memory import ElementMemory, XPBDMemory
from supple.solvers.xpbd.record import CUTS, RESIDUAL, SMALLEST
from supple.solvers.xpbd.sleep import SleepMemory
from supple.solvers.xpbd.substeps import FALL, Substeps
from supple.solvers.xpbd.workspace import XPBDWorkspace

Forces = Mapping[str, NDArray[np.float64]]

# From this number of substeps, the remedy is another solver or a rigid body.
IMPRACTICAL = 5000


def end_frame(
    ws: XPBDWorkspace,
    time: float,
    dt: float,
    used: Substeps,
    repeats: int,
    before: XPBDMemory,
    overlaps: list[Overlap],
    sleep: SleepMemory,
    accuracy: float,
    setting: str,
) -> tuple[State, StepReport, Status | None]:
    """The state at the end of a frame, its report, and the status that more substeps might cure.

    Parameters
    ----------
    time : at the end [s]
    used : substeps of the frame; repeats : how often it was repeated; before : of the frame before
    overlaps, sleep : as the frame began with them; accuracy : how much stiffness a body may lack
    setting : the solver's parameter that more substeps need
    """
    h = dt / used.count
    to_world(ws.points, ws.origins, ws.world)
    ws.world[ws.system.pinned_vertices] = ws.system.pin_targets(time)
    held_back = int(ws.counts[CUTS])
    ws.works.end_frame(ws.velocities, ws.actuators.works(), dt)
    held, works = held_back / used.count, ws.works.by_name
    softening = ws.assessment.softening
    delivered = ws.delivered.end(ws.points, h)
    measured = softening.after(softening.own(before.measured), delivered, h, sleep.asleep, ws.points)
    shares = softening.by_body(h, measured)
    findings, ledger = ws.assessment.end(
        ws.moment(time),
        overlaps_after(ws, time, sleep),
        ws.contact.tets.now,
        h,
        accuracy,
        held,
        sleep.asleep,
        works,
        ws.works.residual,
        measured,
    )
    joints = {"apart": ws.joints.apart(ws.world, time, accuracy), "stalled": ws.joints.stalled(accuracy)}
    findings = replace(findings, **joints)
    status = findings.status
    problem = status if status in (Status.INVERTED, Status.ENERGY_GAINED) else None
    if crossings(findings.overlaps) > crossings(overlaps):
        problem = Status.INTERSECTING
    elif problem is None and held > HELD_TOLERANCE:
        problem = Status.INVERTED
    elif problem is None and findings.crushed:
        problem = Status.CRUSHED
    elif problem is None and (findings.softened or findings.apart):
        problem = Status.SOFTENED
    ws.contact.forces.end_frame()
    forces, old_points = ws.contact.forces, ws.layout.old_points
    x, v = ws.world[ws.layout.new_from_old], ws.velocities[ws.layout.new_from_old]
    sound = status in (Status.CONVERGED, Status.SOFTENED) and held <= HELD_TOLERANCE
    rest = ws.sleep.end(x, v, time, sleep, forces, sound)
    damping = damping_in(ws, h)
    memory = XPBDMemory(
        contact=ws.contact.memory(x, h),
        viscous=None if damping is None else damping.memory(v),
        elements=ElementMemory(x, tuple(each.memory() for each in ws.element_stages)) if ws.element_stages else None,
        ledger=ledger,
        measured=measured,
        substeps=float(used.count) if repeats else FALL * before.substeps,
        sleep=rest,
        futile=frozenset() if problem is None else before.futile | ({problem} if repeats else set()),
    )
    pushes, friction = forces.by_name()
    details = XPBDDetails(
        contacts=len(forces.latest.keys) + len(forces.standing.keys),
        smallest_gap=float(ws.values[SMALLEST]) if np.isfinite(ws.values[SMALLEST]) else None,
        substeps=used.count,
        repeats=repeats,
        substeps_reason=used.reason,
        softening=shares,
        energy_gained=findings.gained,
        truncated=held_back,
        contact_residual=float(ws.values[RESIDUAL]),
        asleep={part.name: bool(rests) for part, rests in zip(ws.system.bodies, sleep.asleep, strict=True)},
        contact_forces=pushes,
        friction_forces=friction,
        weld_forces=ws.welded.forces(ws.rigid, ws.velocities, ws.works.held.impulses(len(v)), dt),
        **ws.actuators.fields(h * used.count),
        **ws.joints.fields(ws.world, time),
        reaction_forces=ws.works.held.reactions,
        work=works,
        energy_residual=ws.works.residual,
    )
    details = replace(details, **_at_rest(ws.system, details, sleep, before.at_rest))
    if rest.asleep.any():
        memory = replace(memory, at_rest=_at_rest(ws.system, details, rest))
    places = ws.contact.places()
    message = ""
    if status is not Status.CONVERGED:
        message = findings.message(time, _remedy(findings, used.count, shares, accuracy, setting))
    report = StepReport(
        status,
        used.count,
        message,
        details=details,
        contacts=lambda: forces.contact_points(places, old_points),
    )
    return State(time, x, v, memory=memory, hinge_angles=ws.joints.hinge_angles()), report, problem


def _at_rest(
    system: System, details: XPBDDetails, sleep: SleepMemory, known: Mapping[str, Forces] | None = None
) -> dict[str, Forces]:
    """The forces of joints, welds and pins of a frame, by the name of their field: of bodies at rest those `known`.

    Without these, only those of bodies at rest.
    """
    if not sleep.asleep.any():
        return {}
    bodies = {part.name for part, rests in zip(system.bodies, sleep.asleep, strict=True) if rests}
    joints = [str(joint.name) for joint in system.scene.joints if joint.first in bodies]
    welds = [str(weld.name) for weld in system.scene.welds if weld.body in bodies]
    pins = [label for label, pin in zip(pin_labels(system), system.pins, strict=True) if pin.pin.body in bodies]
    found = {}
    for field, names in {
        "joint_forces": joints,
        "joint_torques": joints,
        "weld_forces": welds,
        "reaction_forces": pins,
    }.items():
        now = getattr(details, field)
        names = [name for name in names if name in now]
        if known is None:
            found[field] = {name: now[name] for name in names}
        else:
            found[field] = {**now, **{name: known[field][name] for name in names if name in known.get(field, {})}}
    return found


def _remedy(findings: Findings, used: int, shares: Mapping[str, float], accuracy: float, setting: str) -> str:
    """The remedy for the findings."""
    count = enough(used, shares, accuracy)
    contradicted = bool(findings.apart or findings.stalled)
    if findings.status is not Status.SOFTENED or contradicted:
        count = max(count, 2 * used)
    more = ", or remove what contradicts the joint: a pin, a script, contact or another joint" if contradicted else ""
    if count > IMPRACTICAL:
        return f"take Implicit, or a RigidBody for a body that hardly deforms ({setting}={count} would be enough){more}"
    return f"take {setting}={count}{more}"
