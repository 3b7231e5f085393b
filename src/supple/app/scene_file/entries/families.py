"""Materials and solvers of a scene file, by `kind`."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

from supple.app.scene_file.entries import spelling as spelling  # registers how values are written
from supple.app.scene_file.entries.kinds import KindModel, entry_of, model_of
from supple.app.scene_file.validation_errors import suggestion
from supple.errors import SolverError
from supple.kinds.kind import declared
from supple.materials.by_law import ByLaw
from supple.materials.elastic import EdgesAndVolume
from supple.materials.j2_plastic import J2Plastic
from supple.materials.material import Material
from supple.materials.registry import UNRELAXED
from supple.materials.viscoelastic import Viscoelastic
from supple.solvers.auto import Auto
from supple.solvers.implicit.solver import Implicit
from supple.solvers.solver import Solver
from supple.solvers.xpbd.solver import XPBD

ELASTIC: tuple[type[Material], ...] = (*UNRELAXED, J2Plastic, Viscoelastic)
MATERIALS: tuple[type[Material], ...] = (EdgesAndVolume, *ELASTIC)
BY_LAW_KINDS: dict[str, type[ByLaw]] = {kind.kind: kind for kind in UNRELAXED if issubclass(kind, ByLaw)}

if TYPE_CHECKING:
    ElasticMaterialModel = MaterialModel = KindModel
else:
    ElasticMaterialModel, MaterialModel = entry_of(ELASTIC), entry_of(MATERIALS)


def scene_file_line(material: ByLaw) -> str:
    """A rubber as a scene file has it, with the parameters of its class; density and damping are left out."""
    skipped = {field.name for field in fields(Material)}
    values = {key: getattr(material, key) for key in declared(type(material)) if key not in skipped}
    texts = [f"{key}: {list(value) if isinstance(value, tuple) else float(value)}" for key, value in values.items()]
    return f"{{kind: {material.kind}, {', '.join(texts)}}}"


SOLVERS: tuple[type[Solver | Auto], ...] = (XPBD, Implicit, Auto)


def solver_of_kind(kind: str) -> Solver | Auto:
    """The solver of that kind, with its default parameters.

    Raises
    ------
    SolverError : where no such kind exists.
    """
    known = {solver.kind: solver for solver in SOLVERS}
    if kind not in known:
        raise SolverError(f"solver {kind!r} does not exist; {suggestion(kind, known)}")
    return known[kind]()


def model_of_kind(kind: str) -> KindModel:
    """The solver of that kind, with its default parameters, as a scene file describes it.

    Raises
    ------
    SolverError : where no such kind exists.
    """
    return model_of(type(solver_of_kind(kind)), True).model_validate({"kind": kind})
