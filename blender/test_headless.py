"""Blender without a window simulates with the add-on and plays the caches: run by `make blender`.

usage: blender --background --factory-startup --python-exit-code 1 --python blender/test_headless.py -- ADDON.zip
"""

import math
import sys
from pathlib import Path

import bpy
import numpy as np

FRAMES = 24


def empty_scene():
    """A scene of 25 frames, one second long, without objects."""
    bpy.data.batch_remove(bpy.data.objects)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, FRAMES + 1, 24
    return scene


def mesh_object(make, name, **place):
    """The object that an operator of Blender makes."""
    make(**place)
    thing = bpy.context.object
    thing.name = name
    return thing


def world_vertices(thing, frame):
    """Where the vertices of an object are drawn (n, 3) [m]."""
    bpy.context.scene.frame_set(frame)
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    x = np.empty(3 * len(evaluated.data.vertices), dtype=np.float32)
    evaluated.data.vertices.foreach_get("co", x)
    world = np.array(evaluated.matrix_world)
    return x.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]


def a_ball_falls_on_the_floor_and_a_lift():
    scene = empty_scene()
    ball = mesh_object(bpy.ops.mesh.primitive_ico_sphere_add, "ball", radius=0.1, subdivisions=3, location=(0, 0, 0.2))
    ball.scale = (1.0, 1.0, 0.8)
    ball.supple.role, ball.supple.tets = "SOFT", 300
    other = mesh_object(
        bpy.ops.mesh.primitive_ico_sphere_add, "other", radius=0.1, subdivisions=3, location=(1, 0, 0.4)
    )
    other.supple.role, other.supple.tets = "SOFT", 300
    lift = mesh_object(bpy.ops.mesh.primitive_cube_add, "lift", size=0.2, location=(1, 0, 0.1))
    lift.supple.role = "OBSTACLE"
    lift.keyframe_insert("location", frame=1)
    lift.location = (1, 0, 0.4)
    lift.keyframe_insert("location", frame=FRAMES + 1)
    assert bpy.ops.supple.simulate() == {"FINISHED"}
    first, last = world_vertices(ball, 1), world_vertices(ball, FRAMES + 1)
    assert abs(first[:, 2].min() - 0.12) < 1e-3, first[:, 2].min()
    assert -2e-3 < last[:, 2].min() < 0.02, last[:, 2].min()
    assert last[:, 2].max() > 0.1
    lifted = world_vertices(other, FRAMES + 1)
    assert lifted[:, 2].min() > 0.47, lifted[:, 2].min()
    modifier = ball.modifiers["Supple"]
    assert modifier.type == "MESH_CACHE"
    # Once more: the cache is replaced, and the simulation starts from the shape itself.
    scene.supple.floor_height = 0.05
    assert bpy.ops.supple.simulate() == {"FINISHED"}
    assert [item.type for item in ball.modifiers] == ["MESH_CACHE"]
    assert 0.048 < world_vertices(ball, FRAMES + 1)[:, 2].min() < 0.07
    bpy.ops.object.select_all(action="SELECT")
    assert bpy.ops.supple.clear() == {"FINISHED"}
    assert not ball.modifiers


def a_cloth_falls_on_the_floor():
    scene = empty_scene()
    scene.supple.solver = "implicit"
    cloth = mesh_object(
        bpy.ops.mesh.primitive_grid_add, "cloth", x_subdivisions=6, y_subdivisions=6, size=0.4, location=(0, 0, 0.05)
    )
    cloth.supple.role, cloth.supple.thickness = "SHELL", 4e-3
    assert bpy.ops.supple.simulate() == {"FINISHED"}
    heights = world_vertices(cloth, FRAMES + 1)[:, 2]
    assert 2e-3 < heights.min() < heights.max() < 4e-3, heights


def a_paddle_turns_a_ball_aside():
    scene = empty_scene()
    scene.supple.floor_height = 0.0
    ball = mesh_object(
        bpy.ops.mesh.primitive_ico_sphere_add, "ball", radius=0.1, subdivisions=3, location=(0.2, 0, 0.11)
    )
    ball.supple.role, ball.supple.tets = "SOFT", 300
    paddle = mesh_object(bpy.ops.mesh.primitive_cube_add, "paddle", size=1, location=(0, -0.2, 0.15))
    paddle.scale = (0.8, 0.04, 0.25)
    paddle.supple.role = "OBSTACLE"
    paddle.rotation_euler = (0.2, 0.0, 0.0)
    paddle.keyframe_insert("rotation_euler", frame=1)
    paddle.rotation_euler = (0.2, 0.0, math.radians(50))
    paddle.keyframe_insert("rotation_euler", frame=FRAMES + 1)
    assert bpy.ops.supple.simulate() == {"FINISHED"}
    for frame in (1, FRAMES // 2, FRAMES + 1):
        x = world_vertices(ball, frame)
        local = (x - np.array(paddle.matrix_world)[:3, 3]) @ np.linalg.inv(np.array(paddle.matrix_world)[:3, :3]).T
        assert local[:, 1].min() > 0.48, (frame, local[:, 1].min())  # in front of the paddle's side
    assert world_vertices(ball, FRAMES + 1)[:, 1].mean() > 0.1


def an_armature_drives_pins():
    empty_scene()
    bpy.ops.object.armature_add(location=(0, 0, 1))
    rig = bpy.context.object
    bar = mesh_object(bpy.ops.mesh.primitive_cube_add, "bar", size=1.0, location=(0.4, 0, 1))
    bar.scale = (0.8, 0.1, 0.1)
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=7)
    bpy.ops.object.mode_set(mode="OBJECT")
    group = bar.vertex_groups.new(name="Bone")
    held = [vertex.index for vertex in bar.data.vertices if vertex.co.x < -0.25]
    group.add(held, 1.0, "REPLACE")
    armature = bar.modifiers.new("Armature", "ARMATURE")
    armature.object = rig
    smooth = bar.modifiers.new("Subdivision", "SUBSURF")
    bone = rig.pose.bones["Bone"]
    bone.rotation_mode = "XYZ"
    bone.keyframe_insert("rotation_euler", frame=1)
    bone.rotation_euler = (0.0, 0.0, math.radians(-60))
    bone.keyframe_insert("rotation_euler", frame=FRAMES + 1)
    bar.supple.role, bar.supple.tets, bar.supple.youngs, bar.supple.pinned = "SOFT", 600, 1e6, "Bone"
    smooth.show_viewport = False
    driven = {frame: world_vertices(bar, frame)[held] for frame in (1, 13, FRAMES + 1)}
    smooth.show_viewport = True
    assert np.abs(driven[FRAMES + 1] - driven[1]).max() > 0.05
    assert bpy.ops.supple.simulate() == {"FINISHED"}
    bpy.context.scene.frame_set(FRAMES + 1)
    assert [item.type for item in bar.modifiers] == ["ARMATURE", "MESH_CACHE", "SUBSURF"]
    smooth.show_viewport = False
    for frame, expected in driven.items():
        assert np.abs(world_vertices(bar, frame)[held] - expected).max() < 1e-4, frame
    free = np.setdiff1d(np.arange(len(bar.data.vertices)), held)
    tip = world_vertices(bar, FRAMES + 1)[free]
    assert np.isfinite(tip).all()
    assert np.abs(tip - world_vertices(bar, 1)[free]).max() > 0.2


def mistakes_are_named():
    empty_scene()
    expect("no object is a soft body")
    plane = mesh_object(bpy.ops.mesh.primitive_plane_add, "sheet", size=1.0, location=(0, 0, 1))
    plane.supple.role = "SOFT"
    expect("sheet: ")
    plane.supple.pinned = "nothing"
    expect("sheet: the vertex group 'nothing' does not exist")
    plane.supple.role = "OBSTACLE"
    expect("no object is a soft body")


def expect(text):
    """The operator ends with this error."""
    try:
        bpy.ops.supple.simulate()
        message = "no error"
    except RuntimeError as error:
        message = str(error)
    assert text in message, message


bpy.ops.preferences.addon_install(filepath=str(Path(sys.argv[-1]).resolve()))
assert bpy.ops.preferences.addon_enable(module="supple_addon") == {"FINISHED"}
for test in (
    a_ball_falls_on_the_floor_and_a_lift,
    a_cloth_falls_on_the_floor,
    a_paddle_turns_a_ball_aside,
    an_armature_drives_pins,
    mistakes_are_named,
):
    test()
    print(f"passed: {test.__name__}")
bpy.ops.preferences.addon_disable(module="supple_addon")
