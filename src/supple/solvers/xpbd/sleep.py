"""Bodies at rest sleep: they keep their positions and cost no work until something wakes them.

Bodies that touch each other, or are stitched, are an island; all of an island sleeps, or none. It falls asleep after a
frame in which each of its bodies has stayed, for a time T, within

    d = accuracy min(EDGES l, FALL g (T/2)^2 / 2)

of one place, with l the mean length of the body's edges. A body that stays within this distance is thus

- slower than a share of an edge in the time T, which is at least the body's damping time: the remaining creep of an
  overdamped body is at most d;
- in balance up to a share of its weight: an oscillation that turns has the displacement a (T/2)^2 / 2 to both sides.
  Without gravity, nothing sleeps.

An island wakes where something awake pushes it or has passed into it (the frame is then undone and simulated with the
island awake), where its state was changed from outside, where an obstacle moves, and where anything in the scene
differs from the previous frame. Bodies with loads, actuators, motors, soft targets or moving pins do not sleep.

Source of the name and of islands: Catto, "Box2D" manual, "Simulation islands".
"""

from __future__ import annotations

import hashlib
import math
from copy import copy
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from supple.contact.mesh.obstacles import ObstaclePoses
from supple.model.system import System
from supple.scene.scene import Scene
from supple.solvers.xpbd.contact.frame_forces import FrameForces, LoadedRows
from supple.solvers.xpbd.sweeps.ordering import Layout

EDGES, FALL = 0.5, 0.1
AWAKE = -1
_LOADS = {System: {"loads", "soft_targets"}, Scene: {"forces", "soft_targets"}}


@dataclass(frozen=True, eq=False)
class SleepMemory:
    """What the next frame must know of bodies at rest.

    Attributes
    ----------
    islands : (b,) a number for each sleeping island, `AWAKE` for the other bodies
    since : (b,) the time since which each body has stayed at its place [s]
    places : (n, 3) where its vertices were then, in the numbering of the scene [m]
    contacts : of sleeping bodies with each other and with obstacles (see `FrameForces.at_rest`)
    scene : digest of the scene; poses : (k, 12) of the obstacles at the end of the frame
    """

    islands: NDArray[np.int64]
    since: NDArray[np.float64]
    places: NDArray[np.float64]
    contacts: LoadedRows
    scene: str
    poses: NDArray[np.float64]

    @property
    def asleep(self) -> NDArray[np.bool_]:
        """(b,) which bodies sleep."""
        return self.islands != AWAKE


class Sleep:
    """Which bodies of a system sleep.

    Parameters
    ----------
    system : in the numbering of `layout`; after : how long bodies stay before they sleep [s], None for never
    accuracy : see `XPBD`
    """

    def __init__(self, system: System, layout: Layout, after: float | None, accuracy: float) -> None:
        self._system, self._layout = system, layout
        self._after, self._accuracy = after, accuracy
        self._starts = [part.vertices.start for part in system.bodies]
        self._poses = ObstaclePoses(system.obstacles)
        self._links = _stitched_bodies(layout.body, system.joined_components)
        if after is None:
            self._times = np.full(len(system.bodies), math.inf)
            self._own_times, self._limits = self._times, np.zeros(len(system.bodies))
            self._unloaded = self._scene = ""
            return
        # Shells have no tets, and one damping.
        counts = [max(1, part.tets.stop - part.tets.start) for part in system.bodies]
        damping = [part.body.material.per_tet(n).damping for part, n in zip(system.bodies, counts, strict=True)]
        self._own_times = np.array([max(after, float(np.max(tau))) for tau in damping])
        edges = np.array([float(system.rest_lengths[part.edges].mean()) for part in system.bodies])
        fall = 0.5 * math.hypot(*system.gravity) * (0.5 * self._own_times) ** 2
        self._limits = accuracy * np.minimum(EDGES * edges, FALL * fall)
        self._unloaded = _digest(system, without_loads=True)
        self._take_loads()

    def of(self, system: System) -> Sleep:
        """Of a system that differs only by its loads on vertices and its soft targets."""
        made = copy(self)
        made._system = system
        if self._after is not None:
            made._take_loads()
        return made

    def _take_loads(self) -> None:
        system = self._system
        self._times = np.where(self._restless(), math.inf, self._own_times)
        self._scene = self._unloaded + _digest(
            (system.loads, system.soft_targets, system.scene.forces, system.scene.soft_targets)
        )

    def begin(
        self, x: NDArray[np.float64], v: NDArray[np.float64], time: float, dt: float, memory: SleepMemory | None
    ) -> SleepMemory:
        """Which bodies sleep when a frame begins, and since when the others have stayed.

        Parameters
        ----------
        x, v : (n, 3) of the scene's vertices [m], [m/s]; time, dt : of the frame [s]; memory : of the frame before
        """
        poses = self._poses_at(time)
        if memory is None or memory.scene != self._scene or not np.array_equal(memory.poses, poses):
            none = np.full(len(self._starts), AWAKE, dtype=np.int64)
            return SleepMemory(none, np.full(len(none), time), x, LoadedRows.room(0), self._scene, poses)
        if not np.array_equal(self._poses_at(time + dt), poses):
            return self.woken(memory, memory.asleep)
        changed = self._largest(np.maximum(np.abs(x - memory.places), np.abs(v))) > 0.0
        return self.woken(memory, changed)

    def woken(self, memory: SleepMemory, bodies: NDArray[np.bool_]) -> SleepMemory:
        """`memory` without the islands of these bodies (b,)."""
        islands = np.where(np.isin(memory.islands, memory.islands[bodies]), AWAKE, memory.islands)
        return replace(memory, islands=islands)

    @staticmethod
    def disturbed(begun: SleepMemory, pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(b,) the sleeping bodies that something awake touched in the frame, of pairs (k, 2) with obstacles too."""
        asleep = begun.asleep
        found = np.zeros(len(asleep), dtype=np.bool_)
        pairs = pairs[(pairs < len(asleep)).all(axis=1)]
        found[pairs[asleep[pairs[:, 0]] != asleep[pairs[:, 1]]]] = True
        return found & asleep

    def end(
        self,
        x: NDArray[np.float64],
        v: NDArray[np.float64],
        time: float,
        begun: SleepMemory,
        forces: FrameForces,
        sound: bool,
    ) -> SleepMemory:
        """End a frame; sets the velocities of bodies that fall asleep to zero.

        Parameters
        ----------
        x, v : as of `begin`, at the end of the frame at `time`; begun : what `begin` returned
        forces : of contact in the frame
        sound : whether the frame is good enough to rest in
        """
        if begun.asleep.all():
            x[:], v[:] = begun.places, 0.0
            return begun
        # The conversion to the components' origins and back rounds.
        still = self._vertices(begun.asleep)
        x[still] = begun.places[still]
        moved = self._largest(np.abs(x - begun.places)) > self._limits
        since = np.where(moved, time, begun.since)
        ready = begun.asleep | ((time - since >= (1.0 - 1e-9) * self._times) & sound)
        islands = begun.islands
        if ready.any():
            islands = self._islands(forces.pairs())
            ready = ~np.isin(islands, islands[~ready])
        fallen = ready & ~begun.asleep
        rows = self._vertices(moved | fallen)
        places = np.where(rows[:, None], x, begun.places)
        v[self._vertices(fallen)] = 0.0
        rest = forces.at_rest(ready)
        return SleepMemory(np.where(ready, islands, AWAKE), since, places, rest, self._scene, self._poses_at(time))

    def vertices(self, bodies: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,) the vertices of bodies (b,), in the solver's numbering, which permutes vertices within a body only."""
        return bodies[self._layout.body]

    _vertices = vertices

    def _islands(self, pairs: NDArray[np.int64]) -> NDArray[np.int64]:
        """(b,) the lowest body of those that each is connected to, by contact or stitches."""
        count = len(self._starts)
        a, b = np.concatenate([self._links, pairs[(pairs < count).all(axis=1)]]).T
        labels = connected_components(coo_array((np.ones(len(a)), (a, b)), shape=(count, count)), directed=False)[1]
        return np.unique(labels, return_index=True)[1][labels].astype(np.int64)

    def _restless(self) -> NDArray[np.bool_]:
        """(b,) the bodies that something may pull at any time."""
        system, held = self._system, np.zeros(len(self._system.masses), dtype=np.bool_)
        for each in [*(pin for pin in system.pins if pin.motion is not None), *system.soft_targets]:
            held[each.vertices] = True
        for load in system.loads:
            held[load.acts_on()] = True
        for actuator in system.actuators:
            held[actuator.coordinate.vertices] = True
        driven = {joint.first for joint in system.scene.joints if getattr(joint, "motor", None) is not None}
        for part in system.bodies:
            held[part.vertices] |= part.name in driven
        return np.logical_or.reduceat(held, self._starts)

    def _largest(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(b,) the largest of the values (n, 3) of each body; NaN where one is not a number."""
        # Stitched points of rigid bodies come after the vertices of bodies, and move as these do.
        end = self._system.bodies[-1].vertices.stop
        return np.maximum.reduceat(values[:end].max(axis=1), self._starts)

    def _poses_at(self, time: float) -> NDArray[np.float64]:
        R, t = self._poses.at(time)
        return np.concatenate([R.reshape(len(t), 9), t], axis=1)


def _stitched_bodies(bodies: NDArray[np.int32], components: NDArray[np.int32]) -> NDArray[np.int64]:
    """(k, 2) links between the bodies of each component; both are given for every vertex (n,)."""
    first: dict[int, int] = {}
    pairs = np.unique(np.stack([bodies, components], axis=1), axis=0).tolist()
    links = [(first.setdefault(component, body), body) for body, component in pairs]
    return np.array(links, dtype=np.int64).reshape(-1, 2)


def _digest(thing: Any, without_loads: bool = False) -> str:
    """A number of all values in a system, or a part of it; functions of time count by their names.

    Parameters
    ----------
    without_loads : leave out the loads on vertices and the soft targets of the system and of its scene
    """
    digest = hashlib.sha256()
    left_out = _LOADS if without_loads else {}

    def add(value: Any) -> None:
        if isinstance(value, np.ndarray):
            digest.update(f"{value.dtype} {value.shape}".encode())
            digest.update(np.ascontiguousarray(value).tobytes())
        elif is_dataclass(value):
            add(type(value).__qualname__)
            for each in fields(value):
                if each.name != "start_states" and each.name not in left_out.get(type(value), ()):
                    add(getattr(value, each.name))
        elif isinstance(value, (tuple, list)):
            digest.update(f"{len(value)} of".encode())
            for each in value:
                add(each)
        elif value is None or isinstance(value, (str, int, float, bool, np.generic)):
            digest.update(f"{value!r};".encode())
        elif isinstance(value, dict):
            add([*value.items()])
        else:
            digest.update(getattr(value, "__qualname__", type(value).__qualname__).encode())

    add(thing)
    return digest.hexdigest()
