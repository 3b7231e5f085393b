"""Blender add-on: soft bodies by Supple. Choose what an object is in the panel, simulate, and play the animated cache.

Supple runs as a process of its own, in the Python that it is installed in (preferences of the add-on).
"""

bl_info = {
    "name": "Supple soft bodies",
    "author": "The developers of Supple",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D view > side bar > Supple",
    "description": "Simulates the soft bodies of the scene with Supple",
    "category": "Animation",
}

import os
import shutil
import tempfile
from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import job, process


def default_python():
    """The Python beside the command `supple` on the path, or the one named by SUPPLE_PYTHON."""
    if named := os.environ.get("SUPPLE_PYTHON"):
        return named
    command = shutil.which("supple")
    beside = Path(command).resolve().parent / "python" if command else None
    return str(beside) if beside is not None and beside.exists() else "python3"


class SupplePreferences(bpy.types.AddonPreferences):
    bl_idname = __name__

    python: StringProperty(
        name="Python of Supple",
        description="The Python that Supple is installed in (pip install supple)",
        subtype="FILE_PATH",
        default=default_python(),
    )

    def draw(self, context):
        self.layout.prop(self, "python")


class SuppleObject(bpy.types.PropertyGroup):
    """What an object is in the simulation."""

    role: EnumProperty(
        name="Role",
        items=[
            ("NONE", "None", "Not part of the simulation"),
            ("SOFT", "Soft body", "Its closed surface is filled with tetrahedra"),
            ("SHELL", "Cloth", "A thin sheet, whose surface may be open"),
            ("OBSTACLE", "Obstacle", "Soft bodies collide with it; its location and rotation may be animated"),
        ],
    )
    youngs: FloatProperty(name="Young's modulus [Pa]", default=5e4, min=1.0, soft_max=1e7)
    poisson: FloatProperty(name="Poisson's ratio", default=0.4, min=0.0, max=0.499)
    density: FloatProperty(name="Density [kg/m³]", default=1000.0, min=1e-3)
    damping: FloatProperty(name="Damping [s]", default=0.005, min=0.0)
    friction: FloatProperty(name="Friction", default=0.5, min=0.0, soft_max=1.0)
    tets: IntProperty(name="Tetrahedra", description="Their number, within 10 %", default=3000, min=20)
    thickness: FloatProperty(name="Thickness [m]", default=2e-3, min=1e-6, precision=4)
    repair: BoolProperty(
        name="Repair", description="Repair a surface with holes or crossings first (needs supple[dirty])"
    )
    pinned: StringProperty(
        name="Pinned", description="Vertex group that follows the object's animation: armature, shape keys, location"
    )


class SuppleScene(bpy.types.PropertyGroup):
    """Settings of the simulation."""

    solver: EnumProperty(
        name="Solver",
        items=[("xpbd", "XPBD", "Fast"), ("implicit", "Implicit", "Accurate, free of intersections")],
    )
    floor: BoolProperty(name="Floor", description="A plane at the height below", default=True)
    floor_height: FloatProperty(name="Height [m]", default=0.0)


class SUPPLE_OT_simulate(bpy.types.Operator):
    """Simulate the soft bodies of the scene over its frames, and play the result"""

    bl_idname = "supple.simulate"
    bl_label = "Simulate"
    bl_options = {"REGISTER", "UNDO"}

    def invoke(self, context, event):
        """Start Supple; the window stays free, and Esc ends the simulation."""
        if not self._start(context):
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.progress_begin(0, max(1, self._frames))
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self._run.end()
            self.report({"WARNING"}, "the simulation was ended; the earlier cache, if any, is unchanged")
            return self._done(context, {"CANCELLED"})
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        context.window_manager.progress_update(self._run.frame())
        if self._run.is_running():
            return {"PASS_THROUGH"}
        return self._done(context, self._finish(context))

    def execute(self, context):
        """Without a window: wait for the end."""
        if not self._start(context):
            return {"CANCELLED"}
        self._run.wait()
        result = self._finish(context)
        self._folder.cleanup()
        return result

    def _start(self, context):
        self._folder = tempfile.TemporaryDirectory(prefix="supple-blender-")
        try:
            self._names = job.write(context, Path(self._folder.name))
        except job.JobError as error:
            self._folder.cleanup()
            self.report({"ERROR"}, str(error))
            return False
        self._frames = context.scene.frame_end - context.scene.frame_start
        addon = context.preferences.addons.get(__name__)
        python = addon.preferences.python if addon is not None else default_python()
        try:
            self._run = process.Run(bpy.path.abspath(python), Path(self._folder.name))
        except OSError as error:
            self._folder.cleanup()
            self.report(
                {"ERROR"}, f"{python} could not be started ({error.strerror}); set it in the add-on's preferences"
            )
            return False
        return True

    def _finish(self, context):
        if self._run.code() != 0:
            self.report({"ERROR"}, self._run.last_error())
            return {"CANCELLED"}
        for name, positions in self._run.results(self._names):
            job.attach_cache(context, bpy.data.objects[name], positions)
        for line in self._run.warnings():
            self.report({"WARNING"}, line)
        self.report({"INFO"}, self._run.summary())
        context.scene.frame_set(context.scene.frame_start)
        return {"FINISHED"}

    def _done(self, context, result):
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        self._folder.cleanup()
        return result


class SUPPLE_OT_clear(bpy.types.Operator):
    """Remove the simulated motion from the selected objects"""

    bl_idname = "supple.clear"
    bl_label = "Clear"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        for thing in context.selected_objects:
            job.remove_cache(thing)
        return {"FINISHED"}


class SUPPLE_PT_panel(bpy.types.Panel):
    bl_label = "Supple"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Supple"

    def draw(self, context):
        layout, settings, thing = self.layout, context.scene.supple, context.object
        if thing is not None and thing.type == "MESH":
            values = thing.supple
            layout.label(text=thing.name)
            layout.prop(values, "role")
            if values.role in ("SOFT", "SHELL"):
                own = ("tets", "repair") if values.role == "SOFT" else ("thickness",)
                for key in ("youngs", "poisson", "density", "damping", "friction", *own):
                    layout.prop(values, key)
                layout.prop_search(values, "pinned", thing, "vertex_groups")
            elif values.role == "OBSTACLE":
                layout.prop(values, "friction")
        layout.separator()
        layout.prop(settings, "solver")
        layout.prop(settings, "floor")
        if settings.floor:
            layout.prop(settings, "floor_height")
        layout.operator(SUPPLE_OT_simulate.bl_idname, icon="PLAY")
        layout.operator(SUPPLE_OT_clear.bl_idname, icon="X")


CLASSES = (
    SupplePreferences,
    SuppleObject,
    SuppleScene,
    SUPPLE_OT_simulate,
    SUPPLE_OT_clear,
    SUPPLE_PT_panel,
)


def register():
    for item in CLASSES:
        bpy.utils.register_class(item)
    bpy.types.Object.supple = PointerProperty(type=SuppleObject)
    bpy.types.Scene.supple = PointerProperty(type=SuppleScene)


def unregister():
    del bpy.types.Scene.supple
    del bpy.types.Object.supple
    for item in reversed(CLASSES):
        bpy.utils.unregister_class(item)
