"""Named sets of vertices and tets, as modelling programs write them into mesh files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from supple.errors import MeshError
from supple.mesh.io.mesh_files import TetFile
from supple.runtime.displayed import Displayed


@dataclass(frozen=True, eq=False, repr=False)
class MeshSets(Displayed):
    """Named sets of a mesh: for pins, forces and regions.

    They are the node and element sets of Abaqus (.inp) and the physical groups of Gmsh (.msh). A group of surfaces or
    curves, and an element set, is also a set of the vertices of its elements.

    Attributes
    ----------
    vertices : by name, (k,) indices of vertices
    tets : by name, (k,) indices of tets
    tet_count : number of tets of the mesh
    """

    vertices: Mapping[str, NDArray[np.int32]]
    tets: Mapping[str, NDArray[np.int32]]
    tet_count: int

    def listed(self) -> dict[str, str]:
        """Names and sizes of the sets, by what they are of."""

        def counted(sets: Mapping[str, NDArray[np.int32]]) -> str:
            return ", ".join(f"{name} ({len(rows)})" for name, rows in sets.items()) or "none"

        return {"vertices": counted(self.vertices), "tets": counted(self.tets)}

    _facts = listed

    def vertices_of(self, name: str) -> NDArray[np.int32]:
        """(k,) indices of the vertices of a set.

        Raises
        ------
        MeshError : where no such set exists.
        """
        return _found(self.vertices, name, "vertices")

    def tets_of(self, name: str) -> NDArray[np.int32]:
        """(k,) indices of the tets of a set.

        Raises
        ------
        MeshError : where no such set exists.
        """
        return _found(self.tets, name, "tets")

    def regions(self, names: Sequence[str]) -> NDArray[np.int32]:
        """(m,) for the `index` of `Regions`: 0 of tets in no set, k + 1 of those in set `names[k]`; the last counts.

        Raises
        ------
        MeshError : where no such set exists.
        """
        index = np.zeros(self.tet_count, dtype=np.int32)
        for k, name in enumerate(names):
            index[self.tets_of(name)] = k + 1
        return index


def _found(sets: Mapping[str, NDArray[np.int32]], name: str, kind: str) -> NDArray[np.int32]:
    for known, rows in sets.items():
        if known.upper() == str(name).upper():
            return rows
    listed = ", ".join(sets) or "none"
    raise MeshError(f"set of {kind} {name!r} does not exist; there are: {listed}")


def sets_of(file: TetFile) -> MeshSets:
    """The sets of a file. Vertices that belong to no tet are left out, as `TetMesh.load` does.

    A set of tets is also one of their vertices, where no set of vertices has its name.
    """
    used = np.zeros(len(file.points), dtype=bool)
    used[file.tets] = True
    place = np.cumsum(used) - 1
    of_nodes = {name: place[rows[used[rows]]].astype(np.int32) for name, rows in file.node_sets.items()}
    of_tets = {name: rows.astype(np.int32) for name, rows in file.tet_sets.items()}
    for name, rows in of_tets.items():
        of_nodes.setdefault(name, place[np.unique(file.tets[rows])].astype(np.int32))
    vertices = {name: rows for name, rows in of_nodes.items() if len(rows)}
    return MeshSets(vertices, of_tets, len(file.tets))
