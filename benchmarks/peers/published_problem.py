"""A published case as every program gets it and what it answers, with NumPy alone: SI units, y up, floor at y = 0."""

import json
import time
from dataclasses import asdict, dataclass

import numpy as np


@dataclass
class Problem:
    """What to solve.

    static    points `pinned` (k,) go to `moved` (k, 3), and dead forces (n, 3) [N] act on the others; where `floor`,
              without friction. The answer has `positions` (n, 3), and points and forces of contact if the program has
    impact    the body flies towards the floor with `velocity` (3,) for `time` [s]; the answer has `times` (f,),
              mean `velocities` (f, 3), and of each frame the height of the `lowest` point (f,)
    rolling   a rigid ball of `radius` [m] and 1 kg that has `velocity`; `points` and `tets` (m, 3) are a polyhedron of
              it around the origin; the answer has `times` and `velocities`
    """

    kind: str
    points: np.ndarray
    tets: np.ndarray
    youngs: float = 0.0
    poisson: float = 0.0
    density: float = 1000.0
    pinned: np.ndarray = None
    moved: np.ndarray = None
    forces: np.ndarray = None
    floor: bool = False
    velocity: tuple = (0.0, 0.0, 0.0)
    gravity: tuple = (0.0, 0.0, 0.0)
    time: float = 0.0
    radius: float = 0.0
    friction: float = 0.0

    def lame(self):
        """The first Lamé parameter, and the shear modulus [Pa]."""
        shear = self.youngs / 2 / (1 + self.poisson)
        return 2 * shear * self.poisson / (1 - 2 * self.poisson), shear

    def masses(self):
        """(n,) a quarter of each tet's mass on each of its corners [kg]."""
        edges = self.points[self.tets[:, 1:]] - self.points[self.tets[:, :1]]
        shares = self.density * np.abs(np.linalg.det(edges)) / 24
        return np.bincount(self.tets.ravel(), np.repeat(shares, 4), len(self.points))


def write(path, problem):
    """A problem in a file."""
    np.savez(path, **{key: value for key, value in asdict(problem).items() if value is not None})


def read(path):
    """The problem of a file."""
    with np.load(path) as file:
        values = {key: value if value.ndim else value.item() for key, value in file.items()}
    return Problem(**values)


def answer(path, version, settings, began, **arrays):
    """Writes the arrays, and prints one JSON line; began : `time.process_time()` before the first step."""
    seconds = time.process_time() - began
    np.savez(path, **arrays)
    print(json.dumps({"version": version, "settings": settings, "seconds": seconds}))


def refuse(version, why):
    """Says that the program cannot solve such a problem."""
    print(json.dumps({"version": version, "refused": why}))
    raise SystemExit


class Relaxation:
    """Statics by dynamics: velocities are set to zero where the kinetic energy has a maximum.

    (Kinetic damping; Cundall 1976.) It ends where a maximum is a millionth of the largest, or after `limit` seconds of
    the processor.
    """

    def __init__(self, limit):
        self.before, self.largest, self.done, self.why = 0.0, 0.0, False, "equilibrium"
        self.end = time.process_time() + limit

    def stops(self, kinetic):
        """Whether velocities must be set to zero, after a step with this kinetic energy."""
        peak, self.before = kinetic < self.before, kinetic
        if peak:
            self.done = self.largest > 0 and kinetic < 1e-6 * self.largest
            self.largest, self.before = max(self.largest, kinetic), 0.0
        if time.process_time() > self.end:
            self.done, self.why = True, "stopped before equilibrium"
        return peak
