"""Values of all bodies in one array, read by the name of a body."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.kinds.suggestion import suggestion
from supple.scene.rows import BodyRows


class ByBody(Mapping[str, NDArray[Any]]):
    """By body name, its rows of `values`. Bodies without such values are not among the names.

    Parameters
    ----------
    values : (n, ...) of all bodies
    rows : of each body, by name
    refused : by name, why a body has no values
    """

    def __init__(self, values: NDArray[Any], rows: Mapping[str, slice], refused: Mapping[str, str]) -> None:
        self.values_of_all = values
        self._rows = rows
        self._refused = refused

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The values of one body.

        Raises
        ------
        SceneError : where no such body exists, or it has no such values.
        """
        if name in self._refused:
            raise SceneError(f"body {name!r} {self._refused[name]}")
        if name not in self._rows:
            raise SceneError(f"body {name!r} does not exist; {suggestion(name, list(self._rows))}")
        return self.values_of_all[self._rows[name]]

    def __contains__(self, name: object) -> bool:
        return name in self._rows and name not in self._refused

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._rows if name not in self._refused)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __repr__(self) -> str:
        return f"{{{', '.join(f'{name!r}: {self[name].shape}' for name in self)}}}"


class TetField(ByBody):
    """Values of tets by body name, and their means at vertices.

    Attributes
    ----------
    at_vertices : by body name, (n, ...) means over the tets around each vertex, weighted with their rest volumes
    """

    def __init__(
        self,
        values: NDArray[np.float64],
        bodies: Sequence[BodyRows],
        refused: Mapping[str, str],
        to_vertices: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    ) -> None:
        super().__init__(values, {body.name: body.tets for body in bodies}, refused)
        self._vertices = {body.name: body.vertices for body in bodies}
        self._to_vertices = to_vertices

    @cached_property
    def at_vertices(self) -> ByBody:
        return ByBody(self._to_vertices(self.values_of_all), self._vertices, self._refused)
