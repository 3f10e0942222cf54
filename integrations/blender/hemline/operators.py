"""What the buttons do. From a script an operator waits for hemline; a button lets it work in the background."""

import bpy
from bpy.props import BoolProperty, EnumProperty

from .background import end_job, run_in_background, running_job, say
from .baking import bake_to_caches, bake_to_keys
from .parts import root_of
from .playing import start_playing
from .refused import Refused
from .settings import is_plain_mesh
from .trying_on import start_try_on


class HEMLINE_OT_add(bpy.types.Operator):
    """Add an object that plays a garment"""

    bl_idname, bl_label, bl_options = "hemline.add", "hemline garment", {"REGISTER", "UNDO"}
    of_mesh: BoolProperty(name="Of the Mesh", description="The active mesh is the garment, on the body of its settings")

    def execute(self, context):
        mesh = context.object
        if self.of_mesh and not is_plain_mesh(mesh):
            self.report({"ERROR"}, "a garment is a mesh; got none that is active; select one")
            return {"CANCELLED"}
        root = bpy.data.objects.new("hemline", None)
        root.empty_display_size, root.hemline.is_root = 0.3, True
        root.scale = [1 / context.scene.unit_settings.scale_length] * 3
        root.location, root.hemline.first_frame = context.scene.cursor.location, context.scene.frame_start
        if self.of_mesh:
            root.hemline.model, root.hemline.mesh = "live", mesh
            root.hemline.body, root.hemline.betas = mesh.hemline.body, mesh.hemline.betas
        context.collection.objects.link(root)
        for each in context.view_layer.objects:
            each.select_set(each == root)
        context.view_layer.objects.active = root
        return {"FINISHED"}


class OnAnObject:
    """An operator on the active object, whose words the panel shows."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012, as Blender does

    def owner(self, context):
        return root_of(context.object)

    def execute(self, context):
        return self.tell(context, lambda owner: self.run_on(context, owner))

    def tell(self, context, act):
        """Runs a function of the object, and shows the words that it returns or raises."""
        owner = self.owner(context)
        try:
            text, failed = act(owner), False
        except Refused as refused:
            text, failed = str(refused), True
        if text is not None:
            say(owner, text, failed=failed)
        if text:
            self.report({"ERROR" if failed else "INFO"}, text)
        return {"CANCELLED" if failed else "FINISHED"}


class OfAJob(OnAnObject):
    """An operator that runs hemline."""

    def run_on(self, context, owner):
        return end_job(self.start(context, owner))

    def invoke(self, context, event):
        return self.tell(context, lambda owner: run_in_background(self.start, context, owner))


class HEMLINE_OT_play(OfAJob, bpy.types.Operator):
    """Play the model on the motion, and show it"""

    bl_idname, bl_label = "hemline.play", "Play"
    start = staticmethod(start_playing)

    @classmethod
    def poll(cls, context):
        return root_of(context.object) is not None


class HEMLINE_OT_try_on(OfAJob, bpy.types.Operator):
    """Put the active mesh on the body, and add the garment as it is worn"""

    bl_idname, bl_label = "hemline.try_on", "Try On"
    start = staticmethod(start_try_on)

    @classmethod
    def poll(cls, context):
        return is_plain_mesh(context.object)

    def owner(self, context):
        return context.object


class HEMLINE_OT_stop(bpy.types.Operator):
    """Stop hemline and change nothing"""

    bl_idname, bl_label = "hemline.stop", "Stop"

    @classmethod
    def poll(cls, context):
        return running_job() is not None

    def execute(self, context):
        running_job().stop()
        return {"FINISHED"}


class HEMLINE_OT_bake(OnAnObject, bpy.types.Operator):
    """Store the result in this file, so that hemline is not needed any more"""

    bl_idname, bl_label = "hemline.bake", "Bake"
    into: EnumProperty(
        name="Into",
        items=[
            ("CACHE", "Point Cache", "PC2 files in the folder 'hemline' beside the .blend"),
            ("KEYS", "Shape Keys", "A shape key per frame, inside the .blend"),
        ],
    )

    @classmethod
    def poll(cls, context):
        return root_of(context.object) is not None

    def run_on(self, context, root):
        return {"CACHE": bake_to_caches, "KEYS": bake_to_keys}[self.into](root, context.scene)
