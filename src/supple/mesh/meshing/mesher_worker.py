"""The program of the child process: a mesher, Mmg, MeshFix or decimation on arrays from a file, within limits.

It is started by its path, not imported. It uses only NumPy and the mesher, so that it starts quickly and so that no
part of the parent's program runs a second time. Job and answer are `.npz` and `.json` files in a folder.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from supple.runtime.memory import end_with_parent, limit_process

# TetGen's smoothing leaves some tets up to half as large again as the bound that its refinement kept.
VOLUME_ATTEMPTS = 5
# Meshes that are made at most for a number of tets, and how near to it is near enough: a mesh of 2,000 takes .3 to 1 s.
COUNT_ATTEMPTS, COUNT_TOLERANCE = 6, 0.1
# The number of tets falls with the edge's third power in a solid, with its second in a wall.
COUNT_SLOPE = 2.3
# Of an edge: a tet of a smaller height is flat. A regular one has .8, one of a wall that is an eighth of an edge .12.
FLAT = 0.05
# Flat tets come by chance: another mesh of nearly the same edges has others.
OTHER_EDGE, OTHER_EDGES = 0.98, 2

# Of TetGen: a mesh with the triangles as they are, of whatever tets.
SHAPELESS = {"quality": None, "min_dihedral": None, "keep_surface": True, "max_volume": None, "points": None}
# Of its volume: a component that faces inward, with more of it in another, is a cavity of this.
WITHIN = 0.999


def main(folder: Path) -> int:
    """Run the job in `folder`; returns 0, or 1 where `answer.json` has the error, or as "disk" that of a file."""
    job: dict[str, Any] = json.loads((folder / "job.json").read_text("utf-8"))
    end_with_parent(job["parent"])
    answer: dict[str, Any] = {"notes": limit_process(job["cpu_seconds"], job["memory_limit"])}
    code = 0
    try:
        import numpy as np

        with np.load(folder / "surface.npz") as surface:
            vertices, elements = surface["vertices"], surface["elements"]
        runs = {
            "tetgen": _run_tetgen,
            "meshfix": _run_meshfix,
            "union": _run_union,
            "decimation": _run_decimation,
        }
        if job["mesher"] == "mmg":
            _run_mmg(vertices, elements, job["options"], answer["notes"], lambda mesh: _write(folder, mesh))
        else:
            run = runs[job["mesher"]]
            _write(folder, run(vertices, elements, job["options"], answer["notes"]))
    except MemoryError:
        answer["error"], code = "out of memory", 1
    except OSError as error:
        answer["disk"], code = error.strerror or str(error), 1
    except Exception as error:
        text = " ".join(str(error).split())
        answer["error"], code = text if isinstance(error, RuntimeError) else f"{type(error).__name__}: {text}", 1
    (folder / "answer.json").write_text(json.dumps(answer), "utf-8")
    return code


def _write(folder: Path, mesh: tuple[Any, Any, Any]) -> None:
    """Whole or not at all: a later run may crash, and this one is then the result."""
    import numpy as np

    with (folder / "part.npz").open("wb") as file:
        np.savez(file, vertices=mesh[0], elements=mesh[1], labels=mesh[2])
    (folder / "part.npz").replace(folder / "mesh.npz")


def _run_mmg(
    vertices: Any,
    elements: Any,
    options: dict[str, Any],
    notes: list[str],
    keep: Callable[[tuple[Any, Any, Any]], None],
) -> None:
    """Tets of a length of edges, or of a number of tets, in a closed surface.

    TetGen fills the surface with as few tets as it can, whatever their shape; Mmg moves, splits, collapses and swaps
    them until their edges have the length. All its meshes are valid, so that walls never cut themselves.
    """
    import numpy as np
    from mmgpy import MmgMesh3D  # pyright: ignore[reportMissingImports]

    vertices, elements, _ = _run_tetgen(vertices, elements, SHAPELESS, notes)

    def run(edge: float) -> tuple[Any, Any, Any]:
        # nofem: tets may have two sides on the surface. Otherwise thin walls get two layers, and ten times the time.
        # With it, acute corners such as those of a single tet get tets of no volume.
        for nofem in (1, 0):
            mesh = MmgMesh3D(vertices, elements.astype(np.int32))
            distance = options["distance"] * edge
            mesh.remesh(hsiz=edge, hausd=distance, nofem=nofem, verbose=-1)
            points, tets = mesh.get_vertices(), mesh.get_tetrahedra()
            if tets.min() >= 0 and tets.max() < len(points) and _heights(points, tets).min() > 0.0:
                break
        else:
            raise RuntimeError("its tets have no volume")
        tets = _without_outer_slivers(points, tets, FLAT * edge)
        return points, tets, np.ones(len(tets))

    edge, wanted = options["edge"], options["tets"]
    if wanted is None:
        keep(run(edge))
        return
    best, before, longest = np.inf, None, 0.5 * float(np.ptp(vertices, axis=0).max())
    too_short, too_long, others = 0.0, np.inf, 0
    for _ in range(COUNT_ATTEMPTS):
        mesh = run(edge)
        made = len(mesh[1])
        flatness = float(_heights(mesh[0], mesh[1]).min()) / edge
        notes.append(f"edges of {edge:.4g}: {made} tets, smallest height {flatness:.3g} edges")
        # Half the height weighs as much as being off by a tenth.
        error = max(abs(np.log(made / wanted)), 0.05) + 0.1 * max(np.log2(FLAT / max(flatness, 1e-9)), 0.0)
        if error < best:
            best = error
            keep(mesh)
        slope = COUNT_SLOPE
        if before is not None and before[0] != edge and made != before[1]:
            slope = float(np.clip(-np.log(made / before[1]) / np.log(edge / before[0]), 0.7, 3.0))
        before = edge, made
        if abs(made / wanted - 1.0) < COUNT_TOLERANCE:
            if flatness >= FLAT or others == OTHER_EDGES:
                return
            others += 1
            edge *= OTHER_EDGE
            continue
        if made > wanted and edge >= longest:
            return
        too_short, too_long = (max(too_short, edge), too_long) if made > wanted else (too_short, min(too_long, edge))
        edge = min(edge * float(np.clip((made / wanted) ** (1.0 / slope), 0.3, 3.0)), longest)
        if not too_short < edge < too_long:
            edge = (too_short * too_long) ** 0.5


# The sides of a tet, each opposite to the corner of its number.
SIDES = ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))


def _heights(points: Any, tets: Any) -> Any:
    """The smallest height of each tet."""
    import numpy as np

    x = points[tets]
    six = np.linalg.det(x[:, 1:] - x[:, :1])
    doubled = [np.linalg.norm(np.cross(x[:, b] - x[:, a], x[:, c] - x[:, a]), axis=1) for a, b, c in SIDES]
    return six / np.maximum(np.max(doubled, axis=0), 1e-300)


def _without_outer_slivers(points: Any, tets: Any, flat: float) -> Any:
    """The tets without those that are flatter than `flat` and have two sides on the boundary.

    Without one, the boundary has the other diagonal of four points that are nearly in a plane.
    """
    import numpy as np

    for _ in range(COUNT_ATTEMPTS):
        sides = np.sort(tets[:, SIDES].reshape(-1, 3), axis=1)
        _, inverse, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
        outer = (count[inverse.reshape(-1)] == 1).reshape(-1, 4)
        edges = tets[:, SIDES][outer][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        edges = set(map(tuple, np.sort(edges, axis=1).tolist()))
        heights, touched, dropped = _heights(points, tets), set(), []
        for t in np.flatnonzero((heights < flat) & (outer.sum(axis=1) == 2)):
            corners = set(tets[t].tolist())
            new = tuple(sorted(tets[t, outer[t]].tolist()))
            if new not in edges and not touched & corners:
                touched |= corners
                dropped.append(t)
        if not dropped:
            break
        tets = np.delete(tets, dropped, axis=0)
    return tets


def _run_tetgen(vertices: Any, triangles: Any, options: dict[str, Any], notes: list[str]) -> tuple[Any, Any, Any]:
    """Tets, without those in cavities."""
    import tetgen

    def run(bound: float | None) -> tuple[Any, Any, Any]:
        points, tets, regions, _ = tetgen.TetGen(vertices, triangles).tetrahedralize(
            quality=options["quality"] is not None,
            minratio=options["quality"] or 2.0,
            mindihedral=options["min_dihedral"] or 0.0,
            # The default, 177, leaves boundary tets of about one degree; 165 flips most of them away at no cost.
            optmaxdihedral=165.0,
            nobisect=options["keep_surface"],
            fixedvolume=bound is not None,
            maxvolume=-1.0 if bound is None else bound,
            # Time and memory limit the work. TetGen's own limit of 100 000 points would end it without a message.
            steinerleft=options["points"] or -1,
            regionattrib=True,
            quiet=True,
        )
        return points, tets, regions.reshape(-1)

    points, tets, regions = _below_volume(run, options["max_volume"], options["max_volume"], notes)
    inside = _inside(vertices, triangles, points, tets, regions)
    return points, tets[inside], regions[inside]


def _inside(vertices: Any, triangles: Any, points: Any, tets: Any, regions: Any) -> Any:
    """Which tets lie inside. TetGen fills everything that the surface encloses, also cavities (each is a region)."""
    import numpy as np

    inside = np.ones(len(tets), dtype=bool)
    names = np.unique(regions)
    x = points[tets]
    volumes = np.abs(np.linalg.det(x[:, 1:] - x[:, :1]))
    for region in names if len(names) > 1 else ():
        members = np.flatnonzero(regions == region)
        a, b, c = (vertices[triangles] - x[members[volumes[members].argmax()]].mean(axis=0)).transpose(1, 0, 2)
        # The solid angles of van Oosterom, Strackee (1983); their sum is 4 pi inside.
        la, lb, lc = (np.linalg.norm(corner, axis=1) for corner in (a, b, c))
        det = np.einsum("ij,ij->i", a, np.cross(b, c))
        dots = [np.einsum("ij,ij->i", p, q) * r for p, q, r in ((a, b, lc), (b, c, la), (c, a, lb))]
        if np.arctan2(det, la * lb * lc + sum(dots)).sum() < np.pi:
            inside[members] = False
    return inside


def _run_meshfix(vertices: Any, triangles: Any, options: dict[str, Any], notes: list[str]) -> tuple[Any, Any, Any]:
    """Each component in `options["faulty"]` alone; no triangles for one of which MeshFix keeps nothing."""
    import numpy as np
    import pymeshfix

    component = np.asarray(options["components"])
    points, faces, labels, start = [np.empty((0, 3))], [np.empty((0, 3), np.int32)], [np.empty(0)], 0
    for k in options["faulty"]:
        used, local = np.unique(triangles[component == k], return_inverse=True)
        fixer = pymeshfix.MeshFix(vertices[used], local.reshape(-1, 3).astype(np.int32), verbose=False)
        # One component has no smaller one to drop, except for what the repair itself cuts off.
        fixer.repair(joincomp=False, remove_smallest_components=False)
        points.append(np.asarray(fixer.points, dtype=np.float64).reshape(-1, 3))
        faces.append(np.asarray(fixer.faces, dtype=np.int32).reshape(-1, 3) + start)
        labels.append(np.full(len(faces[-1]), float(k)))
        start += len(points[-1])
    return np.concatenate(points), np.concatenate(faces), np.concatenate(labels)


def _run_union(vertices: Any, triangles: Any, options: dict[str, Any], notes: list[str]) -> tuple[Any, Any, Any]:
    """The boundary of what the closed components of a surface of size 1 enclose together.

    Those that face inward are cavities of the smallest one around them, or solids where none exists.
    """
    import manifold3d
    import numpy as np

    def manifold(points: Any, faces: Any) -> Any:
        made = manifold3d.Manifold(
            manifold3d.Mesh64(np.array(points, order="C"), np.array(faces, np.uint64, order="C"))
        )
        if made.status() != manifold3d.Error.NoError:
            raise RuntimeError(f"{made.status()}")
        return made

    solids, inward = [], []
    for component in manifold(vertices, triangles).decompose():
        if component.volume() > 0.0:
            solids.append(component)
        else:
            mesh = component.to_mesh64()
            inward.append(manifold(mesh.vert_properties[:, :3], mesh.tri_verts[:, ::-1]))
    outward = list(solids)
    for component in inward:
        shares = [(solid ^ component).volume() / component.volume() for solid in outward]
        around = [k for k, share in enumerate(shares) if share > WITHIN]
        if around:
            smallest = min(around, key=lambda k: outward[k].volume())
            solids[smallest] -= component
        else:
            solids.append(component)
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    tolerance = options["tolerance"]
    # Cuts leave triangles that are shorter than round-off; without them, others may cross.
    mesh = (union.set_tolerance(tolerance).simplify(tolerance) if tolerance else union).to_mesh64()
    faces = np.array(mesh.tri_verts, np.int32)
    return np.array(mesh.vert_properties)[:, :3], faces, np.ones(len(faces))


def _run_decimation(vertices: Any, triangles: Any, options: dict[str, Any], notes: list[str]) -> tuple[Any, Any, Any]:
    import fast_simplification
    import numpy as np

    # The library collapses all edges below an error that grows the faster, the more aggressive it is: with its default
    # alone, a box of 1,584 triangles that lies at an angle loses a third of its volume on the way to 100.
    for aggressiveness in range(options["first"], 10):
        if len(triangles) <= options["triangles"]:
            break
        reduced = fast_simplification.simplify(
            vertices, triangles, target_count=options["triangles"], agg=float(aggressiveness)
        )
        vertices, triangles = reduced[0], reduced[1]
    return vertices, triangles, np.ones(len(triangles))


def _below_volume(
    run: Callable[[float | None], tuple[Any, Any, Any]], max_volume: float | None, bound: float | None, notes: list[str]
) -> tuple[Any, Any, Any]:
    """The mesher's result; it runs again with a tighter bound while its largest tet exceeds `max_volume`."""
    import numpy as np

    answer = run(bound)
    if max_volume is None or bound is None:
        return answer
    for _ in range(VOLUME_ATTEMPTS - 1):
        if len(answer[1]) == 0:
            break
        corners = answer[0][answer[1]]
        largest = float(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).max() / 6.0)
        if largest <= max_volume * (1.0 + 1e-9):
            break
        notes.append(f"the largest tet is {largest / max_volume:.3g} times max_volume; trying a tighter bound")
        bound *= max(0.25, 0.98 * max_volume / largest)
        answer = run(bound)
    return answer


if __name__ == "__main__":
    exit_code = main(Path(sys.argv[1]))
    sys.stdout.flush()
    sys.stderr.flush()
    # Without the meshers' global destructors, which are known to crash after the work is done.
    os._exit(exit_code)
