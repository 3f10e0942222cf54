"""The tab *hemline* in the sidebar of the 3D view."""

import textwrap

import bpy

from .background import owner_of, running_job
from .parts import cache_of, part_of, root_of
from .playing import is_outdated
from .program import takes_garment, takes_wind
from .settings import is_plain_mesh


class HEMLINE_PT_panel(bpy.types.Panel):
    """Settings of the active object: one that plays, or a mesh that is a garment."""

    bl_label, bl_category, bl_space_type, bl_region_type = "hemline", "hemline", "VIEW_3D", "UI"

    def draw(self, context):
        layout, root = self.layout, root_of(context.object)
        layout.use_property_split = True
        if root is not None:
            draw_root(layout, context, root)
        elif is_plain_mesh(context.object):
            draw_mesh(layout, context, context.object)
        else:
            layout.operator("hemline.add", icon="ADD")
            draw_job(layout)


def draw_root(layout, context, root) -> None:
    """Draws the settings of an object that plays."""
    settings = root.hemline
    draw_settings(layout, settings, "model", "motion")
    if takes_garment(settings):
        column = draw_settings(layout, settings, "garment", "mesh")
        if settings.mesh is not None:
            draw_pins(column, settings.mesh)
    draw_settings(layout, settings, "material", *(["wind"] if takes_wind(settings) else []))
    draw_settings(layout, settings, "start", "seconds", "untangle")
    draw_settings(layout, settings, "body", "shapes")
    draw_settings(layout, settings, "fps", "detail", "first_frame")
    draw_settings(layout, settings, "with_body", "fit_range", "live")
    draw_settings(layout, settings, "betas")
    if not draw_job(layout):
        layout.operator("hemline.play", icon="PLAY")
    garment = part_of(root, "garment")
    if settings.played and not cache_of(root) and not (garment and garment.data.shape_keys):
        layout.label(text="The point cache is gone: press Play", icon="ERROR")
    elif settings.played and is_outdated(root, context.scene):
        layout.label(text="Settings were changed: press Play", icon="INFO")
    row = layout.row(align=True)
    row.operator("hemline.bake", text="Bake Cache").into = "CACHE"
    row.operator("hemline.bake", text="Bake Keys").into = "KEYS"
    draw_message(layout, context, settings)


def draw_mesh(layout, context, mesh) -> None:
    """Draws the settings of a mesh that is a garment."""
    draw_pins(layout.column(align=True), mesh)
    draw_settings(layout, mesh.hemline, "body")
    draw_settings(layout, mesh.hemline, "betas")
    if not draw_job(layout):
        layout.operator("hemline.try_on", icon="MOD_CLOTH")
        layout.operator("hemline.add", text="Add to Play It", icon="ADD").of_mesh = True
    draw_message(layout, context, mesh.hemline)


def draw_settings(layout, settings, *names: str):
    """Draws settings below each other in a column, and returns the column."""
    column = layout.column(align=True)
    for name in names:
        column.prop(settings, name)
    return column


def draw_pins(column, mesh) -> None:
    """Draws the choice of a vertex group of a mesh."""
    column.prop_search(mesh.hemline, "pins", mesh, "vertex_groups")


def draw_job(layout) -> bool:
    """Draws progress and *Stop* of the job at work; returns whether there is one."""
    job = running_job()
    if job is None:
        return False
    row = layout.row(align=True)
    row.progress(factor=job.share, text=progress_text(job))
    row.operator("hemline.stop", text="", icon="CANCEL")
    owner = owner_of(job)
    if owner is not None:
        layout.label(text=f"for '{owner.name}'")
    return True


def progress_text(job) -> str:
    """Returns the stage of a job, its share, and the time left if it is known."""
    text = f"{job.stage} {100 * job.share:.0f} %"
    return text if job.seconds_left is None else f"{text}, {job.seconds_left:.0f} s left"


def draw_message(layout, context, settings) -> None:
    """Draws what hemline said, in lines as wide as the panel."""
    column = layout.column(align=True)
    column.alert = settings.failed
    for line in settings.message.splitlines():
        for piece in textwrap.wrap(line, max(20, context.region.width // 8)):
            column.label(text=piece)
