"""The soft vertex-triangle stitch: a tetrahedron of stable Neo-Hookean material between a vertex and a triangle.

Source: "Soft Vertex Triangle Stitch", the documentation of libuipc's constitution #30.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from supple.errors import SceneError
from supple.kinds.checks import float_array
from supple.kinds.validators import POSITIVE
from supple.materials.material import lame_from_engineering
from supple.scene.stitches.elements import Pairs, StitchTets
from supple.scene.stitches.side import Side
from supple.scene.stitches.stitch import PerPair, Stitch

# The default rest distance, as a share of the mean edge at a pair. Two half bars, joined by stitches as stiff as they
# are, then bend 0.3 % further than one bar (docs/reference/stitches.md).
_DISTANCE_SHARE = 0.01

_MODULI = ("mu", "lam", "youngs", "poisson")
Numbers = float | NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SoftVertexTriangleStitch(Stitch):
    """Joins vertices of one body to triangles of another, each pair by a tetrahedron

        psi = mu/2 (Ic - 3) - mu (J - 1) + lam/2 (J - 1)^2 + mu^2/lam^2,    F = Ds Dm^-1,    E = V0 psi.

    Its rest shape is the pair as the scene places it. Where the vertex is closer than `min_separate_distance` d to the
    triangle's plane, its rest place is moved along the normal n to the distance d: by (sign(s) d - s) n, with the
    signed distance s and sign(0) = +1 (up to round-off).

    Pairs are (vertex of the first body's mesh, row of the second body's `mesh.surface.triangles`, or of an obstacle's
    `surface.triangles`). Other parameters: see `Stitch`.

    Parameters
    ----------
    mu, lam : as in psi [Pa]; or
    youngs, poisson : Young's modulus [Pa] and Poisson's ratio, from which mu and lam are the Lamé parameters.
    min_separate_distance : d [m]; None: a hundredth of the mean edge of the pair's triangle, or of the mean
        edge of the first surface at the vertex, whichever is shorter

    Each is one number, or one for each pair.

    Raises
    ------
    SceneError : where a value is not finite or out of range. lam must be above zero: psi divides by it.
    """

    kind: ClassVar[str] = "soft_vertex_triangle"
    partner = "triangles"

    mu: Annotated[Numbers | None, PerPair(POSITIVE)] = field(default=None, kw_only=True)
    lam: Annotated[Numbers | None, PerPair(POSITIVE)] = field(default=None, kw_only=True)
    youngs: Annotated[Numbers | None, PerPair(POSITIVE)] = field(default=None, kw_only=True)
    poisson: Annotated[Numbers | None, PerPair(POSITIVE)] = field(default=None, kw_only=True)
    min_separate_distance: Annotated[Numbers | None, PerPair(POSITIVE)] = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        given = [key for key in _MODULI if getattr(self, key) is not None]
        if given == ["mu", "lam"]:
            _same_count(self, "mu", "lam")
        elif given in (["youngs", "poisson"], list(_MODULI)):
            mu, lam = self._converted()
            # All four are given where `dataclasses.replace` makes a stitch from another one.
            if len(given) == 4 and not (
                np.array_equal(mu, np.asarray(self.mu)) and np.array_equal(lam, np.asarray(self.lam))
            ):
                raise SceneError(f"{self.label}: mu, lam are not those of youngs, poisson; give one pair, not both")
            object.__setattr__(self, "mu", mu)
            object.__setattr__(self, "lam", lam)
        else:
            named = " and ".join(given) or "neither"
            raise SceneError(f"{self.label}: give mu and lam, or youngs and poisson (given: {named})")

    def _converted(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """mu and lam of youngs and poisson."""
        assert self.youngs is not None
        assert self.poisson is not None
        nu = np.asarray(self.poisson)
        if (nu >= 0.5).any():
            raise SceneError(f"{self.label}: poisson is {nu.max():g}; it must be above 0 and below 0.5")
        _same_count(self, "youngs", "poisson")
        return lame_from_engineering(self.youngs, nu)

    def energy_density(self, F: ArrayLike) -> NDArray[np.float64]:
        """psi as published, mu^2/lam^2 included, which is not zero at rest.

        That constant has the wrong dimension (completing the square gives mu^2/(2 lam)) and no effect on motion.
        Energies in reports are measured from the rest state.

        Parameters
        ----------
        F : (..., 3, 3) deformation gradients; (k, 3, 3) where mu and lam are given for each of k pairs

        Returns
        -------
        (...) [Pa]
        """
        F = float_array(F, "F", "its last two axes must be (3, 3)")
        if F.shape[-2:] != (3, 3):
            raise SceneError(f"F has shape {F.shape}; its last two axes must be (3, 3)")
        mu, lam = np.asarray(self.mu), np.asarray(self.lam)
        grown = np.linalg.det(F) - 1.0
        Ic = np.einsum("...ij,...ij->...", F, F)
        return 0.5 * mu * (Ic - 3.0) - mu * grown + 0.5 * lam * grown * grown + (mu / lam) ** 2

    def partners(self, second: Side) -> NDArray[np.int32]:
        return second.triangles

    def join(self, first: Side, second: Side, pairs: Pairs) -> StitchTets:
        """See `Stitch`. Where the volume of a tet would be negative, two corners of its triangle change places.

        Raises
        ------
        SceneError : where a triangle has no area, or the height of a tet is lost in round-off.
        """
        count = len(pairs.vertices)
        corners = second.triangles[pairs.rows]
        for key in ("youngs", "poisson"):
            if getattr(self, key) is not None:
                self.per_pair(getattr(self, key), count, key)
        x0, (x1, x2, x3) = first.points[pairs.vertices], second.points[corners].transpose(1, 0, 2)
        n = np.cross(x2 - x1, x3 - x1)
        length = np.linalg.norm(n, axis=1)
        edges = np.linalg.norm([x2 - x1, x3 - x2, x1 - x3], axis=2)
        flat = np.flatnonzero(~(length > 1e-12 * edges.max(axis=0) ** 2))
        if len(flat):
            row = pairs.rows[flat[0]]
            if second.triangles[row, 1] == second.triangles[row, 2]:
                text = f"{second.label} is edges without triangles; give a VertexEdgeStitch or a VertexVertexStitch"
            else:
                text = f"triangle {row} of {second.label} has no area, so that nothing can be stitched to it; repair it"
            raise SceneError(f"{self.label}: {text}")
        n /= length[:, None]
        chosen = self.min_separate_distance
        if chosen is None:
            chosen = _DISTANCE_SHARE * np.minimum(edges.mean(axis=0), first.mean_edges()[pairs.vertices])
        d = self.per_pair(chosen, count, "min_separate_distance")
        s = np.einsum("ij,ij->i", n, x0 - x1)
        # Faces that touch count as height 0, on the side +1, also where round-off gives another sign.
        round_off = 8.0 * np.finfo(np.float64).eps * np.max(np.abs([x0, x1, x2, x3]), axis=(0, 2))
        above = s >= -round_off
        near = np.abs(s) < d - round_off
        thin = np.flatnonzero(np.maximum(np.abs(s), d) <= round_off)
        if len(thin):
            raise SceneError(
                f"{self.label}: min_separate_distance is {d[thin[0]]:g}, and vertex {pairs.vertices[thin[0]]} of "
                f"{first.label} lies in the plane of triangle {pairs.rows[thin[0]]} of {second.label}; give more"
            )
        x0 = x0 + np.where(near, np.where(above, d, -d) - s, 0.0)[:, None] * n
        corners, second_corner, third_corner = corners.copy(), x2, x3
        corners[above] = corners[above][:, [0, 2, 1]]
        x2 = np.where(above[:, None], third_corner, second_corner)
        x3 = np.where(above[:, None], second_corner, third_corner)
        Dm = np.stack([x1 - x0, x2 - x0, x3 - x0], axis=-1)
        return StitchTets(
            vertices=np.column_stack([pairs.vertices, corners]).astype(np.int32),
            rest_shape_inverse=np.ascontiguousarray(np.linalg.inv(Dm)),
            rest_volumes=np.abs(np.linalg.det(Dm)) / 6.0,
            mu=self.per_pair(self.mu, count, "mu"),  # pyright: ignore[reportArgumentType]
            lam=self.per_pair(self.lam, count, "lam"),  # pyright: ignore[reportArgumentType]
            damping=np.full(count, self.damping),
            offset=near,
        )


def _same_count(stitch: SoftVertexTriangleStitch, one: str, other: str) -> None:
    """Raise where both are lists, of different lengths."""
    sizes = [np.asarray(getattr(stitch, key)).shape for key in (one, other)]
    if all(sizes) and sizes[0] != sizes[1]:
        raise SceneError(
            f"{stitch.label}: {one} has {sizes[0][0]} values and {other} {sizes[1][0]}; give one, or one for each pair"
        )
