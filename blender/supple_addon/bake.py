"""The simulation of a job that Blender wrote, in the Python that Supple is installed in.

usage: python bake.py FOLDER

FOLDER holds `job.json` and the arrays that it names (see `job.write`). `positions_K.npy` (f, n, 3) of each body and
`report.json` are written to it; each frame prints a line. Exit code 2, with one line, for what cannot be simulated.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

import supple as sp
from supple.errors import MeshingError
from supple.mesh.skin import Embedding

# Vertices of Blender's mesh that a vertex of the tets follows: enough to determine a rotation on most meshes.
_GUIDES = 12


def main(folder: Path) -> int:
    """Simulate the job in `folder`."""
    job = json.loads((folder / "job.json").read_text("utf-8"))
    try:
        report = bake(job, folder)
    except sp.SuppleError as error:
        print(error, file=sys.stderr)
        return 2
    (folder / "report.json").write_text(json.dumps(report), "utf-8")
    return 0


def bake(job: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Simulate a job and write the positions of its bodies' vertices; returns the contents of `report.json`."""
    bodies, pins, skins = [], [], []
    for described in job["bodies"]:
        body, pin, skin = _body(described, folder, job["dt"])
        bodies.append(body)
        skins.append(skin)
        pins += [pin] if pin is not None else []
    obstacles: list[Any] = [_obstacle(described, folder, job["dt"]) for described in job["obstacles"]]
    if job["floor"] is not None:
        obstacles.append(sp.HalfSpace(point=(0.0, 0.0, job["floor"]), normal=(0.0, 0.0, 1.0), name="floor"))
    scene = sp.Scene(bodies, obstacles, pins=pins, gravity=job["gravity"])
    solver = sp.XPBD() if job["solver"] == "xpbd" else sp.Implicit()
    positions = [[skin.apply(body.mesh.vertices).astype(np.float32)] for body, skin in zip(bodies, skins, strict=True)]
    statuses: Counter[str] = Counter()
    count = job["frames"]
    for number, frame in enumerate(sp.simulate(scene, solver, job["dt"], count), start=1):
        for k, (body, skin) in enumerate(zip(bodies, skins, strict=True)):
            positions[k].append(skin.apply(frame.positions[body.name]).astype(np.float32))
        statuses[str(frame.report.status)] += 1
        print(f"frame {number} of {count}", flush=True)
    for k, ways in enumerate(positions):
        whole = np.array(ways)
        with np.load(folder / job["bodies"][k]["arrays"]) as arrays:
            # Where a pinned vertex is in a tet that others hold, too, the tets would carry it a little elsewhere.
            whole[:, arrays["pinned"]] = arrays["path"]
        np.save(folder / f"positions_{k}.npy", whole)
    tets = sum(len(body.mesh.tets) for body in bodies)
    bad = [f"{number} of {count} frames are {status}" for status, number in statuses.items() if status != "converged"]
    return {"summary": f"{count} frames of {len(bodies)} bodies, {tets} tets", "warnings": bad}


class Corners:
    """Blender's vertices (n, 3), of which those at `rows` are the points of a shell; loose ones stay."""

    def __init__(self, vertices: NDArray[np.float64], rows: NDArray[np.integer]) -> None:
        self.vertices, self.rows = vertices, rows

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where they are when the points of the shell are at `points` [m]."""
        out = self.vertices.copy()
        out[self.rows] = points
        return out


def _body(
    described: dict[str, Any], folder: Path, dt: float
) -> tuple[sp.Body | sp.Shell, sp.Pin | None, Embedding | Corners]:
    """A soft body or a shell, the pin of its vertex group, and Blender's vertices in its tets or at its points."""
    with np.load(folder / described["arrays"]) as arrays:
        vertices, triangles, pinned, path = (arrays[key] for key in ("vertices", "triangles", "pinned", "path"))
    name = described["name"]
    surface = sp.SurfaceMesh(vertices, triangles)
    if described.get("role") == "SHELL":
        return _shell(described, surface, pinned, path, dt)
    try:
        mesh = sp.tetrahedralize(surface.compact(), tets=described["tets"], repair=described["repair"])
    except MeshingError as error:
        raise MeshingError(f"{name}: {error}") from None
    material = sp.StableNeoHookean(
        youngs=described["youngs"],
        poisson=described["poisson"],
        density=described["density"],
        damping=described["damping"],
    )
    body = sp.Body(name, mesh, material, friction=described["friction"])
    skin = Embedding.of(mesh, vertices)
    if not pinned.any():
        return body, None, skin
    chosen = np.flatnonzero(pinned[KDTree(vertices).query(mesh.vertices)[1]])
    shifts = carried(mesh.vertices[chosen], path) - mesh.vertices[chosen]
    return body, sp.Pin(name, chosen, _motion(shifts, dt)), skin


def _shell(
    described: dict[str, Any],
    surface: sp.SurfaceMesh,
    pinned: NDArray[np.bool_],
    path: NDArray[np.float64],
    dt: float,
) -> tuple[sp.Shell, sp.Pin | None, Corners]:
    """Its points are the vertices of the surface that triangles use."""
    keys = ("youngs", "poisson", "density", "damping", "thickness")
    material = sp.ShellMaterial(**{key: described[key] for key in keys})
    rows = surface.used_vertices
    shell = sp.Shell(described["name"], surface.compact(), material, friction=described["friction"])
    chosen = np.flatnonzero(pinned[rows])
    if not len(chosen):
        return shell, None, Corners(surface.vertices, rows)
    shifts = (path - path[0])[:, np.isin(np.flatnonzero(pinned), rows)]
    return shell, sp.Pin(shell.name, chosen, _motion(shifts, dt)), Corners(surface.vertices, rows)


def carried(points: NDArray[np.float64], path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where points (k, 3) are in each frame (f, k, 3), if each moves rigidly with the guides nearest to it.

    Parameters
    ----------
    path : (f, g, 3) positions of the guides in each frame [m]

    The rotation is that of the least squares fit (Kabsch, "A solution for the best rotation to relate two sets of
    vectors", 1976); where the guides do not determine it, it is the one nearest to none.
    """
    count = min(_GUIDES, path.shape[1])
    _, near = KDTree(path[0]).query(points, k=count)
    near = near.reshape(len(points), count)
    begin = path[0][near]
    center = begin.mean(axis=1)
    out = np.empty((len(path), *points.shape))
    for k, frame in enumerate(path):
        now = frame[near]
        moments = np.einsum("pgi,pgj->pij", now - now.mean(axis=1, keepdims=True), begin - center[:, None])
        size = np.einsum("pgi,pgi->p", begin - center[:, None], begin - center[:, None])
        moments += (1e-9 * size + np.finfo(float).tiny)[:, None, None] * np.eye(3)
        left, _, right = np.linalg.svd(moments)
        left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
        out[k] = now.mean(axis=1) + np.einsum("pij,pj->pi", left @ right, points - center)
    return out


def _obstacle(described: dict[str, Any], folder: Path, dt: float) -> sp.obstacles.TriangleObstacle:
    with np.load(folder / described["arrays"]) as arrays:
        surface = sp.SurfaceMesh(arrays["vertices"], arrays["triangles"])
        shifts, turns = arrays["path"] - arrays["path"][0], Rotation.from_matrix(arrays["turns"]).as_rotvec()
        pivot = arrays["path"][0]
    still = np.abs(shifts).max() == 0.0 and np.abs(turns).max() < 1e-6  # of matrices in single precision
    times = dt * np.arange(len(shifts))
    motion = None if still else sp.Keyframes(times, shifts, pivot=pivot, rotations=turns)
    return sp.obstacles.TriangleObstacle(
        surface=surface, name=described["name"], friction=described["friction"], motion=motion
    )


def _motion(shifts: NDArray[np.float64], dt: float) -> Callable[[float], NDArray[np.float64]]:
    """Displacements (k, 3) at any time, from those of each frame (f, k, 3)."""

    def at(time: float) -> NDArray[np.float64]:
        place = min(max(time / dt, 0.0), len(shifts) - 1.0)
        k = min(int(place), len(shifts) - 2)
        return shifts[k] + (place - k) * (shifts[k + 1] - shifts[k])

    return at


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
