"""What a recording keeps of cavities and cables: what they act on. Their pressures and tensions are in the details."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from supple.model.loads.actuators.cable_length import CableLength
from supple.model.loads.actuators.enclosed_volume import EnclosedVolume
from supple.model.system import System
from supple.results.checkpoint.typed import Rows


@dataclass(frozen=True, eq=False)
class RecordedCavity:
    """A cavity; triangles : (t, 3) vertices of the surface around it, seen counter-clockwise from inside."""

    name: str
    triangles: Annotated[NDArray[np.int32], Rows("t", 3, below="n")]


@dataclass(frozen=True, eq=False)
class RecordedCable:
    """A cable through points W x + offset, of some vertices.

    Attributes
    ----------
    vertices : (v,); weights : (p, v); offsets : (p, 3) [m]
    """

    name: str
    vertices: Annotated[NDArray[np.int32], Rows("v", below="n")]
    weights: Annotated[NDArray[np.float64], Rows("p", "v", finite=True)]
    offsets: Annotated[NDArray[np.float64], Rows("p", 3, finite=True)]


def cavities_of(system: System) -> tuple[RecordedCavity, ...]:
    """The cavities of a scene."""
    volumes = ((each.name, each.coordinate) for each in system.actuators)
    return tuple(
        RecordedCavity(name, one.vertices[one.triangles]) for name, one in volumes if isinstance(one, EnclosedVolume)
    )


def cables_of(system: System) -> tuple[RecordedCable, ...]:
    """The cables of a scene."""
    lengths = ((each.name, each.coordinate) for each in system.actuators)
    return tuple(
        RecordedCable(name, one.vertices, one.weights, one.offsets)
        for name, one in lengths
        if isinstance(one, CableLength)
    )
