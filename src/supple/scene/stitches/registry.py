"""All kinds of stitches. A new kind is one file and one line here."""

from __future__ import annotations

from supple.scene.stitches.stitch import Stitch
from supple.scene.stitches.vertex_edge import VertexEdgeStitch
from supple.scene.stitches.vertex_triangle import SoftVertexTriangleStitch
from supple.scene.stitches.vertex_vertex import VertexVertexStitch

STITCHES: tuple[type[Stitch], ...] = (SoftVertexTriangleStitch, VertexVertexStitch, VertexEdgeStitch)
