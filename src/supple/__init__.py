"""Supple: tetrahedral soft bodies. A surface mesh goes in; a simulation that can be trusted comes out.

Everything public is here: `import supple as sp`. Names are loaded when first used, so the import itself is quick.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

_HOME = {
    "ARAP": "supple.materials.arap",
    "Body": "supple.scene.body",
    "Box": "supple.scene.obstacles.box",
    "Capsule": "supple.scene.obstacles.capsule",
    "CheckReport": "supple.output.check.report",
    "CheckResult": "supple.output.check.report",
    "CheckSettings": "supple.output.check.settings",
    "CommandError": "supple.errors",
    "ContactPair": "supple.scene.contact_pairs",
    "XPBDContact": "supple.xpbd.contact.settings",
    "Cylinder": "supple.scene.obstacles.cylinder",
    "EdgesAndVolume": "supple.materials.edges_and_volume",
    "Embedding": "supple.mesh.skin",
    "FixedCorotated": "supple.materials.fixed_corotated",
    "Force": "supple.scene.forces",
    "Frame": "supple.simulate",
    "HalfSpace": "supple.scene.obstacles.half_space",
    "IPCContact": "supple.implicit.contact.settings",
    "ContactPoints": "supple.contact_points",
    "Implicit": "supple.implicit.solver",
    "InBox": "supple.scene.selection",
    "Keyframes": "supple.scene.motion",
    "MeshError": "supple.errors",
    "MeshingError": "supple.errors",
    "NeoHookean": "supple.materials.neo_hookean",
    "NullSink": "supple.simulate",
    "OutputError": "supple.errors",
    "Pin": "supple.scene.pins",
    "ProgressBar": "supple.output.progress",
    "Recorder": "supple.output.recording.recorder",
    "Recording": "supple.output.recording.reader",
    "Regions": "supple.materials.regions",
    "Report": "supple.simulate",
    "Scene": "supple.scene.scene",
    "SceneError": "supple.errors",
    "SoftTarget": "supple.scene.forces",
    "SoftVertexTriangleStitch": "supple.scene.stitches.vertex_triangle",
    "SolverError": "supple.errors",
    "Sphere": "supple.scene.obstacles.sphere",
    "StVenantKirchhoff": "supple.materials.st_venant_kirchhoff",
    "StableNeoHookean": "supple.materials.stable_neo_hookean",
    "State": "supple.state",
    "Status": "supple.state",
    "SuppleError": "supple.errors",
    "SurfaceMesh": "supple.mesh.surface",
    "SurfaceReport": "supple.mesh.surface_checks",
    "TetMesh": "supple.mesh.tetmesh",
    "TriangleObstacle": "supple.scene.obstacles.triangle_obstacle",
    "VertexEdgeStitch": "supple.scene.stitches.vertex_edge",
    "VertexVertexStitch": "supple.scene.stitches.vertex_vertex",
    "XPBD": "supple.xpbd.solver",
    "check_recording": "supple.output.check.checker",
    "export": "supple.output.export.exporter",
    "largest_noninverting_step": "supple.implicit.limits.step_filter",
    "load_run": "supple.scene_file.loader",
    "load_scene": "supple.scene_file.loader",
    "plot_recording": "supple.output.plots",
    "read_recording": "supple.output.recording.reader",
    "read_tetgen": "supple.mesh.io.tetgen_files",
    "repair_surface": "supple.mesh.meshing.repair",
    "rotation_variant_svd": "supple.numerics.svd3",
    "simulate": "supple.simulate",
    "smallest_positive_cubic_root": "supple.numerics.cubic",
    "tetrahedralize": "supple.mesh.meshing.tetrahedralize",
    "write_page": "supple.output.page",
    "write_tetgen": "supple.mesh.io.tetgen_files",
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
    from supple.contact_points import ContactPoints
    from supple.errors import (
        CommandError,
        MeshError,
        MeshingError,
        OutputError,
        SceneError,
        SolverError,
        SuppleError,
    )
    from supple.implicit.contact.settings import IPCContact
    from supple.implicit.limits.step_filter import largest_noninverting_step
    from supple.implicit.solver import Implicit
    from supple.materials.arap import ARAP
    from supple.materials.edges_and_volume import EdgesAndVolume
    from supple.materials.fixed_corotated import FixedCorotated
    from supple.materials.neo_hookean import NeoHookean
    from supple.materials.regions import Regions
    from supple.materials.st_venant_kirchhoff import StVenantKirchhoff
    from supple.materials.stable_neo_hookean import StableNeoHookean
    from supple.mesh import shapes
    from supple.mesh.io.tetgen_files import read_tetgen, write_tetgen
    from supple.mesh.meshing.repair import repair_surface
    from supple.mesh.meshing.tetrahedralize import tetrahedralize
    from supple.mesh.skin import Embedding
    from supple.mesh.surface import SurfaceMesh
    from supple.mesh.surface_checks import SurfaceReport
    from supple.mesh.tetmesh import TetMesh
    from supple.numerics.cubic import smallest_positive_cubic_root
    from supple.numerics.svd3 import rotation_variant_svd
    from supple.output.check.checker import check_recording
    from supple.output.check.report import CheckReport, CheckResult
    from supple.output.check.settings import CheckSettings
    from supple.output.export.exporter import export
    from supple.output.page import write_page
    from supple.output.plots import plot_recording
    from supple.output.progress import ProgressBar
    from supple.output.recording.reader import Recording, read_recording
    from supple.output.recording.recorder import Recorder
    from supple.scene.body import Body
    from supple.scene.contact_pairs import ContactPair
    from supple.scene.forces import Force, SoftTarget
    from supple.scene.motion import Keyframes
    from supple.scene.obstacles.box import Box
    from supple.scene.obstacles.capsule import Capsule
    from supple.scene.obstacles.cylinder import Cylinder
    from supple.scene.obstacles.half_space import HalfSpace
    from supple.scene.obstacles.sphere import Sphere
    from supple.scene.obstacles.triangle_obstacle import TriangleObstacle
    from supple.scene.pins import Pin
    from supple.scene.scene import Scene
    from supple.scene.selection import InBox
    from supple.scene.stitches.vertex_edge import VertexEdgeStitch
    from supple.scene.stitches.vertex_triangle import SoftVertexTriangleStitch
    from supple.scene.stitches.vertex_vertex import VertexVertexStitch
    from supple.scene_file.loader import load_run, load_scene
    from supple.simulate import Frame, NullSink, Report, simulate
    from supple.state import State, Status
    from supple.xpbd.contact.settings import XPBDContact
    from supple.xpbd.solver import XPBD
