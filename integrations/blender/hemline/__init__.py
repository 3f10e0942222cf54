"""Garments of hemline in Blender: a model on a motion, as an object that can be played again at any time.

Blender's Python lacks the dependencies of hemline, so the extension runs the program `hemline` and reads the files
that it writes. An object, made by *Add > Mesh > hemline garment*, stores the settings. *Play* moves garment and body
below it with Mesh Cache modifiers; other changes of these objects (materials, modifiers) are kept. *Try On* puts a
mesh of the scene on the body. *Bake* writes the caches beside the .blend, or the frames to shape keys.
"""

import bpy
from bpy.props import PointerProperty

from . import operators
from .background import end_all
from .panel import HEMLINE_PT_panel
from .preferences import HemlinePreferences
from .settings import HemlineSettings

CLASSES = (
    HemlinePreferences,
    HemlineSettings,
    operators.HEMLINE_OT_add,
    operators.HEMLINE_OT_play,
    operators.HEMLINE_OT_try_on,
    operators.HEMLINE_OT_stop,
    operators.HEMLINE_OT_bake,
    HEMLINE_PT_panel,
)


def draw_menu(self, context) -> None:
    """Draws the entry of the menu Add > Mesh."""
    self.layout.operator("hemline.add", icon="MOD_CLOTH")


def register() -> None:
    """Registers the extension; Blender calls it when it is enabled."""
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Object.hemline = PointerProperty(type=HemlineSettings)
    bpy.types.VIEW3D_MT_mesh_add.append(draw_menu)


def unregister() -> None:
    """Unregisters the extension; objects keep their settings."""
    end_all()
    bpy.types.VIEW3D_MT_mesh_add.remove(draw_menu)
    del bpy.types.Object.hemline
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
