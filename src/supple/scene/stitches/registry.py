"""All kinds of stitches. A new kind is one file and one line here."""

from __future__ import annotations

from supple.scene.stitches.springs import VertexEdgeStitch, VertexVertexStitch
from supple.scene.stitches.stitch import Stitch
from supple.scene.stitches.vertex_triangle import SoftVertexTriangleStitch

STITCHES: tuple[type[Stitch], ...] = (SoftVertexTriangleStitch, VertexVertexStitch, VertexEdgeStitch)
