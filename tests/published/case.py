"""What a published case is: a problem of the literature, the values that its source gives, and how Supple solves it.

Each other file of this folder that is not a test has one `CASE`, and its docstring states the problem and its source.
`python -m benchmarks.published NAME` runs it alone and draws it.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import supple as sp
from supple.numerics.quadratic_shape_functions import reference_gradients

STATIC = sp.Implicit(integrator="static", contact=None)


@dataclass(frozen=True)
class Reference:
    """A value of the source.

    Attributes
    ----------
    value : a number, or a vector
    unit : of it, for the table
    bound : largest error at the finer mesh, as a share of `scale`; coarse : the same at the coarser mesh
    scale : what errors are relative to; None for the length of `value`
    """

    value: float | tuple[float, ...]
    unit: str
    bound: float = 0.01
    coarse: float = 0.03
    scale: float | None = None

    def error(self, ours: ArrayLike) -> float:
        """The relative error of our value."""
        difference = float(np.linalg.norm(np.asarray(ours) - np.asarray(self.value)))
        return difference / (self.scale or float(np.linalg.norm(self.value)))


@dataclass(frozen=True)
class Solution:
    """What a case gives on one mesh.

    Attributes
    ----------
    values : ours, by the names of the case's references
    frame : the frame of the picture; its scene has the elements that are counted
    """

    values: Mapping[str, Any]
    frame: sp.Frame


@dataclass(frozen=True)
class Case:
    """A published problem.

    Attributes
    ----------
    title : with the number of a load or variant
    source : author and year, or the collection
    references : by quantity
    solve : the solution on a mesh
    meshes : arguments of `solve`: the coarser mesh of `make test`, and the finer one
    differs : what is not like the source, in one or two sentences; empty where nothing is
    order : least order of convergence of the first quantity between the two meshes, where the reference is exact and
        the finer mesh has `refined` times as many elements along each edge
    look : options of the picture, as those of `supple picture`
    """

    title: str
    source: str
    references: Mapping[str, Reference]
    solve: Callable[[Any], Solution]
    meshes: tuple[Any, Any]
    differs: str = ""
    order: float | None = None
    refined: float = 2.0
    look: Mapping[str, Any] | None = None


def modules() -> dict[str, ModuleType]:
    """The modules of all cases by their name, in alphabetical order."""
    names = sorted(path.stem for path in Path(__file__).parent.glob("*.py"))
    cases = [name for name in names if name != "case" and not name.startswith("test_")]
    return {name: importlib.import_module(f"tests.published.{name}") for name in cases}


def equilibria(scene: sp.Scene, steps: int = 1) -> list[sp.Frame]:
    """The equilibria at the times 1 / steps, 2 / steps, ..., 1 s; loads and pins are functions of time."""
    return list(sp.simulate(scene, STATIC, 1.0 / steps, steps, strict=True))


def mapped_box(divisions: tuple[int, int, int], place: Callable[[NDArray[np.float64]], ArrayLike]) -> sp.TetMesh:
    """Quadratic tets of the unit cube from 0 to 1 with `place` (k, 3) -> (k, 3) applied to all nodes."""
    unit = sp.shapes.box((1.0, 1.0, 1.0), divisions, order=2)
    return sp.TetMesh(place(unit.vertices + 0.5), unit.nodes)


def graded(s: NDArray[np.float64], cells: int, power: float) -> NDArray[np.float64]:
    """Places from 0 to 1 of nodes at `s`, so that cells grow from 0 on and their middle nodes stay in their middles."""
    corners = np.linspace(0.0, 1.0, cells + 1)
    return np.interp(s, corners, corners**power)


def triangles_where(mesh: sp.TetMesh, inside: ArrayLike) -> NDArray[np.int64]:
    """Rows of the surface's triangles of which all corners are vertices `inside` (n,), a mask."""
    return np.flatnonzero(np.asarray(inside)[mesh.surface.triangles].all(axis=1))


def nearest(mesh: sp.TetMesh, place: ArrayLike) -> int:
    """The vertex that is nearest to a place (3,)."""
    return int(np.linalg.norm(mesh.vertices - np.asarray(place), axis=1).argmin())


def cauchy_at(frame: sp.Frame, name: str, vertex: int) -> NDArray[np.float64]:
    """(3, 3) Cauchy stress at a corner of quadratic tets [Pa]: the mean over the tets that meet there."""
    body = next(body for body in frame.system.scene.bodies if body.name == name)
    rest, nodes = body.mesh.vertices, body.mesh.nodes
    rows, corner = np.nonzero(nodes[:, :4] == vertex)
    gradients = reference_gradients(np.eye(4)[corner])
    Dm = np.einsum("mai,maj->mij", rest[nodes[rows]], gradients)
    Ds = np.einsum("mai,maj->mij", frame.positions[name][nodes[rows]], gradients)
    F = Ds @ np.linalg.inv(Dm)
    P = np.array([body.material.first_piola(f) for f in F])  # pyright: ignore[reportAttributeAccessIssue]
    return np.mean(P @ np.swapaxes(F, 1, 2) / np.linalg.det(F)[:, None, None], axis=0)


def as_one_step(frame: sp.Frame) -> sp.Frame:
    """The frame as the first one after the start."""
    return replace(frame, index=1)


def as_bent(modes: Any, mode: int, amplitude: float) -> sp.Frame:
    """The frame of soft bodies that a mode displaces by at most `amplitude` [m]."""
    frame = modes.frame
    x = frame.state.positions + amplitude * np.concatenate(list(modes.shape(mode).values()))
    return as_one_step(replace(frame, state=replace(frame.state, time=1.0, positions=x)))


def rollers(name: str, mesh: sp.TetMesh, axis: int, plane: ArrayLike, youngs: float) -> sp.SoftTarget:
    """Holds the vertices of a `plane` (n,), a mask, along an axis: a plane of symmetry.

    The springs are a thousand times as stiff as a cube of the material with the body's diagonal as its edge: what is
    held moves by a thousandth of the strain times the square of an element's share of the diagonal.
    """
    size = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    return sp.SoftTarget(name, np.flatnonzero(plane), stiffness=1e3 * youngs * size * np.eye(3)[axis])


# The pendulums, run with accuracy .02 and .1, gave the same bits: rigid bodies have no elastic error.
DYNAMIC = {"Implicit": sp.Implicit(integrator="bdf2", contact=None), "XPBD": sp.XPBD(contact=None)}


def simulated(scene: sp.Scene, solver: Any, dt: float, time: float) -> list[sp.Frame]:
    """The frames from dt to about `time` [s], all of which converged."""
    return list(sp.simulate(scene, solver, dt, round(time / dt), strict=True))


def rod(name: str, begin: ArrayLike, end: ArrayLike, width: float = 0.1, mass: float = 1.0, **values: Any) -> Any:
    """A rigid prism of square section between two places (3,) [m]."""
    a, b = np.asarray(begin, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(b - a))
    x, along = np.array([1.0, 0.0, 0.0]), (b - a) / length
    turn, cosine = np.cross(x, along), float(along[0])
    sine = float(np.linalg.norm(turn))
    axis = turn / sine if sine > 1e-9 else np.array([0.0, 0.0, 1.0])
    shape = sp.shapes.box_surface((length, width, width), (1, 1, 1))
    rotation = np.arctan2(sine, cosine) * axis
    return sp.RigidBody(name, shape, mass=mass, position=(a + b) / 2, rotation=rotation, **values)


def crossings(times: ArrayLike, values: ArrayLike) -> NDArray[np.float64]:
    """When values (n,) change their sign [s], by lines between times (n,)."""
    t, y = np.asarray(times), np.asarray(values)
    k = np.flatnonzero(y[1:] * y[:-1] < 0.0)
    return t[k] + (t[k + 1] - t[k]) * y[k] / (y[k] - y[k + 1])
