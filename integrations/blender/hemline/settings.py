"""Settings of an object, and the result of its last run."""

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .background import on_change
from .parts import move_start

MATERIALS = ("cotton", "silk", "denim", "wool", "jersey", "paper")


def is_plain_mesh(chosen) -> bool:
    """Whether an object is a mesh that may be a garment, and no part of ours."""
    return chosen is not None and chosen.type == "MESH" and not chosen.hemline.part


class HemlineSettings(bpy.types.PropertyGroup):
    """Settings of an object that plays, or of a mesh that is a garment, and what hemline said of it."""

    is_root: BoolProperty()
    part: StringProperty()
    model: StringProperty(
        name="Model",
        default="cape",
        update=on_change,
        subtype="FILE_PATH",
        description="A model file, or the name of a shipped one: cape, skirt, knee-dress, robe, tshirt-light, "
        "longsleeve-light, trousers-light; lag, live, skinned and swingar play any garment",
    )
    motion: StringProperty(
        name="Motion",
        default="run",
        update=on_change,
        subtype="FILE_PATH",
        description="A clip (BVH, FBX, GLB, AMASS npz), or the name of a shipped one: walk, run, turn, jump, kick, "
        "dance",
    )
    garment: StringProperty(
        name="Garment",
        update=on_change,
        subtype="FILE_PATH",
        description="For the models lag, live, skinned and swingar: a mesh, the name of a garment, or a generated one, "
        "such as dress:7",
    )
    mesh: PointerProperty(
        name="or Mesh",
        type=bpy.types.Object,
        update=on_change,
        poll=lambda self, each: is_plain_mesh(each),
        description="For the models lag, live, skinned and swingar: a mesh of this scene",
    )
    pins: StringProperty(
        name="Pins",
        update=on_change,
        description="Vertex group whose vertices with a weight above 0.5 stay on the body. If empty, hemline finds "
        "what holds the garment",
    )
    material: EnumProperty(
        name="Material",
        update=on_change,
        items=[
            ("OWN", "Its Own", "The material of the model or of the garment"),
            *((name, name.capitalize(), f"{name.capitalize()}, if the model knows it") for name in MATERIALS),
        ],
        description="Material of the cloth, for live and for models that were fitted to several",
    )
    wind: FloatVectorProperty(
        name="Wind",
        size=3,
        update=on_change,
        soft_min=-10,
        soft_max=10,
        subtype="XYZ",
        description="Velocity of the wind along the axes of the object, z up, for ropes and live [m/s]",
    )
    body: StringProperty(
        name="Body", update=on_change, subtype="FILE_PATH", description="Another body. If empty, that of the model"
    )
    shapes: StringProperty(
        name="Shapes",
        update=on_change,
        subtype="FILE_PATH",
        description="A model of the same garment that knows the effect of shapes",
    )
    betas: FloatVectorProperty(
        name="Betas", size=10, update=on_change, soft_min=-2, soft_max=2, description="Shape of the body"
    )
    start: FloatProperty(
        name="From", min=0, unit="TIME_ABSOLUTE", update=on_change, description="Start time within the clip [s]"
    )
    seconds: FloatProperty(
        name="Seconds",
        min=0,
        unit="TIME_ABSOLUTE",
        update=on_change,
        description="Duration of the clip; 0 plays to its end [s]",
    )
    untangle: BoolProperty(
        name="Untangle", default=True, update=on_change, description="Lift limbs out of each other first"
    )
    fps: FloatProperty(
        name="Rate", min=0, update=on_change, description="Samples per second; 0 uses the frame rate of the scene"
    )
    detail: FloatProperty(
        name="Quality", default=1, min=0.02, max=1, update=on_change, description="Fraction of the garment's vertices"
    )
    first_frame: IntProperty(
        name="First Frame", default=1, update=move_start, description="Frame of the scene at which the clip begins"
    )
    with_body: BoolProperty(name="Body Mesh", default=True, update=on_change, description="Show the body")
    fit_range: BoolProperty(name="Fit Range", default=True, description="Set the frame range of the scene to the clip")
    live: BoolProperty(name="Live", update=on_change, description="Play again whenever a setting changes")
    played: StringProperty()
    attempted: StringProperty()
    frames: IntProperty()
    message: StringProperty()
    failed: BoolProperty()
