"""All welds of a scene: which vertices are combinations of control points, and of which."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError
from supple.mesh.topology import graph_components
from supple.scene.body import PlacedBody
from supple.scene.joints.joint import Joint
from supple.scene.joints.weld import Weld
from supple.scene.located import at
from supple.scene.rigid.rigid_body import RigidBody
from supple.scene.rotation import rotation_matrix


@dataclass(frozen=True, eq=False)
class Welding:
    """Welded vertices x = sum w_k x_k, numbered as those of a system.

    Attributes
    ----------
    vertices : (s,); control : (s, 4) control points of their rigid bodies; weights : (s, 4)
    weld : (s,) the number of each one's weld, -1 where it has none
    """

    vertices: NDArray[np.int32]
    control: NDArray[np.int32]
    weights: NDArray[np.float64]
    weld: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.vertices)

    @classmethod
    def none(cls) -> Welding:
        """Of a scene without welds."""
        return weld_together((), ())

    def with_vertices(self, vertices: NDArray[np.int32], control: NDArray[np.int32], weights: NDArray) -> Welding:
        """With more vertices (k,), which have no weld: combinations of control points (k, 4) with weights (k, 4)."""
        return Welding(
            np.concatenate([self.vertices, vertices]),
            np.ascontiguousarray(np.concatenate([self.control, control])),
            np.ascontiguousarray(np.concatenate([self.weights, weights])),
            np.concatenate([self.weld, np.full(len(vertices), -1, dtype=np.int64)]),
        )

    def renumbered(self, new: NDArray[np.int32]) -> Welding:
        """The same, where vertex i has the number new[i]."""
        return replace(self, vertices=new[self.vertices], control=new[self.control])

    def follow(self, x: NDArray[np.float64]) -> None:
        """Set the rows of welded vertices, in place, in positions or displacements x (n, 3) of all."""
        if len(self):
            x[self.vertices] = np.einsum("sk,ski->si", self.weights, x[self.control])

    def reduced(self, forces: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forces, or a gradient (n, 3), by the vertices that are not welded: those on welded vertices act on control
        points, by the transpose of `follow`."""
        out = forces.copy()
        if len(self):
            out[self.vertices] = 0.0
            np.add.at(out, self.control, self.weights[:, :, None] * forces[self.vertices][:, None, :])
        return out


def weld_together(welds: Sequence[Weld], bodies: Sequence[PlacedBody]) -> Welding:
    """The welds of bodies in their scene's order.

    Raises
    ------
    SceneError : where a weld has no vertex, or a vertex has two welds.
    """
    named = {body.name: body for body in bodies}
    begins = dict(zip(named, np.cumsum([0, *(len(body.mesh.vertices) for body in bodies)]), strict=False))
    vertices, control, weights, weld = [np.zeros(0, np.int32)], [np.zeros((0, 4), np.int32)], [np.zeros((0, 4))], []
    for k, one in enumerate(welds):
        with at("welds", k):
            soft, rigid = named[one.body], named[one.rigid]
            assert isinstance(rigid, RigidBody)
            chosen = one.chosen(soft, rigid)
            own = (chosen + begins[one.body]).astype(np.int32)
            twice = np.isin(own, np.concatenate(vertices))
            if twice.any():
                raise SceneError(
                    f"{one.label}: vertex {chosen[twice][0]} is already welded; name each vertex in one weld"
                )
            local = (soft.place(soft.mesh.vertices[chosen]) - np.asarray(rigid.position)) @ rotation_matrix(
                rigid.rotation
            )
            vertices.append(own)
            weights.append(rigid.weights_of(local))
            control.append(np.tile(np.arange(4, dtype=np.int32) + np.int32(begins[one.rigid]), (len(own), 1)))
            weld += [k] * len(own)
    return Welding(
        np.concatenate(vertices),
        np.ascontiguousarray(np.concatenate(control)),
        np.ascontiguousarray(np.concatenate(weights)),
        np.array(weld, dtype=np.int64),
    )


def linked_pieces(
    pieces: NDArray[np.int32], begins: Mapping[str, int], joints: Sequence[Joint], welding: Welding
) -> NDArray[np.int32]:
    """(n,) the piece of each vertex, where those of `pieces` (n,) that joints or welds join count as one.

    Parameters
    ----------
    begins : by name of the body, the number of its first vertex
    """
    ends = [(joint.first, joint.second) for joint in joints]
    pairs = [(begins[one], begins[other]) for one, other in ends if other is not None and other in begins]
    pairs += zip(welding.vertices.tolist(), welding.control[:, 0].tolist(), strict=True)
    if not pairs:
        return pieces
    first, second = np.array(pairs).T
    return graph_components(int(pieces.max()) + 1, pieces[first], pieces[second])[pieces]
