"""What a page gets: the scene once, then one message for each frame, in the format of `supple.results.page.packed`."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.viewer.protocol import limits
from supple.app.viewer.protocol.parameters import PARAMETERS
from supple.app.viewer.protocol.quantities import pretty_unit, written
from supple.app.viewer.protocol.snapshots import SceneDescription, Snapshot
from supple.results.page.described import described_motion, described_scene, points_of
from supple.results.page.packed import Packer
from supple.results.readings.frame_readings import JointReading
from supple.results.view.bounds import box_corners, view_of_scene
from supple.results.view.fields import FIELDS, Limits, Range, color_map, nodal_values
from supple.results.view.joints import lines_of_joints
from supple.results.view.model import Model, RenderFrame
from supple.results.view.surfaces import obstacle_surfaces

_MOST_JOINTS = 12  # in the text
_HISTORY = 240  # snapshots whose numbers are sent with each frame: those of four seconds
_ARROW = 0.5  # length of the arrow of the largest force of contact, as a share of the radius of the scene


def model_of(scene: SceneDescription) -> Model:
    """What no frame changes of a live scene."""
    view = view_of_scene(box_corners(scene.low, scene.high), np.asarray(scene.up), scene.obstacles)
    return Model(scene.bodies, scene.obstacles, view, scene.stitches, scene.joints)


def frame_of(snapshot: Snapshot, model: Model | None = None) -> RenderFrame:
    """What is drawn of a snapshot; `model` is that of its scene, where it is known."""
    rotations, translations = snapshot.obstacle_poses
    poses = np.concatenate([rotations.reshape(-1, 3, 3), translations.reshape(-1, 3, 1)], axis=2)
    known = snapshot.tet_values is not None and snapshot.tet_quantity is not None
    return RenderFrame(
        model or model_of(snapshot.description),
        snapshot.time,
        snapshot.positions,
        poses,
        pinned=snapshot.pinned.astype(np.int64),
        tet_values={snapshot.tet_quantity: snapshot.tet_values} if known else {},  # pyright: ignore[reportArgumentType]
        broken_stitches=snapshot.broken_stitches,
    )


class Messages:
    """The messages of one scene.

    Parameters
    ----------
    frame : the first one; numbers : see `plotted`
    about : what the page tells of the scene: title, whether it can be read again, ...
    """

    def __init__(self, frame: RenderFrame, numbers: dict[str, dict[str, float]], about: dict[str, Any]) -> None:
        model, packer = frame.model, Packer()
        self._history: deque[list[float]] = deque(maxlen=_HISTORY)
        self._lines, self._surfaces = lines_of_joints(model), obstacle_surfaces(model)
        self._limits = {field.key: Limits(field, Range()) for field in FIELDS.values()}
        described = {**described_scene(model, packer), **described_motion([(frame.time, frame)], packer)}
        fields = [
            {"key": one.key, "name": one.name, "unit": one.unit, "ends": [0, 1], "colors": color_map(one)}
            for one in FIELDS.values()
        ]
        parameters = [
            {
                "name": one.name,
                "label": f"{one.label} [{pretty_unit(one.unit)}]" if one.unit else one.label,
                "factor": one.factor,
                "whole": one.kind is int,
            }
            for one in PARAMETERS.values()
        ]
        plots = [{"title": title, "series": [{"name": name} for name in series]} for title, series in numbers.items()]
        more = {"kind": "scene", "fields": fields, "plots": plots, "parameters": parameters, **about}
        self.scene = packer.block({**described, **more})

    def of(self, snapshot: Snapshot, frame: RenderFrame) -> bytes:
        """The message of a frame."""
        packer, timing, description = Packer(), snapshot.timing, snapshot.description
        poses = np.nan_to_num([surface.pose(frame) for surface in self._surfaces])
        springs = [(grab.point, grab.target) for grab in snapshot.grabs]
        touching = snapshot.contact_points
        told = {
            "kind": "frame",
            "time": snapshot.time,
            "frame": snapshot.frame,
            "paused": snapshot.paused,
            "speed": snapshot.speed,
            "applied": snapshot.applied,
            "points": packer.add(points_of(frame, self._lines), "f4"),
            "poses": packer.add(poses, "f4"),
            "pins": packer.add(frame.pinned, "u4"),
            "grabs": packer.add(springs, "f4"),
            "contacts": packer.add(self._arrows(snapshot, frame.model.view.radius), "f4"),
            "touching": packer.add([] if touching is None else np.nan_to_num(touching), "f4"),
            "field": self._field(snapshot, frame, packer),
            "solver": description.solver,
            "values": description.values,
            "bodies": [body.values for body in description.bodies],
            "rate": f"{timing.frames_per_second:.0f} steps/s, {timing.real_time_ratio:.2f} of real time",
            "slow": slowness(snapshot),
            "measures": measured(snapshot),
            "numbers": packer.add(list(self._history), "f8"),
        }
        return packer.block(told)

    def note(self, snapshot: Snapshot) -> None:
        """Keep what plots show of a snapshot, also of those that no browser draws."""
        if self._history and snapshot.time <= self._history[-1][0]:
            if snapshot.time == self._history[-1][0]:
                return
            self._history.clear()
        numbers = [one for series in plotted(snapshot).values() for one in series.values()]
        self._history.append([snapshot.time, *numbers])

    def _field(self, snapshot: Snapshot, frame: RenderFrame, packer: Packer) -> dict[str, Any] | None:
        key = snapshot.tet_quantity
        if key is None or snapshot.tet_values is None or len(snapshot.tet_values) != len(frame.model.tets):
            return None
        ends = self._limits[key].follow(snapshot.tet_values)
        if ends is None:
            return None
        share = (nodal_values(frame, snapshot.tet_values) - ends[0]) / (ends[1] - ends[0])
        return {"key": key, "ends": list(ends), "values": packer.add(np.round(255.0 * share.clip(0.0, 1.0)), "u1")}

    def _arrows(self, snapshot: Snapshot, radius: float) -> NDArray[np.float64]:
        """(k, 2, 3) lines from contacts along their forces [m]."""
        if snapshot.contact_forces is None or not len(snapshot.contact_forces[0]):
            return np.zeros((0, 2, 3))
        points, forces = snapshot.contact_forces
        largest = max(float(np.linalg.norm(forces, axis=1).max()), 1e-300)
        reach = _ARROW * radius / largest
        return np.nan_to_num(np.stack([points, points + reach * forces], axis=1))


def plotted(snapshot: Snapshot) -> dict[str, dict[str, float]]:
    """The numbers of a frame that plots show over time, by title and name."""
    measures = snapshot.measures
    found: dict[str, dict[str, float]] = {
        "energy [J]": {
            "kinetic": measures.kinetic_energy,
            "elastic": measures.elastic_energy,
            "potential": measures.potential_energy,
        },
        "smallest J": {"J": measures.min_det_F},
        "time of a step [ms]": {"step": snapshot.timing.step_ms},
    }
    for reading in snapshot.readings:
        title = f"{_READ.get(reading.unit, 'reading')} [{pretty_unit(reading.unit)}]" if reading.unit else "reading"
        found.setdefault(title, {})[reading.name] = reading.value
    return found


_READ = {"N": "force", "Pa": "pressure", "m": "distance", "rad": "angle"}


def measured(snapshot: Snapshot) -> list[str]:
    """Lines of text: what was measured in a frame."""
    measures = snapshot.measures
    energy = measures.kinetic_energy + measures.elastic_energy + measures.potential_energy
    lines = [f"energy {written(energy, 'J', 3)}, of motion {written(measures.kinetic_energy, 'J', 3)}"]
    lines.append(f"smallest J {measures.min_det_F:.3g}, {measures.contacts} contacts")
    if measures.min_distance is not None:
        lines.append(f"smallest distance {written(measures.min_distance, 'm', 3)}")
    if measures.status != "converged":
        lines.append(f"{measures.status}: {measures.message}" if measures.message else measures.status)
    lines += [f"{one.name} {written(one.value, one.unit, 4)}" for one in snapshot.readings]
    joints = list(measures.joints.items())
    lines += [_joint_text(name, joint) for name, joint in joints[:_MOST_JOINTS]]
    return lines + ([f"and {len(joints) - _MOST_JOINTS} more joints"] if len(joints) > _MOST_JOINTS else [])


def _joint_text(name: str, joint: JointReading) -> str:
    """Where a joint is, and with what it holds; angles and torques, or displacements and forces."""
    at = "" if joint.coordinate is None else f" at {joint.coordinate:.3g},"
    motor = "" if joint.motor_force is None else f" motor {joint.motor_force:.3g},"
    return f"{name}:{at}{motor} force {np.linalg.norm(joint.force):.3g} N"


def slowness(snapshot: Snapshot) -> str:
    """Why the simulation falls behind the requested speed; "" where it does not."""
    timing, scene = snapshot.timing, snapshot.description
    if snapshot.paused or timing.keeps_up:
        return ""
    allowed = 1e3 * float(scene.values.get("dt", 1.0 / 60.0)) / snapshot.speed
    step = f"a step takes {timing.step_ms:.0f} ms of {allowed:.0f} ms"
    if timing.step_ms < allowed:
        return f"Too slow: the machine is busy with something else: {step}"
    rounds = "substeps" if scene.solver == "xpbd" else "Newton iterations"
    contacts = snapshot.measures.contacts
    cause = f"{step}: {snapshot.measures.iterations} {rounds}, {scene.n_tets} tets, {contacts} contacts"
    slower = max(limits.SLOWEST_MOTION, float(f"{0.8 * snapshot.speed * allowed / timing.step_ms:.1g}"))
    return f"Too slow: {cause}" + (f"; slow motion {slower:g} keeps up" if slower < snapshot.speed else "")
