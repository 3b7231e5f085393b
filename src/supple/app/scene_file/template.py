"""The text of a new scene file: complete, with the most used keys and what they mean."""

from __future__ import annotations

import json

_HEAD = """\
# A scene of Supple. Lengths are in metres, masses in kg, times in s, moduli in Pa; y is up.
#   supple info {name}     what is in it, and whether anything is wrong
#   supple view {name}     simulates it on a page, where bodies can be dragged
#   supple run {name}      simulates it into the folder out
# docs/scene_files.md describes all keys; `supple schema` writes them for editors with completion.

bodies:
"""

_SHAPE = """\
  - name: {body}
    shape: {{kind: sphere, radius: {radius}, edge_length: {edge}}}   # or mesh: {{file: part.stl}}
"""

_MESH = """\
  - name: {body}
    mesh: {{file: {file}, scale: {scale}, tets: 5000}}   # scale: 0.001 for a file in millimetres
"""

_REST = """\
    material:
      kind: stable_neo_hookean   # or neo_hookean, fixed_corotated, arap, st_venant_kirchhoff, edges_and_volume
      youngs: 5e4                # stiffness [Pa]: 1e4 is jelly, 1e6 is rubber
      poisson: 0.4               # 0 to below 0.5; near 0.5 the volume stays
      density: 1000              # [kg/m^3]
      damping: 0.01              # [s]; 0 rings
    position: [0, {height}, 0]
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


def new_scene(name: str, *, radius: float = 0.1) -> str:
    """The text of a scene with a ball of `radius` [m] above a floor; `name` of the file is for its comments."""
    return _text(
        name, _SHAPE, body="ball", radius=f"{radius:.4g}", edge=f"{radius / 2.5:.4g}", height=f"{2 * radius:.4g}"
    )


def new_scene_of(name: str, file: str, body: str, scale: float, size: float, lowest: float) -> str:
    """The text of a scene with the surface in `file`, multiplied by `scale`, above a floor.

    Parameters
    ----------
    name : of the scene file, for its comments
    file : of the surface, relative to the scene file; body : name of the body
    scale : factor of coordinates
    size, lowest : of the surface after scaling, the length of its bounding box and its lowest y [m]
    """
    values = {
        "file": json.dumps(file),
        "scale": f"{scale:g}",
        "height": f"{0.1 * size - lowest:.4g}",
        "radius": f"{size / 2:.4g}",
    }
    return _text(name, _MESH, body=json.dumps(body), **values)


def _text(name: str, entry: str, **values: str) -> str:
    return _HEAD.format(name=name) + entry.format(**values) + _REST.format(**values)
