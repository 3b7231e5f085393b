"""The last frame as a VTK unstructured grid. ParaView opens recordings themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from supple.results.recording.reader import Recording
from supple.results.recording.thin_cells import ratios_of, thin_cells
from supple.runtime.replacing import whole_file


def write_last_vtu(recording: Recording, output: Path) -> None:
    """Write the last frame: tets, velocities, J, body numbers and recorded fields; rigid bodies and shells as their
    surfaces, with their ratios of areas as J, and rods as lines, with those of lengths."""
    import meshio

    frame = recording[-1]
    positions, velocities = list(frame.positions.values()), list(frame.velocities.values())
    starts = np.cumsum([0, *map(len, positions)])
    triangles = [np.zeros((0, 3), np.int32)]
    of_point, of_triangle, ratios = np.zeros(starts[-1], np.int32), [], []
    parts, tets = [], []
    for i, body in enumerate(recording.bodies):
        of_point[starts[i] : starts[i + 1]] = i
        if body.rigid and body.skin is not None:
            triangles.append(body.skin.triangles + starts[i])
            of_triangle += [i] * len(body.skin.triangles)
            ratios += [float(frame.det_F[body.tets.start])] * len(body.skin.triangles)
        elif (cells := thin_cells(body)) is not None and cells.shape[1] == 3:
            triangles.append(cells + starts[i])
            of_triangle += [i] * len(cells)
            ratios += ratios_of(body, positions[i]).tolist()
        elif cells is not None:
            lines = ratios_of(body, positions[i])
            parts.append(("line", cells + starts[i], lines, np.full(len(cells), i, dtype=np.int32)))
        else:
            nodes = body.body.mesh.nodes + starts[i]
            tets.append(body.tets)
            kind = "tetra" if nodes.shape[1] == 4 else "tetra10"
            parts.append((kind, nodes, frame.det_F[body.tets], np.full(len(nodes), i, dtype=np.int32)))
    parts.sort(key=lambda part: part[0] == "line")
    if of_triangle:
        parts.append(("triangle", np.concatenate(triangles), np.array(ratios), np.array(of_triangle, dtype=np.int32)))
    at_points: dict[str, ArrayLike] = {"velocities": np.concatenate(velocities), "body": of_point}
    at_cells = {"det_F": [values for _, _, values, _ in parts], "body": [numbers for _, _, _, numbers in parts]}
    for field in recording.fields:
        values = frame.field(field.name).values_of_all
        values = values.reshape(len(values), *([int(np.prod(field.shape))] if field.shape else []))
        empty = np.full((1, *values.shape[1:]), np.nan)
        if field.at == "tets":
            surfaces = [np.repeat(empty, len(of_triangle), axis=0)] if of_triangle else []
            lines = [np.repeat(empty, len(cells), axis=0) for kind, cells, _, _ in parts if kind == "line"]
            at_cells[field.name] = [values[rows] for rows in tets] + lines + surfaces
        else:
            of_bodies = [
                np.repeat(empty, len(x), axis=0) if body.rigid else values[body.vertices]
                for body, x in zip(recording.bodies, positions, strict=True)
            ]
            at_points[field.name] = np.concatenate(of_bodies)
    mesh = meshio.Mesh(
        np.concatenate(positions),
        [(kind, cells) for kind, cells, _, _ in parts],
        point_data=at_points,
        cell_data=at_cells,
    )
    with whole_file(output) as fresh:
        mesh.write(fresh, file_format="vtu")
