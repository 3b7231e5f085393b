"""The text of a new scene file, complete, with the most used keys and what they mean.

A mesh file becomes a soft body above a floor, with a size, a material and a number of tets chosen for it; or a shell.
"""

from __future__ import annotations

import json
import logging
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.app.scene_file.yaml_files import YamlDocument, parse_yaml
from supple.errors import MeshError, SceneError
from supple.mesh.mesh_file import load_mesh
from supple.mesh.meshing.child_process import DEFAULT_TETS
from supple.mesh.meshing.units import likely_scale
from supple.mesh.shell_mesh import ShellMesh
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.solvers.auto import Counts, suits_xpbd
from supple.solvers.xpbd.assessment.softening import FACTOR
from supple.solvers.xpbd.substeps import FEWEST

_HEAD = """\
# A scene of Supple. Lengths are in metres, masses in kg, times in s, moduli in Pa; y is up.
#   supple info {name}     what is in it, and whether anything is wrong
#   supple view {name}     simulates it on a page, where bodies can be dragged
#   supple run {name}      simulates it into the folder out
# docs/reference/scene_files.md describes all keys; `supple schema` writes them for editors with completion.

bodies:
"""

_SHAPE = """\
  - name: {body}
    shape: {{kind: sphere, radius: {radius}, edge_length: {edge}}}   # or mesh: {{file: part.stl}}
"""

_MESH = """\
  - name: {body}
    mesh: {{file: {file}, scale: {scale}{meshing}}}   # scale: 0.001 for a file in millimetres
"""

_SOFT = """\
    material:
      kind: stable_neo_hookean   # or neo_hookean, fixed_corotated, arap, st_venant_kirchhoff, edges_and_volume
      youngs: {youngs}                # stiffness [Pa]: 1e4 is jelly, 1e6 is rubber
      poisson: 0.4               # 0 to below 0.5; near 0.5 the volume stays
      density: 1000              # [kg/m^3]
      damping: 0.01              # [s]; 0 rings
"""

_SHELL = """\
    shell:                       # a thin sheet; the surface is its middle one, open or closed
      thickness: {thickness}           # [m]
      youngs: {youngs}                # stiffness [Pa]: 1e5 is soft, 1e6 is rubber
      poisson: 0.3               # 0 to 0.5
      density: 400               # [kg/m^3]
      damping: 0.01              # [s]; 0 rings
      # bending: 1e-6            # stiffness [N m]; without it, that of a homogeneous sheet: woven cloth has less
"""

_REST = """\
    position: [{x}, {height}, {z}]
    friction: 0.5

obstacles:
  - {{kind: half_space, name: floor, friction: 0.5}}   # everything below y = 0

# pins:                                  # vertices that are held, or moved
#   - body: {body}
#     box: {{low: [-1, 0, -1], high: [1, {height}, 1]}}
#     motion: {{times: [0, 1], displacements: [[0, 0, 0], [0, {radius}, 0]]}}

gravity: [0, -9.81, 0]

# {choice}
solver: {{kind: auto, accuracy: 0.1}}   # or xpbd: fast; a smaller accuracy is stiffer and slower; implicit: exact
dt: 1/60               # from frame to frame
steps: 120             # frames
output: {{page: true, plot: true}}
"""


# The sag of a body under its own weight, as a part of its size, is about density * gravity * size / youngs.
_SOFTEST, _LARGEST_SAG, _WEIGHT = 5e4, 0.05, 1000.0 * 9.81
# A shell stretches less: 1 % where it hangs. Its thickness, as a share of its size, is that of felt on a table; it is
# at most half of an edge, so that contact limits how sharply it folds.
_SHELL_SOFTEST, _SHELL_SAG, _SHELL_WEIGHT, _SHELL_THICKNESS = 1e5, 0.01, 400.0 * 9.81, 1 / 250


def new_scene(name: str, *, radius: float = 0.1) -> str:
    """The text of a scene with a ball of `radius` [m] above a floor; `name` of the file is for its comments."""
    values = {"body": "ball", "radius": f"{radius:.4g}", "edge": f"{radius / 2.5:.4g}", "height": f"{2 * radius:.4g}"}
    tets = 4.0 / 3.0 * np.pi * 2.5**3 * 6.0 * np.sqrt(2.0)
    choice = _choice(4.0 / 3.0 * np.pi * radius**3, int(tets), "ball", _youngs(2 * radius))
    return _text(name, _SHAPE + _SOFT, youngs=_youngs(2 * radius), x="0", z="0", choice=choice, **values)


def new_scene_of(
    name: str,
    file: str,
    body: str,
    scale: float,
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    volume: float,
    tets: int,
    meshing: str,
    sheet: SurfaceMesh | None = None,
) -> str:
    """The text of a scene with the mesh in `file`, multiplied by `scale`, above the middle of a floor.

    Parameters
    ----------
    name : of the scene file, for its comments
    file : of the mesh, relative to the scene file; body : name of the body
    scale : factor of coordinates; box : lowest and highest coordinates (3,), (3,) of the mesh after scaling [m]
    volume : that it encloses, after scaling [m^3]
    tets : about how many it has, or is filled with; meshing : further keys of the mesh, each after a comma
    sheet : of a shell, the surface before scaling; the three before say nothing of it
    """
    low, high = box
    size, middle = float((high - low).max()), 0.5 * (low + high)
    values = {
        "file": json.dumps(file),
        "scale": f"{scale:g}",
        "meshing": meshing,
        "height": f"{0.1 * size - low[1]:.4g}",
        "x": f"{-middle[0] + 0.0:.4g}",
        "z": f"{-middle[2] + 0.0:.4g}",
        "radius": f"{size / 2:.4g}",
        "body": json.dumps(body),
    }
    if sheet is not None:
        youngs = _modulus(max(_SHELL_SOFTEST, _SHELL_WEIGHT * size / _SHELL_SAG))
        ends = sheet.vertices[sheet.edges]
        edge = scale * float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))
        choice, thickness = (
            f"About {len(sheet.triangles):,} triangles.",
            f"{min(_SHELL_THICKNESS * size, 0.5 * edge):.1g}",
        )
        return _text(name, _MESH + _SHELL, **values, youngs=youngs, thickness=thickness, choice=choice)
    choice = _choice(volume, tets, body, _youngs(size))
    return _text(name, _MESH + _SOFT, youngs=_youngs(size), choice=choice, **values)


def _youngs(size: float) -> str:
    """Soft, but stiff enough to stand: Young's modulus [Pa] of a body of a size [m]."""
    return _modulus(max(_SOFTEST, _WEIGHT * size / _LARGEST_SAG))


def _modulus(value: float) -> str:
    return f"{value:.0e}".replace("e+0", "e").replace("e+", "e")


_ACCURACY, _DT, _POISSON, _DENSITY = 0.1, 1 / 60, 0.4, 1000.0  # of the text above
_THINNEST = 1e-3  # least volume of a part, over the cube of its size: a surface that is not closed has any volume
# Of the stiffest frequency of a tet in a mesh, squared, over (lam + mu / 2) / (density edge^2), where the edge is that
# of a regular tet of the mean volume: 2.4 to 3.2 in meshes of balls, boxes and bears.
_STIFFEST = 3.0


def _choice(volume: float, tets: int, body: str, youngs: str) -> str:
    """Which solver will suit the body, and why."""
    mu = float(youngs) / (2.0 * (1.0 + _POISSON))
    lam = 2.0 * mu * _POISSON / (1.0 - 2.0 * _POISSON)
    edge = (6.0 * np.sqrt(2.0) * volume / tets) ** (1.0 / 3.0)
    rate = FACTOR * _STIFFEST * (lam + 0.5 * mu) / (_DENSITY * edge**2)
    substeps = int(np.ceil(_DT * np.sqrt(rate * (1.0 - _ACCURACY) / _ACCURACY)))
    counts = Counts(max(substeps, FEWEST), body if substeps > FEWEST else "", tets)
    kind = "xpbd" if suits_xpbd(counts) else "implicit"
    return f"About {counts.tets:,} tets, and {counts}: auto is {kind} then (`supple info`)."


def _text(name: str, entry: str, **values: str) -> str:
    return _HEAD.format(name=name) + (entry + _REST).format(**values)


logger = logging.getLogger(__name__)


def read_surface_scene(path: str | Path, scale: float | None = None, shell: bool = False) -> YamlDocument:
    """The scene of a file of a surface or of tets, as if a scene file beside it described it; see `scene_of_surface`.

    Raises
    ------
    MeshError : where the file cannot be read.
    """
    path = Path(path)
    text, chosen = scene_of_surface(path, path.name, f"{path.stem}.yaml", scale, shell)
    logger.info("%s; to change it: supple new --surface %s%s", chosen, path, " --shell" if shell else "")
    return parse_yaml(text, path)


def scene_of_surface(
    surface: Path, file: str, name: str, scale: float | None = None, shell: bool = False
) -> tuple[str, str]:
    """The text of a scene file with the mesh in a file, and one line about what was chosen.

    Parameters
    ----------
    surface : the file; file : its path in the text
    name : of the scene file, for its comments
    scale : factor of coordinates; None: 0.001 where the surface is longer than 10 m, otherwise 1
    shell : whether it becomes a thin sheet

    Raises
    ------
    MeshError : where the file cannot be read, or a shell cannot have its surface. SceneError : where the scale is not
        above 0 and finite.
    """
    mesh = load_mesh(surface)
    loaded = mesh.surface if isinstance(mesh, TetMesh) else mesh
    used = likely_scale(loaded.vertices) if scale is None else scale
    if not 0.0 < used < np.inf:
        raise SceneError(f"scale must be a number above 0 and finite, not {used:g}")
    low, high = (used * corner for corner in loaded.bounds)
    body = re.sub(r"[^A-Za-z0-9_-]+", "_", surface.stem)[:50] or "body"
    tets = len(mesh.tets) if isinstance(mesh, TetMesh) else DEFAULT_TETS
    size = " x ".join(f"{value:.3g}" for value in high - low)
    unit = f", taken to be in millimetres (scale: {used:g})" if scale is None and used != 1.0 else ""
    if shell:
        try:
            sheet = _sheet(mesh)
        except MeshError as error:
            raise MeshError(f"{surface}: as a shell, {error}") from None
        text = new_scene_of(name, file, body, used, (low, high), volume=0, tets=0, meshing="", sheet=sheet)
        return text, f"{surface}: {size} m{unit}, a shell of {len(sheet.triangles):,} triangles"
    report = loaded.check()
    meshing = "" if mesh is not loaded else f", tets: {tets}" + (not report.ok) * ", repair: true"
    volume = max(abs(mesh.volume) * used**3, _THINNEST * float((high - low).max()) ** 3)
    text = new_scene_of(name, file, body, used, (low, high), volume=volume, tets=tets, meshing=meshing)
    if mesh is not loaded:
        return text, f"{surface}: {size} m{unit}, {tets:,} tets"
    line = f"{surface}: {size} m{unit}, {len(loaded.triangles):,} triangles, about {tets:,} tets"
    if not report.ok:
        line += f"; it is repaired first: {report.problems[0].partition(':')[0]}"
    return text, line


def _sheet(mesh: SurfaceMesh | TetMesh) -> SurfaceMesh:
    """The surface of a shell; raises `MeshError` where it cannot be one."""
    if isinstance(mesh, TetMesh):
        raise MeshError("it needs a surface, and this is a mesh of tets; give a file of triangles")
    return ShellMesh(mesh).surface
