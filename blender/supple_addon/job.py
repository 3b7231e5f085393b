"""Between Blender's objects and the folder of a simulation: what is simulated, and the cache of the result."""

import json
import struct
from pathlib import Path

import bpy
import numpy as np

MODIFIER = "Supple"

# Modifiers that move vertices and keep their number; others come after the cache.
_DEFORMS = {
    "ARMATURE", "CAST", "CORRECTIVE_SMOOTH", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM", "LATTICE", "MESH_CACHE",
    "MESH_DEFORM", "SHRINKWRAP", "SIMPLE_DEFORM", "SMOOTH", "SURFACE_DEFORM", "VOLUME_DISPLACE", "WARP", "WAVE",
}  # fmt: skip


class JobError(Exception):
    """What cannot be simulated, and the remedy."""


def write(context, folder):
    """Write the scene of the simulation to a folder; returns the names of the soft bodies in their order.

    Positions are in metres in Blender's world, where z is up. `arrays_K.npz` of a body holds its vertices (n, 3) in the
    first frame, its triangles (m, 3), which vertices are pinned (n,), and where those are in each frame (f, k, 3);
    that of an obstacle its vertices and triangles, and its place (f, 3) and rotation (f, 3, 3) in each frame.
    """
    scene = context.scene
    things = [thing for thing in scene.objects if thing.type == "MESH" and thing.supple.role != "NONE"]
    bodies = [thing for thing in things if thing.supple.role in ("SOFT", "SHELL")]
    obstacles = [thing for thing in things if thing.supple.role == "OBSTACLE"]
    if not bodies:
        raise JobError("no object is a soft body; choose the role 'Soft body' or 'Cloth' in the panel Supple")
    if scene.frame_end <= scene.frame_start:
        raise JobError("the scene has one frame only; set its end after its start")
    for thing in bodies:
        if thing.supple.pinned and thing.supple.pinned not in thing.vertex_groups:
            raise JobError(
                f"{thing.name}: the vertex group {thing.supple.pinned!r} does not exist; choose another in Pinned"
            )
    paths, places = _motions(context, bodies, obstacles)
    described = []
    for k, thing in enumerate(bodies):
        values, path = thing.supple, paths[thing.name]
        pinned = _weights(thing, values.pinned) > 0.5
        if values.pinned and not pinned.any():
            raise JobError(f"{thing.name}: no vertex of the group {values.pinned!r} has a weight above 0.5")
        np.savez(
            folder / f"arrays_{k}.npz",
            vertices=path[0],
            triangles=_triangles(thing),
            pinned=pinned,
            path=path[:, pinned],
        )
        keys = ("role", "youngs", "poisson", "density", "damping", "friction", "tets", "repair", "thickness")
        described.append(
            {"name": thing.name, "arrays": f"arrays_{k}.npz", **{key: getattr(values, key) for key in keys}}
        )
    hard = []
    for k, thing in enumerate(obstacles, start=len(bodies)):
        matrices = places[thing.name]
        np.savez(
            folder / f"arrays_{k}.npz",
            vertices=_vertices(thing.data) @ matrices[0, :3, :3].T + matrices[0, :3, 3],
            triangles=_triangles(thing),
            path=matrices[:, :3, 3],
            turns=_turns(thing, matrices[:, :3, :3]),
        )
        hard.append({"name": thing.name, "arrays": f"arrays_{k}.npz", "friction": thing.supple.friction})
    settings = scene.supple
    whole = {
        "frames": scene.frame_end - scene.frame_start,
        "dt": scene.render.fps_base / scene.render.fps,
        "gravity": list(scene.gravity) if scene.use_gravity else [0.0, 0.0, 0.0],
        "floor": settings.floor_height if settings.floor else None,
        "solver": settings.solver,
        "bodies": described,
        "obstacles": hard,
    }
    (folder / "job.json").write_text(json.dumps(whole), "utf-8")
    return [thing.name for thing in bodies]


def attach_cache(context, thing, positions):
    """Let an object play positions (f, n, 3) in the world [m], one for each frame of the scene.

    They are kept in a PC2 file, beside the .blend file or, without one, in Blender's temporary folder.
    """
    scene = context.scene
    local = np.empty_like(positions)
    for k, x in enumerate(positions):
        scene.frame_set(scene.frame_start + k)
        world = np.array(thing.matrix_world)
        local[k] = np.linalg.solve(world[:3, :3], (x - world[:3, 3]).T).T
    beside = Path(bpy.path.abspath("//")) if bpy.data.filepath else Path(bpy.app.tempdir)
    folder = beside / "supple_cache"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{bpy.path.clean_name(thing.name)}.pc2"
    fresh = path.with_suffix(".new")
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, local.shape[1], scene.frame_start, 1.0, len(local))
    fresh.write_bytes(header + np.ascontiguousarray(local, dtype="<f4").tobytes())
    fresh.replace(path)
    remove_cache(thing)
    modifier = thing.modifiers.new(MODIFIER, "MESH_CACHE")
    modifier.cache_format = "PC2"
    modifier.filepath = bpy.path.relpath(str(path)) if bpy.data.filepath else str(path)
    modifier.frame_start = scene.frame_start
    with context.temp_override(object=thing):
        bpy.ops.object.modifier_move_to_index(modifier=modifier.name, index=_deforms(thing))


def remove_cache(thing):
    """Remove the modifier of an earlier simulation, if there is one."""
    modifier = thing.modifiers.get(MODIFIER)
    if modifier is not None and modifier.type == "MESH_CACHE":
        thing.modifiers.remove(modifier)


def _deforms(thing):
    """How many modifiers at the beginning of the stack keep the number of vertices, the cache left out."""
    count = 0
    for modifier in thing.modifiers:
        if modifier.name == MODIFIER:
            continue
        if modifier.type not in _DEFORMS:
            break
        count += 1
    return count


def _motions(context, bodies, obstacles):
    """By name: where vertices of bodies were without a simulation (f, n, 3), and matrices of obstacles (f, 4, 4)."""
    scene = context.scene
    current = scene.frame_current
    hidden = [
        modifier
        for thing in bodies
        for k, modifier in enumerate(thing.modifiers)
        if modifier.show_viewport and (modifier.name == MODIFIER or modifier.type not in _DEFORMS)
    ]
    for modifier in hidden:
        modifier.show_viewport = False
    paths = {thing.name: [] for thing in bodies}
    places = {thing.name: [] for thing in obstacles}
    try:
        for frame in range(scene.frame_start, scene.frame_end + 1):
            scene.frame_set(frame)
            graph = context.evaluated_depsgraph_get()
            for thing in bodies:
                evaluated = thing.evaluated_get(graph)
                x = _vertices(evaluated.data)
                if len(x) != len(thing.data.vertices):
                    raise JobError(f"{thing.name}: its modifiers change the number of vertices; apply or disable them")
                world = np.array(evaluated.matrix_world)
                paths[thing.name].append(x @ world[:3, :3].T + world[:3, 3])
            for thing in obstacles:
                places[thing.name].append(np.array(thing.evaluated_get(graph).matrix_world))
    finally:
        for modifier in hidden:
            modifier.show_viewport = True
        scene.frame_set(current)
    return {name: np.array(x) for name, x in paths.items()}, {name: np.array(x) for name, x in places.items()}


def _turns(thing, matrices):
    """The rotation (f, 3, 3) of an obstacle since the first frame, from its matrices (f, 3, 3)."""
    turns = matrices @ np.linalg.inv(matrices[0])
    if np.abs(turns @ turns.transpose(0, 2, 1) - np.eye(3)).max() > 1e-4:
        raise JobError(f"{thing.name}: an obstacle can move and turn; keep its scale")
    return turns


def _vertices(mesh):
    x = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get("co", x)
    return x.reshape(-1, 3).astype(np.float64)


def _triangles(thing):
    mesh = thing.data
    mesh.calc_loop_triangles()
    triangles = np.empty(3 * len(mesh.loop_triangles), dtype=np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    triangles = triangles.reshape(-1, 3)
    return triangles if np.linalg.det(np.array(thing.matrix_world)[:3, :3]) > 0.0 else triangles[:, ::-1]


def _weights(thing, name):
    """The weight of each vertex in a group; zeros without a name."""
    weights = np.zeros(len(thing.data.vertices))
    if name:
        number = thing.vertex_groups[name].index
        for vertex in thing.data.vertices:
            for member in vertex.groups:
                if member.group == number:
                    weights[vertex.index] = member.weight
    return weights
