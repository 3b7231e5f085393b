"""Solvers of a scene file, by `kind`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from supple.app.scene_file.model import Model, Positive
from supple.app.scene_file.validation_errors import suggestion
from supple.errors import SolverError
from supple.solvers.solver import Solver

Iterations = Annotated[int, Field(ge=1, le=100_000)]
Share = Annotated[float, Field(gt=0, lt=1)]


class XPBDContactModel(Model):
    """Contact of bodies with each other and with themselves. Contact with obstacles does not depend on it."""

    thickness: Positive | None = Field(
        default=None, description="gap between surfaces [m]; default: a twentieth of the mean surface edge"
    )
    body_collision: bool = Field(default=True, description="whether bodies collide with each other")
    self_collision: bool = Field(default=True, description="whether a body collides with itself")


class XPBDModel(Model):
    """Extended position-based dynamics in small steps: fast, robust, approximate."""

    kind: Literal["xpbd"]
    substeps: Iterations | Literal["auto"] = Field(
        default="auto", description="per frame, each with one sweep over all constraints; auto: what the frame needs"
    )
    momentum_restore: bool = Field(default=True, description="false: the momentum errors of XPBD are not corrected")
    contact: XPBDContactModel | None = Field(
        default_factory=XPBDContactModel, description="of bodies with each other and themselves; null turns it off"
    )
    threads: int | None = Field(default=None, ge=1, le=1024, description="default: chosen by the size of the scene")
    accuracy: Share = Field(default=0.02, description="the share of its stiffness that a body may lack")
    max_substeps: Iterations = Field(default=1000, description="the largest automatic number of substeps")
    start: Literal["refuse", "push_out"] = Field(
        default="refuse", description="bodies that begin inside of something: an error, or slowly pushed out"
    )
    sleep_after: Positive | None = Field(
        default=0.5, description="how long a body stays at its place before it sleeps [s]; null keeps all awake"
    )

    def build(self) -> Solver:
        from supple.solvers.xpbd.contact.settings import XPBDContact
        from supple.solvers.xpbd.solver import XPBD

        contact = None if self.contact is None else XPBDContact(**self.contact.model_dump())
        return XPBD(**self.model_dump(exclude={"kind", "contact"}), contact=contact)


class ContactModel(Model):
    """Incremental potential contact: surfaces never intersect."""

    dhat: Positive | None = Field(
        default=None, description="distance below which surfaces repel each other [m]; default: from the bodies"
    )
    stiffness: Positive | Literal["adaptive"] = Field(
        default="adaptive", description="pressure scale of the barrier [Pa]; adaptive: from the bodies' moduli"
    )
    friction_velocity: Positive | None = Field(
        default=None, description="relative velocity below which friction is static [m/s]; default: from the bodies"
    )
    friction_iterations: Iterations | None = Field(
        default=None, description="updates of friction's normal forces in a step; null: until they change by under 10 %"
    )


class ImplicitModel(Model):
    """Implicit finite elements by projected Newton: no tetrahedron inverts, no surfaces intersect."""

    kind: Literal["implicit"]
    integrator: Literal["backward_euler", "bdf2", "newmark", "static"] = Field(default="backward_euler")
    tolerance: Positive | None = Field(
        default=None, description="of Newton's step, relative to the smallest body [1/s]"
    )
    force_tolerance: Share = Field(default=1e-4, description="forces left over where surfaces touch, over contact's")
    max_iterations: Iterations = Field(default=120, description="of Newton in one step")
    linear_solver: Literal["auto", "pcg", "direct"] = Field(default="auto")
    max_substeps: Iterations = Field(default=64, description="a failed step is halved, up to this number of substeps")
    path_tolerance: Positive = Field(default=0.05, description="how far scripts go off a line, over the smallest body")
    volume_kept: Share = Field(default=0.2, description="share of its volume that a tet keeps in one iteration")
    barrier_onset: float = Field(default=0.1, gt=0, le=1, description="J below which a barrier against inversion acts")
    contact: ContactModel | None = Field(
        default_factory=ContactModel, description="of bodies with all obstacles, each other and themselves; null: none"
    )

    def build(self) -> Solver:
        from supple.solvers.implicit.contact.settings import IPCContact
        from supple.solvers.implicit.solver import Implicit

        contact = None if self.contact is None else IPCContact(**self.contact.model_dump())
        return Implicit(**self.model_dump(exclude={"kind", "contact"}), contact=contact)


SolverModel = Annotated[XPBDModel | ImplicitModel, Field(discriminator="kind")]

_KINDS: dict[str, type[XPBDModel] | type[ImplicitModel]] = {"xpbd": XPBDModel, "implicit": ImplicitModel}


def model_of_kind(kind: str) -> XPBDModel | ImplicitModel:
    """The solver of that kind, with its default parameters, as a scene file describes it.

    Raises
    ------
    SolverError : where there is no such kind.
    """
    if kind not in _KINDS:
        raise SolverError(f"there is no solver {kind!r}; {suggestion(kind, _KINDS)}")
    return _KINDS[kind](kind=kind)  # pyright: ignore[reportArgumentType]


def solver_of_kind(kind: str) -> Solver:
    """The solver of that kind, with its default parameters.

    Raises
    ------
    SolverError : where there is no such kind.
    """
    return model_of_kind(kind).build()
