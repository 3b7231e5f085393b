"""`supple mesh`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from supple.app.cli.arguments import Yes, whole_number
from supple.errors import MeshError, MeshingError

if TYPE_CHECKING:
    from supple.mesh.meshing.tetrahedralize import MeshingReport
    from supple.mesh.surface import SurfaceMesh
    from supple.mesh.tetmesh import TetMesh


def mesh(
    surface: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    scale: float = 1.0,
    tets: Annotated[int | None, Parameter(converter=whole_number)] = None,
    edge: float | None = None,
    max_volume: float | None = None,
    quality: float = 1.4,
    min_dihedral: float | None = None,
    keep_surface: Annotated[bool, Parameter(negative="")] = False,
    mesher: Literal["auto", "tetgen", "stuffing"] = "auto",
    repair: Annotated[bool, Parameter(negative="")] = False,
    time_limit: float = 120.0,
    memory_limit: float = 4.0,
    base_index: Literal[0, 1] = 1,
    yes: Yes = False,
) -> None:
    """Fill a surface with tets of about the size that is asked for.

    Parameters
    ----------
    surface
        STL, OBJ, PLY, OFF, GLB, glTF, DAE, 3MF, VTP, VTK, VTU, MSH, INP, MESH or USD file.
    output
        One of TetGen's names (bear.1.node writes .node, .ele, .edge and .face), or a .msh, .vtu, .vtk, .inp or
        USD file. Without it, the surface's name with .vtu, in this folder.
    scale
        Factor of all coordinates: 0.001 for a surface in millimetres.
    tets
        Number of tets, within 10 % where the surface allows it: 2,000 where no other size and no --keep-surface is
        given. The surface is remeshed to that size; sharp edges stay.
    edge
        Mean length of the tets' edges [m], instead of a number of tets.
    max_volume
        No tet is larger than this [m^3], by TetGen alone.
    quality
        TetGen's bound on circumradius over shortest edge, above 1, for --max-volume: smaller is better shaped.
    min_dihedral
        Smallest dihedral angle that TetGen tries to reach [degrees]; with values much above 18 it may not end.
    keep_surface
        Change no triangle of the surface.
    mesher
        "auto" unites closed components that overlap, uses TetGen and Mmg for a clean surface, and stuffing, which
        rounds sharp edges, for any other, and where they fail.
    repair
        Repair a surface that is not clean first, and list the changes. Where that fails, it is filled as it is.
    yes
        Continue without a question where more than 10 times the tets are needed.
    time_limit
        Time limit of the mesher [s].
    memory_limit
        Limit on the mesher's address space [GiB].
    base_index
        Number of the first vertex in TetGen's files.
    """
    from supple.app.cli.console import reading
    from supple.mesh.io.mesh_files import TET_EXTENSIONS
    from supple.mesh.io.tetgen_family import family_paths, is_tetgen_path, write_tetgen_family
    from supple.mesh.meshing.child_process import DEFAULT_TETS
    from supple.mesh.meshing.option_names import named_for
    from supple.mesh.meshing.tetrahedralize import tetrahedralize_reported
    from supple.mesh.surface import SurfaceMesh
    from supple.runtime.replacing import refuse_to_replace

    output = Path(surface.with_suffix(".vtu").name) if output is None else output
    # Checked before the meshing, which can take minutes.
    if output.suffix.lower() not in TET_EXTENSIONS:
        raise MeshError(f"{output}: the extension must be one of {', '.join(TET_EXTENSIONS)}")
    if not output.absolute().parent.is_dir():
        raise MeshError(f"{output}: the folder {output.absolute().parent} does not exist")
    if not os.access(output.absolute().parent, os.W_OK):
        raise MeshError(f"{output}: the folder cannot be written to")
    targets = list(family_paths(output).values()) if is_tetgen_path(output) else [output]
    for target in targets:
        if target.is_dir():
            raise MeshError(f"{target}: is a folder; give another name")
        refuse_to_replace(surface, target)
    if tets is edge is max_volume is None and not keep_surface:
        tets = DEFAULT_TETS
    with named_for("shell"), reading(yes, "meshing"):
        loaded = _scaled(SurfaceMesh.load(surface), scale, surface)
        try:
            filled, report = tetrahedralize_reported(
                loaded,
                max_volume=max_volume,
                edge=edge,
                tets=tets,
                quality=quality,
                min_dihedral=min_dihedral,
                keep_surface=keep_surface,
                mesher=mesher,
                repair=repair,
                time_limit=time_limit,
                memory_limit=_bytes(memory_limit),
            )
        except MeshingError as error:
            raise MeshingError(f"{surface}: {error}") from None
    if is_tetgen_path(output):
        write_tetgen_family(output, filled.vertices, filled.tets, filled.edges, filled.surface.triangles, base_index)
    else:
        filled.save(output)
    _summarize(filled, report, targets)


def _scaled(surface: SurfaceMesh, scale: float, path: Path) -> SurfaceMesh:
    import numpy as np

    from supple.mesh.meshing.units import warn_of_millimetres
    from supple.mesh.surface import SurfaceMesh

    if not 0.0 < scale < np.inf:
        raise MeshError(f"scale must be a number above 0 and finite, not {scale:g}")
    warn_of_millimetres(path, surface.vertices, scale)
    return surface if scale == 1.0 else SurfaceMesh(scale * surface.vertices, surface.triangles)


def _bytes(gibibytes: float) -> int:
    if not 0.0 < gibibytes < 2.0**33:
        raise MeshingError(f"memory limit must be a number of GiB above 0, not {gibibytes:g}")
    return max(1, int(gibibytes * 2**30))


def _summarize(tets: TetMesh, report: MeshingReport, files: list[Path]) -> None:
    from supple.app.cli.console import print_table

    fine = report.fine.volume
    change = f" ({100.0 * (tets.volume / fine - 1.0):+.2f} %)" if report.reduced and fine > 0.0 else ""
    rows = {
        "mesher": f"{report.mesher}, {report.seconds:.2f} s",
        "vertices": str(len(tets.vertices)),
        "tets": str(len(tets.tets)),
        "surface triangles": str(len(tets.surface.triangles)),
        "volume": f"{tets.volume:.6g} m^3{change}",
        "largest tet": f"{tets.volumes.max():.4g} m^3",
        "smallest dihedral": f"{tets.min_dihedrals.min():.2f} degrees",
        "files": "\n".join(map(str, files)),
    }
    if report.reduced:
        triangles = f"{len(report.fine.triangles)} -> {len(report.filled.triangles)} triangles"
        rows["surface"] = f"{triangles}, at most {report.distance:.3g} m apart"
    if report.repair is not None:
        rows["repair"] = str(report.repair)
    print_table(rows.items())
