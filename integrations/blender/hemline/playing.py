"""Plays a model on a motion, and shows garment and body."""

import json
from pathlib import Path

import bpy

from .job import Job, make_folder, remove_folder
from .mesh_files import read_frames, write_garment
from .parts import PARTS, cache_of, cache_timing, is_in_use, part_of, show_part
from .program import animate_words, executable, rate, takes_garment
from .refused import Refused


def settings_key(root, scene) -> str:
    """Returns a text of all settings that change the result, to detect changes."""
    settings = root.hemline
    mesh = garment_mesh(settings)
    garment = [mesh.name, mesh.hemline.pins] if mesh else []
    return json.dumps([animate_words(settings, scene), garment, repr(rate(scene)), settings.with_body])


def garment_mesh(settings):
    """Returns the mesh of the scene that is played, or None."""
    return settings.mesh if takes_garment(settings) else None


def is_outdated(root, scene) -> bool:
    """Whether settings have changed since they were played."""
    return root.hemline.played != settings_key(root, scene)


def is_unattempted(root, scene) -> bool:
    """Whether settings have changed since *Play* last started, however it ended."""
    return is_outdated(root, scene) and root.hemline.attempted != settings_key(root, scene)


def start_playing(context, root) -> Job:
    """Starts `hemline animate` with the settings of an object.

    Raises:
        Refused: There is no program, or the mesh cannot be written.
    """
    program, words = executable(context), animate_words(root.hemline, context.scene)
    key, scene, folder = settings_key(root, context.scene), context.scene.name, make_folder()
    try:
        mesh = garment_mesh(root.hemline)
        words += ["--garment", str(write_garment(mesh, folder, context))] if mesh else []
        words += ["--output", str(folder / "garment.pc2"), "--json"]
        job = Job(program, words, folder, root, lambda job, root: show_clip(job, root, scene, key))
    except Refused:
        remove_folder(folder)
        raise
    finally:
        root.hemline.attempted = key
    return job


def show_clip(job: Job, root, scene_name: str, key: str) -> str:
    """Shows the result of a run on its object; returns the messages of hemline.

    Raises:
        Refused: The scene is gone, or the program wrote no clip.
    """
    files, scene = clip_files(job), bpy.data.scenes.get(scene_name)
    if scene is None:
        raise Refused("the scene was removed while its garment was played; got none of that name; press Play again")
    before = Path(cache_of(root)).resolve().parent
    wanted = ["garment", "body"] if root.hemline.with_body else ["garment"]
    for part, cache, mesh in zip(PARTS, files[::2], files[1::2], strict=False):
        if part in wanted:
            show_part(root, part, mesh, cache, cache_timing(root, scene))
    if "body" not in wanted and part_of(root, "body"):
        bpy.data.objects.remove(part_of(root, "body"))
    root.hemline.played = key
    root.hemline.frames = len(read_frames(str(files[0])))
    if root.hemline.fit_range:
        last = (root.hemline.frames - 1) / cache_timing(root, scene)["scale"]
        scene.frame_start, scene.frame_end = root.hemline.first_frame, root.hemline.first_frame + round(last)
    if not is_in_use(before):
        remove_folder(before)
    return "\n".join(job.messages)


def clip_files(job: Job) -> list[Path]:
    """Returns the caches and meshes that a run wrote.

    Raises:
        Refused: The program wrote something else.
    """
    try:
        return [Path(name) for name in json.loads(job.output)["files"]]
    except (ValueError, KeyError, TypeError):
        raise job.no_result() from None
