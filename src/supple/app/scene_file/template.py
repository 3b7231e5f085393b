"""The text of a new scene file: complete, with the most used keys and what they mean."""

from __future__ import annotations

import json

import numpy as np
from numpy.typing import NDArray

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
    mesh: {{file: {file}, scale: {scale}, tets: {tets}{repair}}}   # scale: 0.001 for a file in millimetres
"""

_REST = """\
    material:
      kind: stable_neo_hookean   # or neo_hookean, fixed_corotated, arap, st_venant_kirchhoff, edges_and_volume
      youngs: {youngs}                # stiffness [Pa]: 1e4 is jelly, 1e6 is rubber
      poisson: 0.4               # 0 to below 0.5; near 0.5 the volume stays
      density: 1000              # [kg/m^3]
      damping: 0.01              # [s]; 0 rings
    position: [{x}, {height}, {z}]
    friction: 0.5

obstacles:
  - {{kind: half_space, name: floor, friction: 0.5}}   # everything below y = 0

# pins:                                  # vertices that are held, or moved
#   - body: {body}
#     box: {{low: [-1, 0, -1], high: [1, {height}, 1]}}
#     motion: {{times: [0, 1], displacements: [[0, 0, 0], [0, {radius}, 0]]}}

gravity: [0, -9.81, 0]

solver: {{kind: xpbd}}   # fast; kind: implicit is exact: no tet inverts, no surfaces cross
dt: 1/60               # from frame to frame
steps: 120             # frames
output: {{page: true, plot: true}}
"""


# The sag of a body under its own weight, as a part of its size, is about density * gravity * size / youngs.
_SOFTEST, _LARGEST_SAG, _WEIGHT = 5e4, 0.05, 1000.0 * 9.81


def new_scene(name: str, *, radius: float = 0.1) -> str:
    """The text of a scene with a ball of `radius` [m] above a floor; `name` of the file is for its comments."""
    values = {"body": "ball", "radius": f"{radius:.4g}", "edge": f"{radius / 2.5:.4g}", "height": f"{2 * radius:.4g}"}
    return _text(name, _SHAPE, youngs=_youngs(2 * radius), x="0", z="0", **values)


def new_scene_of(
    name: str,
    file: str,
    body: str,
    scale: float,
    box: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    tets: int,
    repair: bool = False,
) -> str:
    """The text of a scene with the surface in `file`, multiplied by `scale`, above the middle of a floor.

    Parameters
    ----------
    name : of the scene file, for its comments
    file : of the surface, relative to the scene file; body : name of the body
    scale : factor of coordinates; box : lowest and highest coordinates (3,), (3,) of the surface after scaling [m]
    tets : the number to fill it with; repair : whether to repair the surface first
    """
    low, high = box
    size, middle = float((high - low).max()), 0.5 * (low + high)
    values = {
        "file": json.dumps(file),
        "scale": f"{scale:g}",
        "tets": str(tets),
        "repair": ", repair: true" if repair else "",
        "height": f"{0.1 * size - low[1]:.4g}",
        "x": f"{-middle[0] + 0.0:.4g}",
        "z": f"{-middle[2] + 0.0:.4g}",
        "radius": f"{size / 2:.4g}",
        "youngs": _youngs(size),
    }
    return _text(name, _MESH, body=json.dumps(body), **values)


def _youngs(size: float) -> str:
    """Soft, but stiff enough to stand: Young's modulus [Pa] of a body of a size [m]."""
    return f"{max(_SOFTEST, _WEIGHT * size / _LARGEST_SAG):.0e}".replace("e+0", "e").replace("e+", "e")


def _text(name: str, entry: str, **values: str) -> str:
    return _HEAD.format(name=name) + entry.format(**values) + _REST.format(**values)
