"""A running scene in the words of a page: its description, and the numbers of a snapshot."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.diagnostics import measure
from supple.scene.obstacles.obstacle import Obstacle
from supple.state import State
from supple.system import BodyRange, System
from supple.viewer.engine.scene.live_scene import LiveScene
from supple.viewer.engine.scene.solvers import kind_of, solver_values
from supple.viewer.protocol.parameters import PARAMETERS
from supple.viewer.protocol.snapshots import BodyDescription, Measures, ObstacleDescription, SceneDescription, Value


def describe(live: LiveScene) -> SceneDescription:
    """Everything about the scene that does not change from frame to frame."""
    system, setup = live.system, live.setup
    gravity = -float(np.asarray(setup.scene.gravity) @ live.up)
    positions = live.state.positions
    return SceneDescription(
        generation=live.generation,
        revision=live.revision,
        bodies=tuple(_body(part, system.masses, setup.added) for part in system.bodies),
        obstacles=tuple(_obstacle(obstacle) for obstacle in system.obstacles),
        solver=kind_of(setup.solver),
        values={**solver_values(setup.solver), "dt": setup.dt, "gravity": gravity},
        up=live.up,
        low=positions.min(axis=0),
        high=positions.max(axis=0),
        stitches=_stitches(system),
        n_vertices=len(positions),
        n_tets=len(system.tets),
        n_constraints=sum(int(made.count) for made in getattr(live.workspace, "sets", ())),
    )


def _body(part: BodyRange, masses: NDArray[np.float64], added: frozenset[str]) -> BodyDescription:
    body = part.body
    skin = body.skin
    return BodyDescription(
        name=body.name,
        vertices=part.vertices,
        tet_rows=part.tets,
        rest_positions=body.mesh.vertices,
        triangles=body.mesh.surface.triangles.astype(np.int32),
        tets=body.mesh.tets.astype(np.int32),
        skin=None if skin is None else (skin.vertices, skin.triangles.astype(np.int32)),
        material=type(body.material).__name__,
        values={"friction": body.friction, **_material_values(body.material)},
        mass=float(masses[part.vertices].sum()),
        added=body.name in added,
    )


def _material_values(material: Any) -> dict[str, Value]:
    """Of the material's parameters, those that a page can change: one number each."""
    values: dict[str, Value] = {}
    for field in fields(material):
        value = getattr(material, field.name)
        if field.name in PARAMETERS and np.ndim(value) == 0:
            values[field.name] = float(value)
    return values


def _obstacle(obstacle: Obstacle) -> ObstacleDescription:
    shape, mesh = obstacle.values(), obstacle.surface_mesh
    if mesh is not None:
        shape |= {"vertices": mesh.vertices, "triangles": mesh.triangles.astype(np.int32)}
    name = obstacle.name or obstacle.label
    return ObstacleDescription(name, type(obstacle).__name__, shape, obstacle.motion is not None, obstacle.friction)


def _stitches(system: System) -> NDArray[np.int32]:
    """(k, 4) global vertices of everything that is stitched together; -1 where there is none."""
    stitching = getattr(system, "stitching", None)
    if stitching is None or not len(stitching):
        return np.zeros((0, 4), dtype=np.int32)
    return np.asarray(stitching.elements(), dtype=np.int32)


def obstacle_poses(system: System, time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotations (k, 3, 3) and translations (k, 3) [m] of the obstacles at `time`."""
    R = np.tile(np.eye(3), (len(system.obstacles), 1, 1))
    t = np.zeros((len(system.obstacles), 3))
    for k, obstacle in enumerate(system.obstacles):
        if obstacle.motion is not None:
            R[k], t[k] = obstacle.pose(time)
    return R, t


def measures(live: LiveScene) -> Measures:
    """The numbers of the present state, and of the last step."""
    report = live.report
    found = measure(live.system, live.state)
    return Measures(
        status=str(report.status),
        message=report.message,
        kinetic_energy=found.kinetic_energy,
        elastic_energy=found.elastic_energy,
        potential_energy=found.potential_energy,
        min_det_F=found.min_det_F,
        linear_momentum=found.linear_momentum,
        angular_momentum=found.angular_momentum,
        spin=np.array([spin(live.system, part, live.state) for part in live.system.bodies]),
        contacts=int(report.details.get("contacts", 0)),
        min_distance=report.min_distance,
        iterations=int(report.iterations),
    )


def spin(system: System, part: BodyRange, state: State) -> NDArray[np.float64]:
    """(3,) angular velocity of a body about its center of mass [rad/s]: I w = L."""
    m, x, v = system.masses[part.vertices], state.positions[part.vertices], state.velocities[part.vertices]
    M = m.sum()
    r = x - m @ x / M
    L = m @ np.cross(r, v - m @ v / M)
    S = (r * m[:, None]).T @ r
    inertia = np.trace(S) * np.eye(3) - S
    if not np.isfinite(inertia).all() or np.linalg.cond(inertia) > 1e12:
        return np.zeros(3)
    return np.linalg.solve(inertia, L)
