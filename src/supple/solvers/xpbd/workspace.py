"""What XPBD computes once for a system, and its scratch arrays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, field, replace

import numba
import numpy as np
from numpy.typing import NDArray

from supple.materials.elastic_tets.active import Growth
from supple.model.state import State
from supple.model.system import System
from supple.runtime.thread_tuning import ThreadTuner
from supple.runtime.threads import numba_threads
from supple.solvers.xpbd.assessment.assessment import Assessment
from supple.solvers.xpbd.assessment.elastic_energy import ElasticEnergy
from supple.solvers.xpbd.assessment.works import Works
from supple.solvers.xpbd.constraints.actuators import ActuatorProjection
from supple.solvers.xpbd.constraints.delivered_work import DeliveredWork
from supple.solvers.xpbd.constraints.registry import ConstraintSet, ElementStage
from supple.solvers.xpbd.constraints.stable_neo_hookean import StableNeoHookeanConstraints
from supple.solvers.xpbd.constraints.stitches import StitchAnchors, StitchForces
from supple.solvers.xpbd.contact.contact import Contact
from supple.solvers.xpbd.damping.kelvin_voigt import Damping
from supple.solvers.xpbd.external_forces import ExternalForces
from supple.solvers.xpbd.memory import XPBDMemory
from supple.solvers.xpbd.moment import Moment, Substep
from supple.solvers.xpbd.momentum import MomentumRestore
from supple.solvers.xpbd.record import (
    COUNTS,
    LOADED,
    SMALLEST,
    VALUES,
    List,
    ListsInUse,
    Motion,
    Numbers,
    Pinned,
    Record,
    Rigid,
    Solving,
    Surface,
    Touching,
    Volumes,
)
from supple.solvers.xpbd.rigid.bodies import RigidBodies
from supple.solvers.xpbd.rigid.joints import JointProjection
from supple.solvers.xpbd.sleep import Sleep
from supple.solvers.xpbd.stages import Stages, stages
from supple.solvers.xpbd.substeps import SubstepChoice
from supple.solvers.xpbd.sweeps.ordering import Layout, reordered
from supple.solvers.xpbd.welded_masses import WeldedMasses


@dataclass(eq=False)
class XPBDWorkspace:
    """What is computed once for a system, and scratch arrays, in the solver's own numbering of vertices.

    It is only a cache: a step does not read anything of an earlier step but the state.

    Attributes
    ----------
    growth : that of the present elastic constants
    threads : of Numba's parallel kernels; None leaves their number as it is; most_threads : in the present frame
    extended : (n + a, 4) positions about one origin [m] and inverse masses [1/kg], of the vertices and then
        of the anchors (inverse mass 0); points : the rows of the vertices. Views of the nodes of contact
    time : of these positions, between two substeps [s]
    previous : (n, 3) positions at the beginning of the substep [m]
    velocities, origins : (n, 3); world : (n, 3) positions in the world at the ends of frames [m]
    sound : (m,) the tets that keep their volume positive; bounds : (m,) scratch memory
    counts, values : see `Record`
    """

    system: System
    layout: Layout
    welded: WeldedMasses
    rigid: RigidBodies
    joints: JointProjection
    sets: list[ConstraintSet]
    damping: Damping | None
    momentum: MomentumRestore
    restores: bool
    contact: Contact
    loads: ExternalForces
    actuators: ActuatorProjection
    assessment: Assessment
    delivered: DeliveredWork
    works: Works
    choice: SubstepChoice
    sleep: Sleep
    threads: int | None
    pace: ThreadTuner
    anchors: StitchAnchors
    stitch_forces: StitchForces
    growth: Growth | None = None
    most_threads: int = 1
    time: float = 0.0
    extended: NDArray[np.float64] = field(init=False)
    points: NDArray[np.float64] = field(init=False)
    previous: NDArray[np.float64] = field(init=False)
    velocities: NDArray[np.float64] = field(init=False)
    origins: NDArray[np.float64] = field(init=False)
    world: NDArray[np.float64] = field(init=False)
    sound: NDArray[np.bool_] = field(init=False)
    bounds: NDArray[np.float64] = field(init=False)
    counts: NDArray[np.int64] = field(init=False)
    values: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        n, m, nodes = len(self.system.masses), len(self.system.tets), self.contact.nodes
        self.extended = nodes.x[: n + len(self.system.stitching.anchors)]
        self.points, self.previous, self.velocities = nodes.x[:n], nodes.begin[:n], nodes.v[:n]
        self.origins, self.world = np.zeros((n, 3)), np.zeros((n, 3))
        self.sound, self.bounds = np.ones(m, dtype=np.bool_), np.zeros(m)
        self.counts, self.values = np.zeros(COUNTS, dtype=np.int64), np.zeros(VALUES)
        count, rigid = len(nodes.x), self.rigid
        loose, before = np.where(rigid.joined, 0.0, 1.0), np.zeros((len(rigid), 4, 3))
        self._rigid = Rigid(rigid.control, rigid.masses, loose, rigid.welds, *nodes.embedded, before, nodes.movers)
        before, expected, base = np.zeros((3, count, 3))
        self._scratch = before, expected, base, np.zeros((n, 3)), np.zeros(count, dtype=np.bool_)
        self.element_stages = [each for each in self.sets if isinstance(each, ElementStage)]
        self.grows = self.system.laws_at(0.0).growth is not None

    def with_loads(self, system: System) -> XPBDWorkspace:
        """The workspace for a system that differs only by its loads on vertices and its soft targets."""
        inner = reordered(system, self.layout)
        works = copy(self.works)
        works.system = inner
        return replace(self, system=inner, loads=ExternalForces(inner), works=works, sleep=self.sleep.of(inner))

    def set_asleep(self, bodies: NDArray[np.bool_]) -> None:
        """Let no vertex of these bodies (b,) move, and no constraint of them be projected."""
        free = np.where(self.sleep.vertices(bodies), 0.0, self.system.inverse_masses)
        if not np.array_equal(free, self.points[:, 3]):
            self.points[:, 3] = free
            for constraints in self.sets:
                constraints.sweep.choose(self.extended[:, 3])
            if self.damping is not None:
                self.damping.choose(self.extended[:, 3])

    @contextmanager
    def own_threads(self) -> Iterator[None]:
        """A frame's block. What is outside of substeps runs in the mode that was faster in them so far."""
        with numba_threads(self.threads):
            self.most_threads = numba.get_num_threads()
            with self.pace.threads(self.pace.parallel):
                yield

    def grow(self, time: float) -> float:
        """Take the stress-free shapes of the tets at `time` [s]; returns the work of that [J]."""
        laws = self.system.laws_at(time)
        if laws.growth is None or laws.growth.equals(self.growth):
            return 0.0
        elastic = self.assessment.balance.elastic
        before = float(elastic.of(self.points).sum())
        self.growth = laws.growth
        shapes = laws.stress_free.Dm_inv, laws.stress_free.volumes
        for each in (*self.sets, self.assessment.balance.elastic, self.works.held.elements):
            if isinstance(each, (StableNeoHookeanConstraints, ElasticEnergy)):
                each.grow(*shapes)
        return float(elastic.of(self.points).sum()) - before

    def begin_frame(self, time: float, h: float) -> None:
        """Begin a frame at `time` [s], in substeps of h [s]."""
        self.actuators.begin_frame(self.substep(time, h))
        self.loads.begin_frame(self.substep(time + h, h))
        self.works.begin_frame(self.velocities)
        self.stitch_forces.begin_frame()
        self.rigid.begin_frame(self.velocities)
        self.counts[:], self.values[:] = 0, 0.0
        self.counts[LOADED], self.values[SMALLEST] = self.contact.lists.loaded, np.inf

    def record(self, targets: NDArray[np.float64], recovered: float, h: float) -> Record:
        """What the stages of substeps of h [s] work on, as it is at present; the parameters are those of `Record`."""
        contact, nodes, system, points = self.contact, self.contact.nodes, self.system, self.system.points
        lists, simplices = contact.lists, contact.surface.simplices
        moving = nodes.x, nodes.begin, nodes.v, nodes.impulses
        return Record(
            Motion(*moving, *self._scratch, self.origins, system.masses, system.gravity),
            Pinned(system.pinned_vertices, targets),
            Volumes(contact.tets, self.sound),
            self._rigid,
            Surface(
                *(contact.faces, simplices.first, simplices.owner, nodes.origin, contact.rates, contact.surface.points),
                *((points.start, points.vertices, points.weights), simplices.nodes, contact.spins),
            ),
            *self.touching(),
            ListsInUse(List(*lists.wide.arrays), List(*lists.tight.arrays), lists.deviations, lists.margins),
            Numbers(contact.slack, recovered, contact.solver.tolerances(h)),
            self.counts,
            self.values,
        )

    def touching(self) -> tuple[Touching, Solving]:
        """What is renewed with the lists of pairs."""
        contact, pairs = self.contact, self.contact.lists.pairs
        room = contact.rows, contact.solver.islands, contact.marks, contact.cuts, contact.log
        walls = contact.walls[2], contact.shapes.owners
        return Touching(pairs, contact.near, contact.chosen, *walls), Solving(*room)

    def stages(self) -> Stages:
        """The compiled stages of the scene."""
        return stages(len(self.rigid) > 0, bool(self.contact))

    def substep(self, time: float, h: float) -> Substep:
        """The arrays of a substep of h [s] that ends at `time` [s]."""
        return Substep(self.points, self.velocities, self.origins, self.previous, time, h)

    def present(self) -> State:
        """The state after the latest substep, in the numbering of the scene, without what later frames must know."""
        new = self.layout.new_from_old
        state = State(self.time, (self.points[:, :3] + self.origins)[new], self.velocities[new], memory=XPBDMemory())
        return replace(self.welded.outer(state), memory=None)

    def moment(self, time: float) -> Moment:
        """What the assessment reads, at `time` [s]."""
        return Moment(self.points, self.extended, self.velocities, self.origins, time)
