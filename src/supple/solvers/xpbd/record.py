"""What the compiled stages of a substep read and write: one record of arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba.core import types
from numba.experimental import structref
from numpy.typing import NDArray

from supple.numerics.adjacency import Adjacency
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.contact.admit import Marks
from supple.solvers.xpbd.contact.bodies import Movers
from supple.solvers.xpbd.contact.cuts import Cuts
from supple.solvers.xpbd.contact.frame_forces import LoadedRows
from supple.solvers.xpbd.contact.islands import Islands
from supple.solvers.xpbd.contact.shapes import Walls
from supple.solvers.xpbd.contact.tets import Tets
from supple.solvers.xpbd.rigid.bodies import Welds

Floats = NDArray[np.float64]
Integers = NDArray[np.int32]

# Of `Record.counts`: near pairs; whether there are other pairs to choose them from; rows; tets that have lost too much
# volume, as listed; nodes that were moved without a velocity; rows of cuts; rows in the log, and the first of them of
# the substep; whether pairs may have impulses; sweeps over rows; of the frame: substeps in which motion was cut.
NEAR, FOUND, ROWS, LOW, MOVED, CUT, LOGGED, LATEST, LOADED, SWEEPS, CUTS, COUNTS = range(12)
# Of `Record.values`: what the last sweep over rows changed, in gaps; of the frame: the smallest distance [m], the
# largest of the first, the works of contact, of friction and without a name [J].
LEFT, SMALLEST, RESIDUAL, CONTACT_WORK, FRICTION_WORK, UNNAMED_WORK, VALUES = range(7)


class List(NamedTuple):
    """A list of pairs; see `Expected`."""

    x: Floats
    v: Floats
    clock: Floats


class Rigid(NamedTuple):
    """The rigid bodies and what is fixed to them; see `RigidBodies` and `Nodes`.

    Attributes
    ----------
    control : (b, 4); masses : (b,); loose : (b,) 1 where a body has no joints, else 0
    welds : vertices of soft bodies that are fixed to bodies
    first : of the nodes that are points of bodies, their control points (k, 4) and weights (k, 4)
    before : (b, 4, 3) scratch memory; movers : with the nodes of each
    """

    control: Integers
    masses: Floats
    loose: Floats
    welds: Welds
    first: int
    points: Integers
    weights: Floats
    before: Floats
    movers: Movers


class Motion(NamedTuple):
    """The N nodes, of which the first n are the vertices.

    Attributes
    ----------
    x : (N, 4) places [m] and inverse masses [1/kg]; begin, v : (N, 3) x_n [m], velocities [m/s]
    impulses : (n, 3) changes of velocities by contact in the substep [m/s]
    before : (N, 3) velocities where it began; expected : (N, 3) places when rows were found; base : (N, 3) carried x_n
    swept : (n, 3) scratch memory; far : (N,) which nodes are not where they were expected
    origins : (n, 3) [m]; masses : (n,) [kg]; gravity : (3,)
    """

    x: Floats
    begin: Floats
    v: Floats
    impulses: Floats
    before: Floats
    expected: Floats
    base: Floats
    swept: Floats
    far: NDArray[np.bool_]
    origins: Floats
    masses: Floats
    gravity: Floats


class Pinned(NamedTuple):
    """Vertices (p,) and their places at the ends of the substeps of a frame, (substeps, p, 3) [m]."""

    pinned: Integers
    targets: Floats


class Volumes(NamedTuple):
    """The tets, and which of them (m,) are kept positive."""

    tets: Tets
    sound: NDArray[np.bool_]


class Surface(NamedTuple):
    """What touches.

    Attributes
    ----------
    faces : the triangles around each node, and their nodes; first_of : see `Simplices.first`
    owner : (N,) of nodes; origin : (3,) of places [m]; rates : (N,) see `response_rates`
    of_point : (N,) the system's points, which are `points` (start, vertices, weights)
    surface : (s,) the nodes on surfaces; spins : of `keep_spin`
    """

    faces: tuple[Adjacency, Integers]
    first_of: NDArray[np.bool_]
    owner: Integers
    origin: Floats
    rates: Floats
    of_point: Integers
    points: tuple[Integers, Integers, Floats]
    surface: Integers
    spins: tuple[Any, ...]


class Touching(NamedTuple):
    """The pairs (k,) that may touch, and room for those that may soon.

    pairs : (k,) of `PAIR`; chosen : (k,) which are rows
    walls : of pairs with simple shapes; shape_owners : of these shapes
    """

    pairs: NDArray[np.void]
    near: NDArray[np.int64]
    chosen: NDArray[np.bool_]
    walls: Walls
    shape_owners: Integers


class Solving(NamedTuple):
    """Rows, their islands, what the guarantee needs, and the log of rows that pushed in the frame."""

    rows: NDArray[np.void]
    islands: Islands
    marks: Marks
    cuts: Cuts
    log: LoadedRows


class ListsInUse(NamedTuple):
    """The wide and the tight list, how far nodes are from their places, and how far they may be, (2,) [m]."""

    wide: List
    tight: List
    deviations: Floats
    margins: Floats


class Numbers(NamedTuple):
    """Numbers.

    Attributes
    ----------
    slack : see `detect` [m]; recovered : see `part` [m]; tolerances : of `solve`
    """

    slack: float
    recovered: float
    tolerances: tuple[float, float]


class Record(NamedTuple):
    """All arrays of the stages, in the solver's numbering; counts, values : of the substep and of the frame."""

    nodes: Motion
    pins: Pinned
    tets: Volumes
    rigid: Rigid
    surface: Surface
    touching: Touching
    solving: Solving
    lists: ListsInUse
    numbers: Numbers
    counts: NDArray[np.int64]
    values: Floats


@structref.register
class RecordType(types.StructRef):
    """The type of a `SharedRecord`."""


class SharedRecord(structref.StructRefProxy):
    """A record that kernels take by reference, as unboxing all arrays takes longer than a stage of a small scene."""


structref.define_proxy(SharedRecord, RecordType, list(Record._fields))


@njit(cache=True)
def share(record):
    """The record as kernels take it by reference: of the same arrays."""
    return SharedRecord(*record)


@njit(cache=True)
def share_touching(record, touching, solving):
    """Replace what is renewed with the lists of pairs in a record that is shared."""
    record.touching, record.solving = touching, solving
