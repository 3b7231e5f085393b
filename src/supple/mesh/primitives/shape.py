"""Shapes by name: functions whose parameters have forms, which scene files name by their `kind`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from supple.kinds.described import plain_type
from supple.kinds.kind import declared
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

Make = TypeVar("Make", bound=Callable[..., TetMesh | SurfaceMesh])

SHAPES: dict[str, Callable[..., TetMesh]] = {}
SURFACES: dict[str, Callable[..., SurfaceMesh]] = {}


def shape(make: Make) -> Make:
    """A function that makes tets as a shape of scene files, or one `NAME_surface` as that of a surface."""
    declared(make)  # while the forms are there: who asks for help sees plain types
    make.__annotations__ = {name: plain_type(hint) for name, hint in make.__annotations__.items()}
    kinds: dict[str, Any] = SHAPES
    make.kind = make.__name__.removesuffix("_surface")  # pyright: ignore[reportFunctionMemberAccess]
    if make.__annotations__["return"] == "SurfaceMesh":
        kinds = SURFACES
    kinds[make.kind] = make  # pyright: ignore[reportFunctionMemberAccess]
    return make


def surface_of(kind: str, values: dict[str, object]) -> SurfaceMesh | TetMesh:
    """The surface of a shape with these parameters; its tets where the surface has other parameters, or none."""
    tets, surface = SHAPES[kind], SURFACES.get(kind)
    if surface is not None and declared(surface).keys() == declared(tets).keys():
        return surface(**values)
    return tets(**values)
