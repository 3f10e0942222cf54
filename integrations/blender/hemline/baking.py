"""Stores what was played: point caches beside the .blend, or shape keys inside it."""

from pathlib import Path

import bpy

from .copying import copy_files
from .mesh_files import read_frames
from .parts import MODIFIER, PARTS, cache_of, cache_timing, part_of
from .playing import is_outdated
from .refused import Refused


def parts_to_bake(root, scene) -> list:
    """Returns the parts that can be baked.

    Raises:
        Refused: Nothing was played, its caches are gone, or settings have changed since.
    """
    if not cache_of(root):
        raise Refused("nothing to bake; got no point cache; press Play first")
    if is_outdated(root, scene):
        raise Refused("the settings are others than those that were played; press Play first")
    return [part for part in (part_of(root, each) for each in PARTS) if part is not None]


def bake_to_caches(root, scene) -> str:
    """Copies the caches to a folder beside the .blend, all or none."""
    if not bpy.data.is_saved:
        raise Refused("point caches lie beside the .blend; got one that was never saved; save it first, or bake keys")
    parts, folder = parts_to_bake(root, scene), Path(bpy.path.abspath("//hemline"))
    stem = bpy.path.clean_name(root.name)
    targets = [folder / f"{stem}{suffix}.pc2" for suffix in ("", "_body")[: len(parts)]]
    try:
        folder.mkdir(exist_ok=True)
        copy_files([bpy.path.abspath(part.modifiers[MODIFIER].filepath) for part in parts], targets)
    except OSError as error:
        got = f"{Path(error.filename2 or error.filename or folder).name}: {error.strerror or error}"
        raise Refused(f"cannot write into {folder}; got {got}; make room there, or bake keys") from error
    for part, target in zip(parts, targets, strict=True):
        part.modifiers[MODIFIER].filepath = bpy.path.relpath(str(target))
    return f"{root.hemline.frames} frames in {folder}"


def bake_to_keys(root, scene) -> str:
    """Makes a shape key of every sample, whose value goes linearly from 0 to 1 and back."""
    parts = parts_to_bake(root, scene)
    scale, first = cache_timing(root, scene)["scale"], root.hemline.first_frame
    for part in parts:
        samples = read_frames(bpy.path.abspath(part.modifiers[MODIFIER].filepath))
        part.modifiers.remove(part.modifiers[MODIFIER])
        part.data.vertices.foreach_set("co", samples[0].ravel())
        part.shape_key_add(name="Basis", from_mix=False)
        for number, vertices in enumerate(samples[1:], start=1):
            key = part.shape_key_add(name=f"frame {number}", from_mix=False)
            key.data.foreach_set("co", vertices.ravel())
            for other in (-1, 0, 1):
                key.value = float(other == 0)
                key.keyframe_insert("value", frame=first + (number + other) / scale)
        keys = part.data.shape_keys
        keys.name = part.name
        for curve in curves(keys.animation_data) if keys.animation_data else ():
            for point in curve.keyframe_points:
                point.interpolation = "LINEAR"
    return f"{root.hemline.frames} frames in shape keys; Play again turns them back into a point cache"


def curves(animation):
    """Returns the curves of an action, in Blender 4 and in later versions with layers."""
    action = animation.action
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    bags = (strip.channelbag(animation.action_slot) for layer in action.layers for strip in layer.strips)
    return [curve for bag in bags for curve in bag.fcurves]
