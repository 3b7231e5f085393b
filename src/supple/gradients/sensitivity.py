"""The derivatives of a loss over a whole simulation by parameters of its scene: the adjoint of its converged steps."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError, SolverError, SuppleWarning
from supple.gradients.adjoint import ForceAdjoint, StateAdjoint, StepAdjoint, step_adjoint
from supple.gradients.bridges import jax_function, torch_function
from supple.gradients.check import Check, check
from supple.gradients.equations import Equations
from supple.gradients.fields import by_anchors, fields_of
from supple.gradients.kept import Kept, Replay
from supple.gradients.misfit import Loss, Misfit, OfScene, OwnLoss, Seeds
from supple.gradients.refusals import refuse
from supple.gradients.settled import settle
from supple.gradients.tangent import Side, StateTangent, step_tangent
from supple.model.state import State
from supple.model.system import System, initial_state
from supple.results.frame import Frame
from supple.scene.rotation import rotation_matrix
from supple.scene.scene import Scene
from supple.simulate import check_timing, first_frame, frames_from, prepared
from supple.solvers.implicit.solver import Implicit
from supple.solvers.implicit.stepping.workspace import Workspace

Floats = NDArray[np.float64]

# Of a parameter: the step of central differences at fixed states. Their error of truncation is about its square, and
# that of round-off its inverse times 1e-16.
_STEP = 1e-5
# Of contact's forces: what is left of all forces at the end of a step before it is warned of.
_BALANCED = 1e-3


@dataclass(frozen=True, eq=False)
class Gradient:
    """A loss and its derivatives.

    Attributes
    ----------
    value : of the loss; by_parameters : (q,)
    start_positions, start_velocities : by name of the body, (n, 3) by where and how fast its vertices start [1/m],
        [s/m]; pins hold vertices where they start
    moduli : by name of the body, (m,) by the logarithm of all moduli of each tet, if asked for
    rest_positions : by name of the body, (n, 3) by its mesh's vertices, from whose places it starts [1/m], if asked for
    """

    value: float
    by_parameters: Floats
    start_positions: dict[str, Floats]
    start_velocities: dict[str, Floats]
    moduli: dict[str, Floats]
    rest_positions: dict[str, Floats]


class Sensitivity:
    """A loss over a simulation with `Implicit`, as a function of parameters, with its gradient.

    Parameters
    ----------
    scene_of : parameters (q,) -> Scene. All that depends on them is differentiated: moduli, densities, friction, loads,
        laws over time, rest shapes, starts. The meshes have the same vertices and tets for all parameters.
    loss : a `Misfit`, or a function: frame -> None, or the loss's share of that frame and its derivatives by
        `frame.positions`, (n, 3) by name of the body; or several of both, which are added.
    solver : an `Implicit`. Its `tolerance` limits what the gradient is worth: it is that of each step's exact minimum.
        Where things touch, runs differ a little from those of `simulate`: areas of contacts are those of the end of
        each step, and without `friction_iterations` normal forces of friction are those of its beginning.
    dt, steps : time from frame to frame [s], and their number.
    scales : (q,) sizes of the parameters, in the unit of each, whose 1e-5 is the step of differences at fixed states;
        None: the parameters, and 1 where one is zero.

    Raises
    ------
    SceneError, SolverError : as `simulate`; and where the solver or the scene has what is not differentiated.
    """

    def __init__(
        self,
        scene_of: Callable[[Floats], Scene],
        loss: Misfit | OwnLoss | Sequence[Misfit | OwnLoss],
        solver: Implicit,
        dt: float,
        steps: int,
        *,
        scales: ArrayLike | None = None,
    ) -> None:
        if not isinstance(solver, Implicit):
            raise SolverError(
                f"Sensitivity: {type(solver).__name__} has no equations that hold at the end of a step; "
                "give Implicit(...)"
            )
        self.dt, self.steps = check_timing("Sensitivity", dt, steps)
        self.scene_of, self.loss, self.solver = scene_of, Loss.of(loss), _with_definite_friction(solver)
        self.scales = None if scales is None else np.asarray(scales, dtype=np.float64)
        for misfit in self.loss.misfits:
            misfit.frames(self.steps)

    def value(self, p: ArrayLike) -> float:
        """The loss at parameters (q,)."""
        return self.value_and_structure(p)[0]

    def value_and_structure(self, p: ArrayLike) -> tuple[float, list[dict[str, float]]]:
        """The loss, and what does not change smoothly with parameters: numbers of each frame by what they are of."""
        total, found = 0.0, []
        first, workspace = self._begun(_vector(p))
        for frame in self._frames(first, workspace):
            total += self.loss.at(frame, self.steps, workspace.system)[0]
            of = frame.report.details
            stiffness = of.contact_stiffness or 0.0
            found.append({"substeps": of.substeps, "contacts": of.contacts, "Pa of contact's stiffness": stiffness})
        return total, found

    def residuals(self, p: ArrayLike) -> Floats:
        """(r,) of all misfits, frame by frame; the loss is the sum of their squares."""
        found = [np.zeros(0)]
        for frame in self._frames(*self._begun(_vector(p))):
            found += [misfit.residuals(frame, row).ravel() for misfit, row in self.loss.rows(frame.index, self.steps)]
        return np.concatenate(found)

    def residuals_and_jacobian(self, p: ArrayLike) -> tuple[Floats, Floats]:
        """(r,) as `residuals`, and their derivatives (r, q), from one run that carries those of its states along.

        For a few parameters and many readings, as least squares have. The gradient of the loss is 2 J^T r.
        """
        p = _vector(p)
        first, workspace = self._begun(p)
        workspace.tape = tape = []
        sides, scenes = [], []
        for k in range(len(p)):
            (one, above), (other, below) = self._both(p, k, workspace)
            sides.append(side := Side(_STEP * float(self.sizes(p)[k]), above, below, one.state, other.state))
            scenes.append((one.system, other.system, 2.0 * side.step))
        at = [StateTangent.start(side, first.state) for side in sides]
        contact = any(misfit.quantity == "contact" for misfit in self.loss.misfits)
        residuals, columns, change = [np.zeros(0)], [np.zeros((0, len(p)))], 0.0
        for frame in self._frames(first, workspace):
            for number, taken in enumerate(tape):
                replay = Replay.of(Kept.of(taken, number == 0), workspace)
                change, equations = max(change, replay.imbalance()), Equations.of(replay)
                pairs = zip(sides, at, strict=True)
                at = [step_tangent(replay, equations, side, one, contact=contact) for side, one in pairs]
            tape.clear()
            changes, at = at, [one.with_vertices(len(first.state.positions)) for one in at]
            for misfit, row in self.loss.rows(frame.index, self.steps):
                residuals.append(misfit.residuals(frame, row).ravel())
                pairs = zip(changes, scenes, strict=True)
                found = [misfit.tangents(frame, row, workspace.system, *pair) for pair in pairs]
                columns.append(np.stack(found, axis=1))
        _warn_of(change)
        return np.concatenate(residuals), np.concatenate(columns)

    def value_and_gradient(self, p: ArrayLike) -> tuple[float, Floats]:
        """The loss at parameters (q,), and its derivatives (q,)."""
        found = self.gradient(p)
        return found.value, found.by_parameters

    def gradient(
        self, p: ArrayLike, parameters: Sequence[int] | None = None, *, moduli: bool = False, rest: bool = False
    ) -> Gradient:
        """The loss at parameters (q,) and its derivatives.

        Parameters
        ----------
        parameters : numbers of those to differentiate by; None: all. Each costs two evaluations of each step's forces.
        moduli, rest : whether to differentiate by the moduli of every tet, and by rest positions: in all, two passes
            each over the tets of each step. Contact's areas count as constant.
        """
        p = _vector(p)
        first, workspace = self._begun(p)
        workspace.tape = tape = []
        total, kept, seeds = 0.0, [], []
        for frame in self._frames(first, workspace):
            value, at_frame = self.loss.at(frame, self.steps, workspace.system)
            total += value
            kept.append([Kept.of(taken, k == 0) for k, taken in enumerate(tape)])
            seeds.append(at_frame)
            tape.clear()
        workspace.tape = None
        steps, begin = _backwards(kept, seeds, workspace, first.state)
        system = first.system
        starts = by_anchors(system, steps, begin.x)
        by_moduli, by_rest = fields_of(workspace, steps, self.solver, moduli=moduli, rest=rest)
        chosen = range(len(p)) if parameters is None else parameters
        of_scene = [one for at_frame in seeds for one in at_frame.of_scene]
        by_parameters = np.array([self._derivative(p, k, steps, begin, of_scene, workspace) for k in chosen])
        of_moduli = {part.name: by_moduli[part.tets] for part in system.bodies} if moduli else {}
        shapes = {}
        for part in system.bodies if rest else ():
            turn = rotation_matrix(part.body.rotation)
            shapes[part.name] = by_rest[part.vertices] + starts[part.vertices] @ turn
        own = {part.name: (starts[part.vertices], begin.v[part.vertices]) for part in system.bodies}
        places, rates = ({name: both[k] for name, both in own.items()} for k in (0, 1))
        return Gradient(total, by_parameters, places, rates, of_moduli, shapes)

    def check(self, p: ArrayLike, directions: int = 2, *, step: float = 1e-4, seed: int = 0) -> Check:
        """Compare with central differences of whole runs along random directions.

        Where they do not agree, further runs with smaller steps and a sharper `tolerance` say why: `Check.verdict`.

        Parameters
        ----------
        step : of the differences, as a share of the parameters or their `scales`.
        """
        p = _vector(p)
        ways = np.random.default_rng(seed).standard_normal((directions, len(p))) * self.sizes(p)
        return check(self, p, self.sizes(p)[None] if directions == len(p) == 1 else ways, step)

    def torch(self) -> Callable[[Any], Any]:
        """The loss as a function of a PyTorch tensor of parameters (q,), in the unit of each, for `backward()`.

        It gives a tensor of 64 bits on the device of the parameters. The simulation runs on the processor.

        Raises
        ------
        SuppleError : where PyTorch is not installed.
        """
        return torch_function(self)

    def jax(self) -> Callable[[Any], Any]:
        """The loss as a function of a JAX array of parameters (q,), in the unit of each, for `jax.grad` and `jax.jit`.

        Set `jax_enable_x64` for results of 64 bits.

        Raises
        ------
        SuppleError : where JAX is not installed.
        """
        return jax_function(self)

    def sizes(self, p: Floats) -> Floats:
        """(q,) the scales of parameters, in the unit of each."""
        return np.where(p == 0.0, 1.0, np.abs(p)) if self.scales is None else np.broadcast_to(self.scales, p.shape)

    def _begun(self, p: Floats) -> tuple[Frame, Workspace]:
        scene = self._scene(p)
        first, workspace = prepared(scene, initial_state(scene), self.solver)
        refuse(first.system, self.solver)
        workspace.settle = settle
        return first, workspace

    def _scene(self, p: Floats) -> Scene:
        scene = self.scene_of(p)
        if not isinstance(scene, Scene):
            raise SceneError(f"Sensitivity: scene_of gives a {type(scene).__name__}; give a Scene")
        return scene

    def _frames(self, first: Frame, workspace: Workspace) -> Any:
        for frame in frames_from(first, self.dt, self.steps, workspace, None, [], True):
            if frame.system is not first.system:
                raise SolverError(f"gradient: stitches break in frame {frame.index}; what breaks has no derivative")
            yield frame

    def _derivative(
        self,
        p: Floats,
        k: int,
        steps: list[tuple[Kept, StepAdjoint]],
        begin: StateAdjoint,
        of_scene: list[OfScene],
        at: Workspace,
    ) -> float:
        """By parameter k, at fixed states: no step is taken."""
        sides = []
        for first, workspace in self._both(p, k, at):
            values = [adjoint.value(Replay.of(one, workspace)) for one, adjoint in steps]
            values += [one(first.system) for one in of_scene]
            start = first.state
            values += [float(np.einsum("ij,ij->", begin.x[: len(start.positions)], start.positions))]
            values += [float(np.einsum("ij,ij->", begin.v[: len(start.positions)], start.velocities))]
            sides.append(np.array(values))
        return float((sides[0] - sides[1]).sum() / (2.0 * _STEP * self.sizes(p)[k]))

    def _both(self, p: Floats, k: int, at: Workspace) -> list[tuple[Frame, Workspace]]:
        """The scenes on both sides of parameter k."""
        found = []
        for sign in (1.0, -1.0):
            there = p.copy()
            there[k] += sign * _STEP * self.sizes(p)[k]
            scene = self._scene(there)
            first = first_frame(scene, initial_state(scene), self.solver)
            workspace = self.solver.prepare(first.system, at.tools) if _are_alike(first.system, at.system) else None
            if workspace is None or not _are_alike(workspace.system, at.system, whole=True):
                raise SceneError(
                    f"Sensitivity: parameter {k} changes which tets, pins or welds the scene has; keep them"
                )
            found.append((first, workspace))
        return found


def _with_definite_friction(solver: Implicit) -> Implicit:
    """With normal forces of friction that do not depend on when the solver updates them."""
    contact = solver.contact
    if contact is None or contact.friction_iterations is not None:
        return solver
    return replace(solver, contact=replace(contact, friction_iterations=1))


def _are_alike(one: System, other: System, *, whole: bool = False) -> bool:
    """Whether two systems have the same vertices to solve for, and the same elements."""
    pairs = [(one.tets, other.tets)]
    if whole:
        pairs += [(one.elements, other.elements), (one.pinned_vertices, other.pinned_vertices)]
        pairs += [(one.welding.vertices, other.welding.vertices)]
    return all(np.array_equal(a, b) for a, b in pairs)


def _backwards(
    kept: list[list[Kept]], seeds: list[Seeds], workspace: Workspace, start: State
) -> tuple[list[tuple[Kept, StepAdjoint]], StateAdjoint]:
    """All substeps with their adjoints, and the adjoint of the state at the start."""
    n = len(start.positions)
    at, found = StateAdjoint.zeros(n, len(kept[0][0].before.internal) if kept else 0), []
    bodies_end, changes = workspace.bodies_end, [0.0]
    for some, given in zip(reversed(kept), reversed(seeds), strict=True):
        at.x += given.x
        at.v += given.v
        whole = len(some[-1].x)
        at, by_forces = at.with_vertices(whole), given.forces
        for one in reversed(some):
            replay = Replay.of(one, workspace)
            adjoint, at = step_adjoint(replay, at, by_forces)
            found.append((replay.searched, adjoint))
            changes.append(replay.imbalance())
            by_forces = ForceAdjoint.zeros(whole, len(one.held))
        for values in (at.x, at.v):
            placed = np.zeros_like(values)
            placed[n:bodies_end] = values[n:bodies_end]  # points of rigid bodies that something is stitched to
            values += workspace.system.welding.reduced(placed)
        past = at.past_x, at.past_v
        at = at.with_vertices(n)
        at.past_x, at.past_v = past
    _warn_of(max(changes))
    return found[::-1], at


def _warn_of(imbalance: float) -> None:
    """Warn where areas of contacts, or normal forces of friction, were so far from those of a step's end."""
    if imbalance > _BALANCED:
        warnings.warn(
            f"gradient: areas of contacts and forces of friction are up to {100.0 * imbalance:.2g} % of contact's "
            "forces away from those at the end of a step, and the gradient is wrong by more than that; give a shorter "
            "dt, and no friction_iterations but 1, see docs/theory/gradients.md",
            SuppleWarning,
            stacklevel=3,
        )


def _vector(p: ArrayLike) -> Floats:
    values = np.atleast_1d(np.asarray(p, dtype=np.float64)).copy()
    if values.ndim != 1 or not np.isfinite(values).all():
        raise SceneError("Sensitivity: give the parameters as a vector of finite numbers")
    return values
