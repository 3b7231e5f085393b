"""Named sets of a model file, as its reader finds them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class NamedSets(NamedTuple):
    """Sets in the numbering of the file.

    node_count : number of nodes of the file
    tets : (m, 4) or (m, 10) nodes of the solid tets, counted from 0 in the order of the file
    node_sets : by name, nodes counted from 0
    tet_sets : by name, tets counted from 0
    """

    node_count: int
    tets: NDArray[np.int64]
    node_sets: Mapping[str, NDArray[np.int64]]
    tet_sets: Mapping[str, NDArray[np.int64]]
