"""Generated series of soft bodies without faults, faults to plant in them, and writers of many formats."""

import json
import struct
from dataclasses import dataclass, replace

import h5py
import meshio
import numpy as np

import supple as sp
from supple.mesh.io import obj, ply, vtk_xml

FRAMES, DT = 9, 1 / 60


@dataclass(frozen=True)
class Frames:
    """Positions (frames, n, 3), tets, and triangles of the boundary and of a sheet; `numbers` of the frames."""

    positions: np.ndarray
    tets: np.ndarray
    triangles: np.ndarray
    numbers: np.ndarray


def clean(seed: int) -> Frames:
    """Two boxes, one above the other, that move, turn and shear (which keeps volumes), a sheet between them, and a tet
    that stands on the plane z = 0 beside them."""
    random = np.random.default_rng(seed)
    counts = tuple(int(k) for k in random.integers(1, 4, 3))
    box = sp.shapes.box((1.0, 1.0, 1.0), counts)
    v = np.array(box.vertices) + 0.5
    side = 3
    grid = np.stack(np.meshgrid(np.linspace(-1, 2, side + 1), np.linspace(-1, 2, side + 1), indexing="ij"), axis=-1)
    sheet = np.column_stack([grid.reshape(-1, 2), np.full((side + 1) ** 2, 1.5)]) + random.uniform(-0.1, 0.1, 3)
    row = lambda i, j: i * (side + 1) + j  # noqa: E731
    cloth = np.array(
        [t for i in range(side) for j in range(side)
         for t in ([row(i, j), row(i + 1, j), row(i + 1, j + 1)], [row(i, j), row(i + 1, j + 1), row(i, j + 1)])]
    )  # fmt: skip
    alone = np.array([[4.0, 0, 0], [5, 0, 0], [4, 1, 0], [4, 0, 1]])
    spin, shear = random.uniform(-2, 2), random.uniform(-0.3, 0.3)
    frames = []
    middle = FRAMES // 2
    for k in range(FRAMES):
        t = (k - middle) * DT
        angle = spin * t
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        bend = np.array([[1, 0, shear * 3 * t], [0, 1, 0], [0, 0, 1]])
        low = v @ (turn @ bend).T + [0.4 * t, 0, 0.7 * t]
        high = v @ turn + [0.1, 0.2, 2.0 - 0.8 * t]
        wave = sheet + np.array([0, 0, 0.3 * t])
        frames.append(np.concatenate([low, high, wave, alone + np.array([0.2 * t, 0, 0])]))
    surface = box.surface.triangles
    n = len(v)
    last = 2 * n + len(sheet)
    tets = np.concatenate([box.tets, box.tets + n, [[last, last + 1, last + 2, last + 3]]])
    facets = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]) + last
    triangles = np.concatenate([surface, surface + n, cloth + 2 * n, facets])
    return Frames(np.stack(frames), tets, triangles, np.arange(FRAMES))


def inverted(frames: Frames) -> Frames:
    """In the middle frame the apex of the tet that stands alone is below its base by 1e-9 of its size."""
    x = frames.positions.copy()
    x[FRAMES // 2, frames.tets[-1, 3], 2] = -1e-9
    return replace(frames, positions=x)


def crossing(frames: Frames) -> Frames:
    """In one frame a vertex of the upper box is below the sheet."""
    x = frames.positions.copy()
    n = _corners(frames)
    lowest = n + int(np.argmin(x[3, n : 2 * n, 2]))
    x[3, lowest, 2] = x[3, 2 * n, 2] - 0.05
    return replace(frames, positions=x)


def passing(frames: Frames) -> Frames:
    """From one frame to the next the sheet jumps through the upper box."""
    x = frames.positions.copy()
    x[5:, 2 * _corners(frames) : -4, 2] += 2.4
    return replace(frames, positions=x)


def drifting(frames: Frames) -> Frames:
    """The lower box grows by 1 % in volume over all frames."""
    x = frames.positions.copy()
    n = _corners(frames)
    for k in range(FRAMES):
        center = x[k, :n].mean(axis=0)
        x[k, :n] = center + (x[k, :n] - center) * (1.0 + 0.0101 * k / (FRAMES - 1)) ** (1 / 3)
    return replace(frames, positions=x)


def missing(frames: Frames) -> Frames:
    keep = np.arange(FRAMES) != 4
    return replace(frames, positions=frames.positions[keep], numbers=frames.numbers[keep])


def rescaled(frames: Frames) -> Frames:
    """From one frame on lengths are in centimetres."""
    x = frames.positions.copy()
    x[6:] *= 100.0
    return replace(frames, positions=x)


def broken(frames: Frames) -> Frames:
    x = frames.positions.copy()
    x[2, 3, 1] = np.nan
    return replace(frames, positions=x)


def _corners(frames: Frames) -> int:
    """How many points each box has."""
    return int(frames.tets[len(frames.tets) // 2 - 1].max()) + 1


FAULTS = {
    "inversion": inverted,
    "intersection": crossing,
    "tunnelling": passing,
    "volume": drifting,
    "sequence": missing,
    "scale": rescaled,
    "finite": broken,
}


def write_npz(frames, folder):
    np.savez(folder / "out.npz", positions=frames.positions, tets=frames.tets, triangles=frames.triangles)
    return folder / "out.npz"


def write_folder(frames, folder):
    np.save(folder / "positions.npy", frames.positions)
    np.save(folder / "tets.npy", frames.tets)
    np.save(folder / "triangles.npy", frames.triangles)
    return folder


def write_mujoco(frames, folder):
    path = folder / "flex.npz"
    np.savez(
        path, flexvert_xpos=frames.positions, flex_elem=frames.tets.ravel(), flex_dim=[3], tri_indices=frames.triangles
    )
    return path


def _files(frames, folder, suffix, written):
    for number, x in zip(frames.numbers, frames.positions, strict=True):
        (folder / f"frame_{number:04}.{suffix}").write_bytes(written(x))
    return folder


def write_obj(frames, folder):
    return _files(frames, folder, "obj", lambda x: obj.written(x, frames.triangles))


def write_ply(frames, folder):
    return _files(frames, folder, "ply", lambda x: ply.written(x, frames.triangles)) / "frame_*.ply"


def _grid(frames, x, path):
    meshio.Mesh(x, [("tetra", frames.tets), ("triangle", frames.triangles)]).write(path)


def write_vtu(frames, folder):
    for number, x in zip(frames.numbers, frames.positions, strict=True):
        _grid(frames, x, folder / f"out.{number}.vtu")
    return folder


def write_vtk(frames, folder):
    for number, x in zip(frames.numbers, frames.positions, strict=True):
        _grid(frames, x, folder / f"out{number}.vtk")
    return folder


def write_pvd(frames, folder):
    """Two parts for each time: the tets, and the sheet."""
    sheet = frames.triangles[~np.isin(frames.triangles, frames.tets).any(axis=1)]
    rows = []
    for number, x in zip(frames.numbers, frames.positions, strict=True):
        for part, cells in (("solid", frames.tets), ("sheet", sheet)):
            used, own = np.unique(cells, return_inverse=True)
            name = f"{part}_{number}.vtu"
            (folder / name).write_bytes(vtk_xml.written_cells(x[used], own.reshape(cells.shape)))
            rows.append(f'<DataSet timestep="{float(number * DT)!r}" part="{part}" file="{name}"/>')
    path = folder / "out.pvd"
    path.write_text(f'<VTKFile type="Collection"><Collection>{"".join(rows)}</Collection></VTKFile>')
    return path


def write_usd(frames, folder):
    """One TetMesh for the tets, one Mesh for the sheet, with a time sample for each frame."""
    from pxr import Usd, UsdGeom, Vt

    path = folder / "out.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(60)
    sheet = frames.triangles[~np.isin(frames.triangles, frames.tets).any(axis=1)]
    for name, cells in (("solid", frames.tets), ("sheet", sheet)):
        used, own = np.unique(cells, return_inverse=True)
        own = own.reshape(cells.shape).astype(np.int32)
        if name == "solid":
            mesh = UsdGeom.TetMesh.Define(stage, "/solid")
            mesh.CreateTetVertexIndicesAttr(Vt.Vec4iArray.FromNumpy(own))
        else:
            mesh = UsdGeom.Mesh.Define(stage, "/sheet")
            mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(own), 3, dtype=np.int32)))
            mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(own.ravel()))
        points = mesh.CreatePointsAttr()
        for number, x in zip(frames.numbers, frames.positions, strict=True):
            points.Set(Vt.Vec3fArray.FromNumpy(x[used].astype(np.float32)), Usd.TimeCode(int(number)))
    stage.GetRootLayer().Save()
    return path


def write_glb(frames, folder):
    """One mesh with a morph target for each frame but the first; corners of triangles are points of their own."""
    x = frames.positions[:, frames.triangles.ravel()].astype("<f4")
    count, targets = x.shape[1], len(x) - 1
    weights = np.eye(len(x), targets, -1, dtype="<f4")
    arrays = [x[0], *(x[1:] - x[0]), (frames.numbers * DT).astype("<f4"), weights]
    views, accessors, blob = [], [], b""
    for array in arrays:
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        vectors = array.ndim == 2 and array is not weights
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "type": "VEC3" if vectors else "SCALAR",
                          "count": len(array) if vectors else array.size})  # fmt: skip
        blob += array.tobytes()
    assert accessors[0]["count"] == count
    document = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0},
                                    "targets": [{"POSITION": k} for k in range(1, targets + 1)]}]}],
        "animations": [{"channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
                        "samplers": [{"input": targets + 1, "output": targets + 2}]}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(blob)}],
    }  # fmt: skip
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
    path = folder / "out.glb"
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def write_vtkhdf(frames, folder):
    """An UnstructuredGrid with steps that share their cells, as VTK writes it."""
    path = folder / "out.vtkhdf"
    steps, n = frames.positions.shape[:2]
    m, t = len(frames.tets), len(frames.triangles)
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 0)
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        root["Points"] = frames.positions.reshape(-1, 3)
        root["NumberOfPoints"], root["NumberOfCells"] = [n], [m + t]
        root["NumberOfConnectivityIds"] = [4 * m + 3 * t]
        root["Connectivity"] = np.concatenate([frames.tets.ravel(), frames.triangles.ravel()])
        root["Offsets"] = np.concatenate([[0], np.cumsum([4] * m + [3] * t)])
        root["Types"] = np.array([10] * m + [5] * t, dtype=np.uint8)
        own = root.create_group("Steps")
        own.attrs["NSteps"] = steps
        own["Values"] = frames.numbers * DT
        own["PointOffsets"] = np.arange(steps) * n
        own["PartOffsets"] = np.zeros(steps, dtype=np.int64)
        own["CellOffsets"] = own["ConnectivityIdOffsets"] = np.zeros((steps, 1), dtype=np.int64)
    return path


SURFACES = {"obj": write_obj, "ply": write_ply, "glb": write_glb}
WRITERS = {
    **SURFACES,
    "vtu": write_vtu,
    "vtk": write_vtk,
    "pvd": write_pvd,
    "npz": write_npz,
    "npy": write_folder,
    "mujoco": write_mujoco,
    "usd": write_usd,
    "vtkhdf": write_vtkhdf,
}
