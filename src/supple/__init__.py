"""Supple: tetrahedral soft bodies. A surface mesh goes in; a simulation that can be trusted comes out.

Everything public is here: `import supple as sp`. Names are loaded when first used, so the import itself is quick.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

_HOME = {
    "Body": "supple.scene.body",
    "Box": "supple.scene.obstacles",
    "EdgesAndVolume": "supple.materials.edges_and_volume",
    "Frame": "supple.simulate",
    "HalfSpace": "supple.scene.obstacles",
    "InBox": "supple.scene.pins",
    "Keyframes": "supple.scene.motion",
    "MeshError": "supple.errors",
    "MeshingError": "supple.errors",
    "OutputError": "supple.errors",
    "Pin": "supple.scene.pins",
    "Scene": "supple.scene.scene",
    "SceneError": "supple.errors",
    "SolverError": "supple.errors",
    "Sphere": "supple.scene.obstacles",
    "StableNeoHookean": "supple.materials.stable_neo_hookean",
    "SuppleError": "supple.errors",
    "SurfaceMesh": "supple.mesh.surface",
    "TetMesh": "supple.mesh.tetmesh",
    "TriangleObstacle": "supple.scene.obstacles",
    "simulate": "supple.simulate",
}
_MODULES = {"shapes": "supple.mesh.shapes"}

__version__ = "0.1.0"
__all__ = [*_HOME, *_MODULES, "__version__"]  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        value = getattr(import_module(_HOME[name]), name)
    elif name in _MODULES:
        value = import_module(_MODULES[name])
    else:
        raise AttributeError(f"module 'supple' has no attribute {name!r}")
    globals()[name] = value
    return value


class _Package(ModuleType):
    """Keeps `supple.simulate` the function, also after something has imported the module of that name."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __dir__() -> list[str]:
    return sorted(__all__)


if TYPE_CHECKING:
    from supple.errors import MeshError, MeshingError, OutputError, SceneError, SolverError, SuppleError
    from supple.materials.edges_and_volume import EdgesAndVolume
    from supple.materials.stable_neo_hookean import StableNeoHookean
    from supple.mesh import shapes
    from supple.mesh.surface import SurfaceMesh
    from supple.mesh.tetmesh import TetMesh
    from supple.scene.body import Body
    from supple.scene.motion import Keyframes
    from supple.scene.obstacles import Box, HalfSpace, Sphere, TriangleObstacle
    from supple.scene.pins import InBox, Pin
    from supple.scene.scene import Scene
    from supple.simulate import Frame, simulate
