"""The surfaces of bodies and obstacles as all pictures show them: the page, films, and files of other programs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Self, TypeGuard

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from supple.mesh.closed_surfaces import is_closed
from supple.results.view.beside import Beside, sheet, tubes
from supple.results.view.look import OBSTACLE, Look, drawn_as, theme
from supple.results.view.model import Model, RenderFrame
from supple.results.view.skin_contact import kept_out
from supple.scene.obstacles.obstacle import Obstacle
from supple.scene.rod import Rod
from supple.scene.rows import BodyRows
from supple.scene.shell import Shell

# A container is one surface between the eye and the bodies; walls can overlap, so that each must be more transparent.
CONTAINER_OPACITY, WALL_OPACITY = 0.13, 0.05
# Between a skin and an obstacle, as a share of the scene's radius: a round wall is drawn as flat triangles within it.
SKIN_GAP = 2e-3
STRETCH = 2.0  # of the part of a skin that reaches beyond tets, at most


@dataclass(frozen=True, eq=False)
class Surface(ABC):
    """Triangles that move.

    Attributes
    ----------
    name : of the body or obstacle
    triangles : (t, 3) of its vertices, counter-clockwise from outside
    color : (r, g, b) from 0 to 255
    look : how it reflects light
    """

    name: str
    triangles: NDArray[np.int32]
    color: tuple[int, int, int]
    look: Look

    @abstractmethod
    def at(self, frame: RenderFrame) -> NDArray[np.float64]:
        """Positions (k, 3) of the vertices [m]."""

    @abstractmethod
    def at_rest(self, model: Model) -> NDArray[np.float64]:
        """Positions (k, 3) at rest, which decide where its creases are [m]."""

    @abstractmethod
    def _with_vertices(self, rows: NDArray[np.int64], triangles: NDArray[np.int32]) -> Self:
        """The same surface with these of its vertices, and triangles of them."""

    def hides_its_backs(self, model: Model) -> bool:
        """Whether it is closed and its triangles face outwards."""
        return is_closed(self.triangles) and _volume(self.at_rest(model), self.triangles) > 0.0

    def creased(self, model: Model) -> Self:
        """The same surface; vertices on creases are there once for each side, so that edges stay sharp."""
        return self._with_vertices(*split_at_creases(self.at_rest(model), self.triangles))


@dataclass(frozen=True, eq=False)
class SoftSurface(Surface):
    """The skin of a soft body, the boundary of its tets, or a sheet or tubes about its points.

    Attributes
    ----------
    body : of the model
    skin : whether the vertices are those of its skin
    rows : (k,) the vertices of the skin, or of the body, that are drawn
    beside : where they are drawn beside these; None: there
    """

    body: BodyRows
    skin: bool
    rows: NDArray[np.int64]
    beside: Beside | None = None
    opacity: ClassVar[float] = 1.0
    container: ClassVar[bool] = False
    casts_shadow: ClassVar[bool] = True
    is_floor: ClassVar[bool] = False

    def of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (k, 3) at the drawn vertices, of values (n, 3) at all vertices of the model."""
        own = values[self.body.vertices]
        return (self.body.skin.positions(own) if self.skin and self.body.skin is not None else own)[self.rows]

    def at(self, frame: RenderFrame) -> NDArray[np.float64]:
        x, kept = self._drawn(frame.finite_positions), frame.model.beyond_tets.get(self.name)
        if kept is None or not self.skin:
            return x
        outside, reach = kept
        rows, gap = np.flatnonzero(outside[self.rows]), SKIN_GAP * frame.model.view.radius
        return kept_out(x, rows, STRETCH * reach, frame.model.obstacles, frame.poses, gap)

    def at_rest(self, model: Model) -> NDArray[np.float64]:
        return self._drawn(model.rest_positions)

    @property
    def layers(self) -> int:
        return 1 if self.beside is None else self.beside.layers

    def _drawn(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        points = self.of(x)
        return points if self.beside is None else points + self.beside.offsets(x[self.body.vertices], self.rows)

    def _with_vertices(self, rows: NDArray[np.int64], triangles: NDArray[np.int32]) -> Self:
        beside = None if self.beside is None else self.beside.taken(rows)
        return replace(self, rows=self.rows[rows], triangles=triangles, beside=beside)


@dataclass(frozen=True, eq=False)
class RigidSurface(Surface):
    """The surface of a rigid body or an obstacle.

    Attributes
    ----------
    vertices : (k, 3) in its own coordinates [m]
    pose : (3, 4) rotation and translation of a frame
    opacity : from 0 to 1
    container : whether it is seen from within; its triangles face outwards, and a page draws only their backs
    casts_shadow : on floors; planes and containers do not
    is_floor : whether it is a plane that bodies stand on, which pictures draw as a disc
    obstacle : that it shows; None of a body or a rim
    """

    vertices: NDArray[np.float64]
    pose: Callable[[RenderFrame], NDArray[np.float64]]
    opacity: float = 1.0
    container: bool = False
    casts_shadow: bool = True
    is_floor: bool = False
    obstacle: Obstacle | None = None
    layers: ClassVar[int] = 1

    def at(self, frame: RenderFrame) -> NDArray[np.float64]:
        pose = self.pose(frame)
        return self.vertices @ pose[:, :3].T + pose[:, 3]

    def at_rest(self, model: Model) -> NDArray[np.float64]:
        return self.vertices

    def _with_vertices(self, rows: NDArray[np.int64], triangles: NDArray[np.int32]) -> Self:
        return replace(self, vertices=self.vertices[rows], triangles=triangles)


def has_fields(surface: SoftSurface | RigidSurface) -> TypeGuard[SoftSurface]:
    """Whether it shows the fields of tets: neither a rigid body nor a shell has them."""
    return isinstance(surface, SoftSurface) and surface.body.tets.stop > surface.body.tets.start


def surfaces_of(model: Model, *, skins: bool = True, dark: bool = False) -> list[SoftSurface | RigidSurface]:
    """Those of all bodies, then those of all obstacles."""
    return [*(body_surface(model, body, skins=skins) for body in model.bodies), *obstacle_surfaces(model, dark)]


def body_surface(model: Model, body: BodyRows, *, skins: bool = True) -> SoftSurface | RigidSurface:
    """The skin of a body; its boundary where it has none, or, if it is soft, without `skins`."""
    if body.skin is None or not (skins or body.rigid):
        return boundary_surface(body)
    if not body.rigid:
        rows = np.arange(len(body.skin.corners))
        return SoftSurface(body.name, body.skin.triangles, *drawn_as(body), body, True, rows)
    # Its control points give the pose; the coordinates begin at the center of mass, their mean.
    rest = model.rest_positions[body.vertices]
    center = rest.mean(axis=0)
    inverse = np.linalg.inv((rest[1:] - rest[0]).T)

    def pose(frame: RenderFrame) -> NDArray[np.float64]:
        x = frame.finite_positions[body.vertices]
        return np.column_stack([(x[1:] - x[0]).T @ inverse, x.mean(axis=0)])

    vertices = body.skin.positions(rest) - center
    return RigidSurface(body.name, body.skin.triangles, *drawn_as(body), vertices, pose)


def boundary_surface(body: BodyRows) -> SoftSurface:
    """The boundary of a body's tets; of a shell both sides and the rims; of a rod tubes."""
    if isinstance(body.body, Rod):
        mesh = body.body.mesh
        rows, closed, beside = tubes(np.hstack([mesh.line, mesh.material_points]), mesh.radius)
        return SoftSurface(body.name, closed, *drawn_as(body), body, False, rows, beside)
    if isinstance(body.body, Shell):
        rows, closed, beside = sheet(body.boundary, body.body.material.thickness)
        return SoftSurface(body.name, closed, *drawn_as(body), body, False, rows, beside)
    used, rows = np.unique(body.boundary, return_inverse=True)
    triangles = rows.reshape(-1, 3).astype(np.int32)
    return SoftSurface(body.name, triangles, *drawn_as(body), body, False, used.astype(np.int64))


def obstacle_surfaces(model: Model, dark: bool = False) -> list[RigidSurface]:
    """Those of the obstacles before a bright or `dark` background; a half-space is drawn as a square about the bodies.

    Obstacles that would hide the bodies are transparent: containers, and half-spaces that are not a floor. Of a
    container the lower half is drawn, so that it looks like a bowl.
    """
    made, view, color = [], model.view, theme(dark).obstacle
    for number, obstacle in enumerate(model.obstacles):
        vertices, triangles = obstacle.drawn(view.center, 2.5 * view.radius)
        is_wall = obstacle.plane is not None and float(obstacle.plane[1] @ view.up) < 0.5
        opacity = WALL_OPACITY if is_wall else CONTAINER_OPACITY if obstacle.is_container else 1.0
        triangles = triangles.astype(np.int32)
        if obstacle.is_container and _volume(vertices, triangles) < 0.0:
            triangles = triangles[:, ::-1].copy()
        solid, pose = obstacle.plane is None and not obstacle.is_container, _pose_of(number)
        if obstacle.is_container:
            vertices, triangles = _lower_half(vertices, triangles, view.up)
        made.append(
            RigidSurface(
                str(obstacle.name),
                triangles,
                color,
                OBSTACLE,
                vertices,
                pose,
                opacity,
                obstacle.is_container,
                solid,
                obstacle.plane is not None and not is_wall,
                obstacle,
            )
        )
        rim = rim_of(vertices, triangles, view.up, _RIM * view.radius) if obstacle.is_container else None
        if rim is not None:
            made.append(RigidSurface(f"{obstacle.name!s}, rim", rim[1], color, OBSTACLE, rim[0], pose))
    return made


_RIM = 0.018  # radius of the rim of a bowl, as a share of that of the scene


def rim_of(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], up: NDArray[np.float64], radius: float
) -> tuple[NDArray[np.float64], NDArray[np.int32]] | None:
    """A tube along the edge of an open surface, which is one loop about `up`; None where none exists."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    edges, back = start * np.int64(len(vertices)) + end, end * np.int64(len(vertices)) + start
    follows = dict(zip(*(rows[~np.isin(edges, back)].tolist() for rows in (start, end)), strict=True))
    if not follows:
        return None
    loop = [next(iter(follows))]
    while (following := follows.get(loop[-1])) is not None and following != loop[0] and len(loop) <= len(follows):
        loop.append(following)
    if len(loop) != len(follows) or len(loop) < 3:
        return None
    x = vertices[loop]
    out = x - x.mean(axis=0)
    out -= np.outer(out @ up, up)
    out /= np.linalg.norm(out, axis=1)[:, None]
    turns = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
    ring = np.cos(turns)[:, None] * out[:, None] + np.sin(turns)[:, None] * up
    n, m = len(loop), len(turns)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b, c, d = (((i + p) % n * m + (j + q) % m).ravel() for p, q in ((0, 0), (1, 0), (1, 1), (0, 1)))
    tube = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]).astype(np.int32)
    points = (x[:, None] + radius * ring).reshape(-1, 3)
    return points, tube if _volume(points, tube) > 0.0 else tube[:, ::-1].copy()


def _pose_of(obstacle: int) -> Callable[[RenderFrame], NDArray[np.float64]]:
    return lambda frame: frame.poses[obstacle]


def _lower_half(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], up: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """The part of a surface below the middle of its height."""
    from trimesh import Trimesh  # only where something is drawn
    from trimesh.intersections import slice_faces_plane

    heights = vertices @ up
    middle = 0.5 * float(heights.min() + heights.max()) * up
    points, below, _ = slice_faces_plane(vertices, triangles, plane_normal=-up, plane_origin=middle)
    joined = Trimesh(points, below)  # both sides of an edge were cut by themselves
    return np.asarray(joined.vertices, dtype=np.float64), np.asarray(joined.faces, dtype=np.int32)


def _volume(x: NDArray[np.float64], triangles: NDArray[np.int32]) -> float:
    """Of what a closed surface encloses [m^3]; below zero where its triangles face inwards."""
    a, b, c = (x[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


# Between the normals of two triangles. The facets of a coarse ball differ by less: a tet mesh of a tenth of the
# diameter as edge length has about 12 degrees, one of half of it 33; the edges of machine parts have 45 and more.
CREASE = np.radians(40.0)


def split_at_creases(
    x: NDArray[np.float64], triangles: NDArray[np.int32]
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Vertices x (k, 3) once for each smooth part around them: which vertex (j,) each is, and triangles (t, 3) of them.

    Two triangles are of one part where they share an edge, with no third one, and their normals differ by less than
    `CREASE`.
    """
    normals = _area_vectors(x, triangles)
    lengths = np.linalg.norm(normals, axis=1)
    normals /= np.where(lengths > 0.0, lengths, 1.0)[:, None]
    # Half-edge 3 t + k goes from corner k of triangle t to the next one.
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    _, edge, count = np.unique(
        np.minimum(start, end) * np.int64(len(x)) + np.maximum(start, end), return_inverse=True, return_counts=True
    )
    order = np.argsort(edge, kind="stable")
    paired = order[count[edge[order]] == 2].reshape(-1, 2)
    owner = paired // 3
    # A triangle without area has no normal, and makes no crease.
    flat = (lengths[owner] == 0.0).any(axis=1)
    smooth = flat | (np.einsum("ij,ij->i", normals[owner[:, 0]], normals[owner[:, 1]]) > np.cos(CREASE))
    a, b = paired[smooth].T
    following = 3 * (np.arange(len(start)) // 3) + (np.arange(len(start)) % 3 + 1) % 3
    turned = start[a] == end[b]  # neighbours with the same orientation
    links = np.concatenate(
        [
            np.stack([a, np.where(turned, following[b], b)], axis=1),
            np.stack([following[a], np.where(turned, b, following[b])], axis=1),
        ]
    )
    graph = coo_array((np.ones(len(links), dtype=bool), (links[:, 0], links[:, 1])), shape=(len(start), len(start)))
    parts, label = connected_components(graph, directed=False)
    rows = np.empty(parts, dtype=np.int64)
    rows[label] = start
    return rows, label.reshape(-1, 3).astype(np.int32)


def _area_vectors(x: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float64]:
    a, b, c = (x[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)
