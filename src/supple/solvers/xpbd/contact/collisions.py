"""All collisions of a scene: bodies against obstacles, against each other and against themselves."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.contact.search.reach import any_beyond_reach
from supple.contact.search.surfaces import ContactSurfaces, build_surfaces
from supple.model.system import System
from supple.scene.contact_pairs import pair_table
from supple.solvers.xpbd.contact.frame_forces import FrameForces, Owners
from supple.solvers.xpbd.contact.memory import ContactMemory
from supple.solvers.xpbd.contact.obstacle_contacts import ObstacleContacts
from supple.solvers.xpbd.contact.obstacle_shapes import build_shapes
from supple.solvers.xpbd.contact.response_rates import response_rates
from supple.solvers.xpbd.contact.settings import XPBDContact
from supple.solvers.xpbd.contact.surface_collisions import SurfaceCollisions
from supple.solvers.xpbd.rigid.bodies import RigidBodies

# Fraction of the mean surface edge that a vertex at rest may move before lists are renewed.
LEAST_REACH = 0.1
# Fractions of the mean surface edge: how much of an old overlap is removed in one frame (a faster removal would make
# bodies jump apart), the largest gap that is reported, and the default thickness.
REMOVED_PER_FRAME, NEAR, DEFAULT_THICKNESS = 0.05, 1.0, 0.05
# Fraction of the thickness: the gap that vertices keep from simple shapes, so that what rests does not touch.
SKIN = 0.01

# How often contacts of surfaces and of simple shapes are solved again in turn, where bodies are rigid: without an
# elastic body between them, a push has to pass from one contact to the next within a substep. At least; at most while a
# gap between two of them still changes by more than a fall from rest in a substep; and at most while something has
# passed through something. Without gravity, gaps are exact that change by less than this fraction of the skin.
RIGID_PASSES, CONVERGING_PASSES, MOST_RIGID_PASSES, EXACT = 2, 4, 40, 0.01


class Collisions:
    """Contact during the substeps of a frame. Positions are projected in place.

    Parameters
    ----------
    system : the bodies, in the numbering of the arrays that `project` receives.
    settings : None turns off contact of bodies with each other and with themselves; obstacles always act.

    Attributes
    ----------
    smallest_gap : see `XPBDDetails`
    contacts : number of contacts in the last substep.
    forces : of the substeps since the frame began
    """

    def __init__(self, system: System, settings: XPBDContact | None) -> None:
        self.system = system
        self.settings = settings
        rigid = RigidBodies(system)
        self._any_rigid = len(rigid) > 0
        self.edge_length = mean_edge_length(system)
        self.poses = ObstaclePoses(system.obstacles)
        rates = response_rates(system)
        table = pair_table(system.scene)
        self.obstacles = ObstacleContacts(build_shapes(system.obstacles), self.poses, system, table, rates, rigid)
        thickness = settings.thickness if settings is not None else None
        self.thickness = thickness if thickness is not None else DEFAULT_THICKNESS * self.edge_length
        switches = (False, False) if settings is None else (settings.body_collision, settings.self_collision)
        surfaces = build_surfaces(system, table, *switches, self.thickness, SKIN * self.thickness)
        self.surfaces = (
            SurfaceCollisions(system, surfaces, self.poses, self.edge_length, rates, rigid)
            if surfaces.is_needed
            else None
        )
        self.skin = SKIN * self.thickness
        self.contacts, self._dipped = 0, False
        # Whether the last projection may have moved a vertex.
        self.moved = False
        self._owners = _owners(system, self.obstacles, surfaces, rigid)
        self.forces = FrameForces(self._owners)
        self._smallest = math.inf
        self._dt = self._removed = 0.0
        count = len(self.obstacles.embedded)
        self._falling = math.hypot(*system.gravity)
        self._reach = np.zeros(count)
        self._gathered = np.zeros((count, 3))

    def __bool__(self) -> bool:
        """Whether any contact is possible."""
        return bool(self.obstacles) or self.surfaces is not None

    @property
    def rigid_points(self) -> int:
        """Number of points of rigid bodies' surfaces that take part in contact with other surfaces."""
        return 0 if self.surfaces is None else self.surfaces.rigid_points

    @property
    def smallest_gap(self) -> float | None:
        return self._smallest if math.isfinite(self._smallest) else None

    def begin_step(
        self,
        x: NDArray[np.float64],
        v: NDArray[np.float64],
        time: float,
        dt: float,
        memory: ContactMemory | None = None,
        crossing: Iterable[tuple[int, int]] = (),
        asleep: NDArray[np.bool_] | None = None,
    ) -> None:
        """Find what may touch within the frame.

        Parameters
        ----------
        x, v : (n, 3) positions [m] and velocities [m/s] at the beginning of the frame.
        time : beginning of the frame [s]; dt : its length [s].
        memory : see `memory`, of the frame before; None where there is none.
        crossing : pairs of bodies and obstacles (counted after the bodies) whose surfaces cross at the beginning. What
            passes through what is not prevented there, because it would keep them from parting.
        asleep : (b,) bodies that do not move; their contacts with each other and with obstacles remain as they are
        """
        asleep = np.zeros(len(self.system.bodies), dtype=np.bool_) if asleep is None else asleep
        self._smallest = math.inf
        self._dt = dt
        self.forces = FrameForces(self._owners)
        if self.surfaces is not None:
            self.surfaces.begin_step(x, v, time, dt, None if memory is None else memory.surfaces, crossing, asleep)
        if self.obstacles:
            known = None if memory is None else memory.obstacles
            self.obstacles.begin_step(known, x, LEAST_REACH * self.edge_length, asleep)
            if not asleep.all():
                self._gather_obstacles(self.obstacles.places(x), self.obstacles.places(v), time)

    def begin_substep(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], h: float) -> bool:
        """Apply the forces kept of the substep before to the prediction, in place, before all other constraints.

        `project` then changes them as far as needed. Returns whether there are any forces.

        Parameters
        ----------
        x, x_prev : (n, 3) prediction, and positions at the beginning of the substep [m]
        h : length of the substep [s]
        """
        self._removed = REMOVED_PER_FRAME * self.edge_length * min(1.0, h / self._dt)
        if self.obstacles:
            self.obstacles.predict(x, x_prev, h)
        bodies = self.surfaces is not None and self.surfaces.begin_substep(x, x_prev, h)
        obstacles = bool(self.obstacles) and self.obstacles.begin_substep(x, x_prev, h)
        return obstacles or bodies

    def end_substep(self) -> None:
        """Take notice of the forces, and keep what the next substep begins with."""
        rows = None if self.surfaces is None else self.surfaces.forces()
        loads = self.obstacles.forces() if self.obstacles else None
        self.forces.end_substep(rows, loads)
        if self.surfaces is not None:
            self.surfaces.end_substep()
        if self.obstacles:
            self.obstacles.end_substep()

    def project(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], time: float, h: float) -> int:
        """Resolve all contacts of one substep, in place. Returns their number. May be repeated within the substep.

        An overlap that existed when the substep began is removed from `x` and from `x_prev` alike, so that it causes no
        velocity (x - x_prev) / h. The caller must use both arrays afterwards.

        Parameters
        ----------
        x : (n, 3) positions at the end of the substep, after all other constraints [m]
        x_prev : (n, 3) positions at its beginning [m]
        time : end of the substep [s]; h : its length [s].
        """
        self.contacts, self._dipped = 0, False
        self.moved = bool(self.obstacles)
        limit, self._removed = self._removed, 0.0
        if self.surfaces is not None:
            self._count(self.surfaces.project(x, x_prev, (time - h, time), limit))
            self.moved |= self.surfaces.moved
        between = self.contacts
        self._project_obstacles(x, x_prev, time, h, limit)
        if self.surfaces is not None:
            most = MOST_RIGID_PASSES if self._any_rigid and between else 0
            if self.contacts > between:
                for k in range(min(CONVERGING_PASSES, most)):
                    if k >= RIGID_PASSES and self.surfaces.changed <= self._falling * h * h + EXACT * self.skin:
                        break
                    self.project_again(x, x_prev, time, h)
                # What obstacles push may have passed through other bodies.
                self.surfaces.check_separated(x)
            for _ in range(most):
                if self.surfaces.separated:
                    break
                self.project_again(x, x_prev, time, h)
                self.surfaces.check_separated(x)
        return self.contacts

    def project_again(self, x: NDArray[np.float64], x_prev: NDArray[np.float64], time: float, h: float) -> int:
        """`project` for positions that have changed since, without a new search for contacts of surfaces."""
        self.contacts = 0 if self.surfaces is None else self.surfaces.project_again(x, x_prev, h)
        self._dipped, self.moved = False, True
        self._project_obstacles(x, x_prev, time, h, 0.0)
        return self.contacts

    def _project_obstacles(
        self, x: NDArray[np.float64], x_prev: NDArray[np.float64], time: float, h: float, limit: float
    ) -> None:
        if self.obstacles:
            places, before = self.obstacles.take(x, x_prev)
            if any_beyond_reach(places, self._gathered, self._reach):
                self._gather_obstacles(places, (places - before) / h, time)
            scales = (self.skin, NEAR * self.edge_length)
            self._count(self.obstacles.project(places, before, (time - h, time), limit, scales))
            self.obstacles.give(places, before, x, x_prev)

    @property
    def positions(self) -> NDArray[np.float64]:
        """(p, 3) of the points of surfaces, as they were at the latest projection; a copy [m]."""
        return np.zeros((len(self._owners.of_points), 3)) if self.surfaces is None else self.surfaces.positions

    @property
    def separated(self) -> bool:
        """Whether nothing had passed through anything after the last `project`."""
        return (self.surfaces is None or self.surfaces.separated) and not self._dipped

    def check_separated(self, x: NDArray[np.float64], time: float) -> None:
        """Take notice of what has passed through something in the substep that ends at x (n, 3) [m], `time` [s]."""
        if self.surfaces is not None:
            self.surfaces.check_separated(x)
        self._dipped = self.obstacles.rigid_point_inside(x, time)

    def passed(self, x: NDArray[np.float64], labels: NDArray[np.integer]) -> NDArray[np.int64]:
        """Which surfaces passed through each other in the substep that was projected last.

        Parameters
        ----------
        x : (n, 3) at its end [m]; labels : (n,) of the vertices, one for each component

        Returns
        -------
        pairs : (k, 2) labels; -1 for an obstacle
        """
        if self.surfaces is None:
            return np.zeros((0, 2), dtype=np.int64)
        return self.surfaces.component(labels)[self.surfaces.passed(x)]

    def memory(self, x: NDArray[np.float64]) -> ContactMemory | None:
        """What the next frame needs beside positions and velocities; `x` (n, 3) are the final positions [m]."""
        surfaces = None if self.surfaces is None else self.surfaces.memory(x)
        obstacles = self.obstacles.memory(x) if self.obstacles else None
        return ContactMemory(surfaces, obstacles) if self else None

    def _gather_obstacles(self, x: NDArray[np.float64], v: NDArray[np.float64], time: float) -> None:
        falling = 0.5 * self._falling * self._dt**2
        least = LEAST_REACH * self.edge_length + falling
        self._reach = least + 1.2 * self._dt * np.sqrt(np.einsum("ij,ij->i", v, v))
        self._gathered[:] = x
        self.obstacles.gather(x, self._reach, time)

    def _count(self, found: tuple[int, float]) -> None:
        self.contacts += found[0]
        self._smallest = min(self._smallest, found[1])


def _owners(system: System, obstacles: ObstacleContacts, surfaces: ContactSurfaces, rigid: RigidBodies) -> Owners:
    names = tuple(part.name for part in system.bodies) + tuple(str(o.name) for o in system.obstacles)
    vertex = obstacles.embedded.single
    # The points of soft bodies are their vertices; a control point is not a point.
    points, single = np.full(len(obstacles.embedded), -1, dtype=np.int32), system.points.single
    points[single[single >= 0]] = np.flatnonzero(single >= 0)
    points[vertex < 0] = np.flatnonzero(single < 0)
    return Owners(
        names=names,
        of_points=surfaces.owner[surfaces.point_piece].astype(np.int32),
        of_shapes=(len(system.bodies) + np.asarray(obstacles.shapes.owners)).astype(np.int32),
        of_vertices=obstacles.owner,
        rows=surfaces.rows,
        tested=points,
        masses=np.where((vertex < 0) | (rigid.welded_to[vertex] >= 0), 1.0, system.masses[vertex]),
    )


def mean_edge_length(system: System) -> float:
    """Mean edge length of all the bodies' surfaces at rest [m]."""
    a, b, c = system.rest_points[system.triangles].transpose(1, 0, 2)
    return float(np.mean([np.linalg.norm(a - b, axis=1), np.linalg.norm(b - c, axis=1), np.linalg.norm(c - a, axis=1)]))
