"""Preferences of the extension."""

import bpy
from bpy.props import StringProperty

from .program import executable
from .refused import Refused


class HemlinePreferences(bpy.types.AddonPreferences):
    """Path of hemline."""

    bl_idname = __package__
    executable: StringProperty(
        name="hemline",
        subtype="FILE_PATH",
        description="Path of the program, such as .venv/bin/hemline. If empty, it is searched on the PATH",
    )

    def draw(self, context):
        self.layout.prop(self, "executable")
        try:
            self.layout.label(text=f"uses {executable(context)}", icon="CHECKMARK")
        except Refused as refused:
            self.layout.label(text=str(refused), icon="ERROR")
