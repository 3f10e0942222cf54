"""Garments of hemline in Blender: a model on a motion, as an object that can be played again at any time.

Blender's Python lacks the dependencies of hemline, so the add-on runs the program `hemline` and reads the point caches
(PC2) that it writes. An object, made by *Add > Mesh > hemline garment*, stores the settings. *Play* moves garment and
body below it with Mesh Cache modifiers; other changes of these objects (materials, modifiers) are kept. *Bake* writes
the caches beside the .blend, or the frames to shape keys. See `integrations/blender/README.md`.
"""

# Blender declares properties by annotations that are calls, and `bpy` exists only in Blender.
# pyright: reportMissingImports=false, reportInvalidTypeForm=false, reportAttributeAccessIssue=false

import json
import os
import shutil
import subprocess
import tempfile
import textwrap
import threading
from pathlib import Path
from typing import ClassVar

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

bl_info = {
    "name": "hemline garments",
    "author": "the hemline authors",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "3D View > Sidebar > hemline; Add > Mesh > hemline garment",
    "description": "Plays a garment model of hemline on a motion",
    "category": "Animation",
}

PARTS = {"garment": (0.72, 0.23, 0.17), "body": (0.70, 0.68, 0.66)}
"""Names of the parts, and the colours of their first material (sRGB)."""
MODIFIER = "hemline"
CHECK_S, REST_S = 0.1, 0.6
"""Interval at which a running program is checked, and time after the last change before a live object plays [s]."""


class Refused(Exception):
    """An error, in words for the user."""


# ---------------------------------------------------------------------------------------------- calling hemline


def executable(context) -> str:
    """Returns the path of the program: that of the preferences, otherwise the first one on the PATH."""
    addon = context.preferences.addons.get(__name__)
    named = addon.preferences.executable if addon else ""
    found = shutil.which(bpy.path.abspath(named) if named else "hemline")
    if found is None:
        got = f"'{named}' is no program" if named else "none on the PATH"
        raise Refused(f"hemline was not found; got {got}; name it in Preferences > Add-ons > hemline garments")
    return found


def absolute_name(text: str) -> str:
    """Returns a shipped name unchanged, and a file with its absolute path."""
    return os.path.abspath(bpy.path.abspath(text)) if text.startswith("//") or Path(text).suffix else text


def rate(scene) -> float:
    """Returns the frames per second of a scene."""
    return scene.render.fps / scene.render.fps_base


def arguments(root, scene) -> list[str]:
    """Returns the arguments of hemline, which depend on everything that changes the caches."""
    settings = root.hemline
    words = ["animate", absolute_name(settings.model), "--motion", absolute_name(settings.motion)]
    words += ["--fps", repr(settings.fps or rate(scene)), "--detail", f"{settings.detail:.6g}"]
    betas = np.trim_zeros(np.array(settings.betas), "b")
    words += ["--betas", *(f"{beta:.6g}" for beta in betas)] if len(betas) else []
    for flag, value in (("--garment", settings.garment), ("--body", settings.body), ("--shapes", settings.shapes)):
        words += [flag, absolute_name(value)] if value else []
    words += ["--start", f"{settings.start:.6g}"] if settings.start else []
    words += ["--seconds", f"{settings.seconds:.6g}"] if settings.seconds else []
    return words + (["--untangle"] if settings.untangle else [])


def settings_key(root, scene) -> str:
    """Returns a text of all settings that change the result, to detect changes."""
    settings = root.hemline
    mesh = settings.mesh.name if settings.mesh else ""
    return json.dumps([arguments(root, scene), mesh, repr(rate(scene)), settings.with_body])


class Job:
    """One run of hemline, whose output a thread reads while Blender continues."""

    running: "Job | None" = None
    """The run that the panel shows; there is one at a time."""
    folders: ClassVar[set[Path]] = set()
    """Folders that were made since Blender was started; only these are ever removed, whatever a .blend refers to."""

    def __init__(self, context, root):
        self.owner, self.scene = root.session_uid, context.scene.name
        self.settings_key = settings_key(root, context.scene)
        words, program = arguments(root, context.scene), executable(context)
        self.folder = Path(tempfile.mkdtemp(prefix="hemline-", dir=bpy.app.tempdir or None)).resolve()
        self.folders.add(self.folder)
        if root.hemline.mesh is not None:
            words += ["--garment", str(write_mesh(root.hemline.mesh, self.folder / "own.obj", context))]
        self.said, self.stage, self.share, self.stopped = [], "starting (compiles at the first run)", 0.0, False
        command = [program, *words, "--output", str(self.folder / "garment.pc2"), "--json"]
        pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        told = os.environ | {"HEMLINE_PROGRESS": "lines", "PYTHONUTF8": "1", "NO_COLOR": "1"}
        hidden = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        try:
            self.process = subprocess.Popen(
                command, **pipes, env=told, creationflags=hidden, encoding="utf-8", errors="replace"
            )
        except OSError as error:
            self.clear()
            raise Refused(f"{program} cannot be run; got {error.strerror or error}; name another one") from error
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        for line in self.process.stderr:
            head, _, rest = line.rstrip().partition(": ")
            stage, _, count = rest.rpartition(" ")
            if head == "progress" and "/" in count:
                done, total = (int(each) for each in count.split("/"))
                self.stage, self.share = stage, done / total if total else 0.0
            elif line.strip():
                self.said.append(line.rstrip())

    def stop(self) -> None:
        """Ends the program; the previous result is kept."""
        self.stopped = True
        self.process.terminate()

    def result(self) -> list[Path]:
        """Waits for the end; returns the caches and meshes that were written."""
        told = self.process.stdout.read()
        status = self.process.wait()
        self.reader.join()
        if self.stopped:
            raise Refused("stopped; what was played before is kept")
        if status:
            raise Refused("\n".join(self.said[-20:]) or f"{self.process.args[0]} ended with status {status}")
        try:
            return [Path(name) for name in json.loads(told)["files"]]
        except (ValueError, KeyError, TypeError):
            got = f"{self.process.args[0]}, which said '{told.strip()[:80]}'"
            raise Refused(f"the program is not hemline; got {got}; name another one in the preferences") from None

    def clear(self) -> None:
        """Removes the files of the program."""
        shutil.rmtree(self.folder, ignore_errors=True)


def write_mesh(mesh_object, path: Path, context) -> Path:
    """Writes a mesh of the scene as OBJ for hemline, in metres of the world, y up."""
    if mesh_object.type != "MESH":
        raise Refused(f"the garment must be a mesh; got '{mesh_object.name}', a {mesh_object.type.lower()}; choose one")
    evaluated = mesh_object.evaluated_get(context.evaluated_depsgraph_get())
    mesh, matrix = evaluated.to_mesh(), np.array(evaluated.matrix_world)
    places = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", places)
    x, y, z = (places.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]).T * context.scene.unit_settings.scale_length
    lines = [f"v {a:.6f} {b:.6f} {c:.6f}\n" for a, b, c in zip(x, z, -y, strict=True)]
    for face in mesh.polygons:
        lines.append("f " + " ".join(str(vertex + 1) for vertex in face.vertices) + "\n")
    evaluated.to_mesh_clear()
    path.write_text("".join(lines))
    return path


# ---------------------------------------------------------------------------------------------- reading what it wrote


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray, str]:
    """Reads vertices (verts, 3) [m], y up, triangles (faces, 3), and notices of an OBJ that hemline wrote."""
    lines = path.read_text(encoding="utf-8").splitlines()
    vertices = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float32)
    faces = np.array([line.split()[1:4] for line in lines if line.startswith("f ")], np.int32) - 1
    return vertices, faces, "\n".join(line[2:] for line in lines if line.startswith("# "))


def z_up(vertices: np.ndarray) -> np.ndarray:
    """Converts vertices from y up to Blender's axes."""
    return np.stack([vertices[..., 0], -vertices[..., 2], vertices[..., 1]], axis=-1)


def read_frames(path: str) -> np.ndarray:
    """Reads vertices (frames, verts, 3) of a PC2 file, in Blender's axes [m]."""
    header = np.fromfile(path, np.dtype("<i4"), 8)
    points, frames = int(header[4]), int(header[7])
    return z_up(np.memmap(path, np.dtype("<f4"), "r", 32, (frames, points, 3)))


def part_of(root, part: str):
    """Returns the garment or the body of an object, or None."""
    return next((child for child in root.children if child.hemline.part == part), None)


def root_of(chosen):
    """Returns the object with the settings for itself or one of its parts; None for other objects."""
    while chosen is not None and not chosen.hemline.is_root:
        chosen = chosen.parent
    return chosen


def show_part(root, part: str, path: Path, cache: Path, timing: dict) -> None:
    """Gives a part its mesh and its cache; an existing object keeps all other changes."""
    vertices, faces, notices = read_obj(path)
    found = part_of(root, part) or add_part(root, part)
    if found.data.shape_keys:
        found.shape_key_clear()
    mesh = found.data
    old = np.empty(3 * len(mesh.polygons), np.int32)
    if len(mesh.loops) == old.size:
        mesh.polygons.foreach_get("vertices", old)
    if len(mesh.vertices) != len(vertices) or not np.array_equal(old.reshape(-1, 3), faces):
        mesh.clear_geometry()
        mesh.from_pydata(vertices.tolist(), [], faces.tolist())
        mesh.shade_smooth()
    mesh.vertices.foreach_set("co", z_up(vertices).ravel())
    mesh.update()
    found["notices"] = notices
    set_cache(found, str(cache), timing)


def add_part(root, part: str):
    """Adds a part of an object, with a plain material."""
    mesh = bpy.data.meshes.new(f"{root.name} {part}")
    found = bpy.data.objects.new(mesh.name, mesh)
    for collection in root.users_collection:
        collection.objects.link(found)
    found.parent, found.hemline.part = root, part
    material = bpy.data.materials.get(f"hemline {part}") or bpy.data.materials.new(f"hemline {part}")
    linear = [((each + 0.055) / 1.055) ** 2.4 for each in PARTS[part]]
    material.diffuse_color = [*linear, 1.0]
    material.use_nodes = True
    for node in material.node_tree.nodes:
        if node.type == "BSDF_PRINCIPLED":
            node.inputs["Base Color"].default_value, node.inputs["Roughness"].default_value = [*linear, 1.0], 0.8
    mesh.materials.append(material)
    return found


def set_cache(part, path: str, timing: dict) -> None:
    """Makes a part read a y-up cache, with its first modifier."""
    modifier = part.modifiers.get(MODIFIER) or part.modifiers.new(MODIFIER, "MESH_CACHE")
    part.modifiers.move(part.modifiers.find(MODIFIER), 0)
    modifier.cache_format, modifier.filepath = "PC2", path
    modifier.forward_axis, modifier.up_axis, modifier.interpolation = "POS_Z", "NEG_Y", "LINEAR"
    modifier.frame_scale, modifier.frame_start = timing["scale"], timing["start"]


def cache_timing(root, scene) -> dict:
    """Returns scale and start of the modifier: sample = `scale` x frame - `start`."""
    scale = (root.hemline.fps or rate(scene)) / rate(scene)
    return {"scale": scale, "start": scale * root.hemline.first_frame}


def move_start(settings, context) -> None:
    """Applies a change of the first frame, which does not require playing again."""
    root = settings.id_data
    for part in root.children:
        modifier = part.modifiers.get(MODIFIER)
        if modifier is not None:
            modifier.frame_start = cache_timing(root, context.scene)["start"]


def cache_of(root) -> str:
    """Returns the path of the garment's cache, or "" if it does not exist."""
    garment = part_of(root, "garment")
    modifier = garment.modifiers.get(MODIFIER) if garment else None
    path = bpy.path.abspath(modifier.filepath) if modifier else ""
    return path if os.path.isfile(path) else ""


def show_result(job: Job) -> str:
    """Shows the result of a run on its object; returns the messages of hemline.

    Raises:
        Refused: The run failed, or the object is gone; the previous result is kept.
    """
    try:
        files = job.result()
        root = next((each for each in bpy.data.objects if each.session_uid == job.owner), None)
        scene = bpy.data.scenes.get(job.scene)
        if root is None or scene is None:
            raise Refused("the object was removed while it was played")
        before = Path(cache_of(root)).resolve().parent
        wanted = ["garment", "body"] if root.hemline.with_body else ["garment"]
        for part, cache, mesh in zip(PARTS, files[::2], files[1::2], strict=False):
            if part in wanted:
                show_part(root, part, mesh, cache, cache_timing(root, scene))
        if "body" not in wanted and part_of(root, "body"):
            bpy.data.objects.remove(part_of(root, "body"))
        root.hemline.played = job.settings_key
        root.hemline.frames = len(read_frames(str(files[0])))
        if root.hemline.fit_range:
            last = (root.hemline.frames - 1) / cache_timing(root, scene)["scale"]
            scene.frame_start, scene.frame_end = root.hemline.first_frame, root.hemline.first_frame + round(last)
    except Refused:
        job.clear()
        raise
    if before in Job.folders and not in_use(before):
        shutil.rmtree(before, ignore_errors=True)
    return "\n".join(job.said)


def in_use(folder: Path) -> bool:
    """Whether some object, such as a copy of ours, reads a cache of a folder."""
    modifiers = (modifier for each in bpy.data.objects for modifier in each.modifiers if modifier.type == "MESH_CACHE")
    return any(Path(bpy.path.abspath(modifier.filepath)).resolve().parent == folder for modifier in modifiers)


# ---------------------------------------------------------------------------------------------- timers


def watch_job() -> float | None:
    """Timer: draws the progress of the program, and shows its result when it ends."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
    job = Job.running
    if job is None:
        return None
    if job.process.poll() is None:
        return CHECK_S
    Job.running = None
    root = next((each for each in bpy.data.objects if each.session_uid == job.owner), None)
    try:
        said, failed = show_result(job), False
    except Refused as refused:
        said, failed = str(refused), True
    if root is not None:
        root.hemline.said, root.hemline.failed = said, failed
    return CHECK_S  # once more, so that the end is drawn


def start_job(context, root) -> None:
    """Starts a run and its timer."""
    if Job.running is not None:
        raise Refused("hemline is at work on another object; wait for it, or stop it")
    Job.running = Job(context, root)
    if not bpy.app.timers.is_registered(watch_job):
        bpy.app.timers.register(watch_job, first_interval=CHECK_S, persistent=True)


def play_changed() -> float | None:
    """Timer: plays live objects whose settings have changed."""
    if Job.running is not None:
        return REST_S
    for root in bpy.context.scene.objects:
        if root.hemline.is_root and root.hemline.live and is_outdated(root, bpy.context.scene):
            try:
                start_job(bpy.context, root)
            except Refused as refused:
                root.hemline.said, root.hemline.failed = str(refused), True
                continue
            return REST_S
    return None


def on_change(settings, context) -> None:
    """Starts the timer of live objects after a change of a setting."""
    if settings.live:
        if bpy.app.timers.is_registered(play_changed):
            bpy.app.timers.unregister(play_changed)
        bpy.app.timers.register(play_changed, first_interval=REST_S)


def is_outdated(root, scene) -> bool:
    """Whether settings have changed since they were played."""
    return root.hemline.played != settings_key(root, scene)


# ---------------------------------------------------------------------------------------------- baking


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


def copy_files(sources: list[str], targets: list[Path]) -> None:
    """Copies files, all or none; each target is complete at every moment, either old or new."""
    with tempfile.TemporaryDirectory(dir=targets[0].parent) as waiting:
        copies = [
            shutil.copyfile(source, Path(waiting) / target.name)
            for source, target in zip(sources, targets, strict=True)
        ]
        before = [link_or_copy(target, Path(waiting) / f"{target.name}.before") for target in targets]
        try:
            for copy, target in zip(copies, targets, strict=True):
                os.replace(copy, target)
        except OSError:
            for copy, target, old in zip(copies, targets, before, strict=True):
                if not copy.exists() and old is None:
                    os.unlink(target)
                elif not copy.exists():
                    os.replace(old, target)
            raise


def link_or_copy(path: Path, name: Path) -> "Path | None":
    """Links a file to a second name, or copies it where the disk has no links; returns None without a file."""
    if not path.is_file():
        return None
    try:
        os.link(path, name)
    except OSError:
        shutil.copyfile(path, name)
    return name


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


# ---------------------------------------------------------------------------------------------- user interface


class HemlinePreferences(bpy.types.AddonPreferences):
    """Preferences of the add-on: the path of hemline."""

    bl_idname = __name__
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


class HemlineSettings(bpy.types.PropertyGroup):
    """Settings of an object, and the result of its last run."""

    is_root: BoolProperty()
    part: StringProperty()
    model: StringProperty(
        name="Model",
        default="cape",
        update=on_change,
        subtype="FILE_PATH",
        description="A model file, or the name of a shipped one: cape, skirt, tshirt-light, longsleeve-light, "
        "trousers-light; lag, live and swingar play any garment",
    )
    motion: StringProperty(
        name="Motion",
        default="run",
        update=on_change,
        subtype="FILE_PATH",
        description="A clip (BVH, AMASS npz), or the name of a shipped one: walk, run, turn, jump, kick, dance",
    )
    garment: StringProperty(
        name="Garment",
        update=on_change,
        subtype="FILE_PATH",
        description="For the models lag, live and swingar: a mesh, the name of a garment, or a generated one, "
        "such as dress:7",
    )
    mesh: PointerProperty(
        name="or Mesh",
        type=bpy.types.Object,
        update=on_change,
        poll=lambda self, each: each.type == "MESH" and not each.hemline.part,
        description="For the models lag, live and swingar: a mesh of this scene",
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
    untangle: BoolProperty(name="Untangle", update=on_change, description="Lift limbs out of each other first")
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
    show_result: StringProperty()
    frames: IntProperty()
    said: StringProperty()
    failed: BoolProperty()


class HEMLINE_OT_add(bpy.types.Operator):
    """Add an object that plays a garment"""

    bl_idname, bl_label, bl_options = "hemline.add", "hemline garment", {"REGISTER", "UNDO"}

    def execute(self, context):
        root = bpy.data.objects.new("hemline", None)
        root.empty_display_size, root.hemline.is_root = 0.3, True
        root.scale = [1 / context.scene.unit_settings.scale_length] * 3
        root.location, root.hemline.first_frame = context.scene.cursor.location, context.scene.frame_start
        context.collection.objects.link(root)
        for each in context.view_layer.objects:
            each.select_set(each == root)
        context.view_layer.objects.active = root
        return {"FINISHED"}


class OnAnObject:
    """An operator on the active object, or on the object of which it is a part."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012, as Blender does

    @classmethod
    def poll(cls, context):
        return root_of(context.object) is not None

    def execute(self, context):
        root = root_of(context.object)
        try:
            said, failed = self.run_on(context, root), False
        except Refused as refused:
            said, failed = str(refused), True
        root.hemline.said, root.hemline.failed = said, failed
        if said:
            self.report({"ERROR" if failed else "INFO"}, said)
        return {"CANCELLED" if failed else "FINISHED"}


class HEMLINE_OT_play(OnAnObject, bpy.types.Operator):
    """Play the model on the motion, and show it"""

    bl_idname, bl_label = "hemline.play", "Play"

    def run_on(self, context, root):
        return show_result(Job(context, root))

    def invoke(self, context, event):
        root = root_of(context.object)
        try:
            start_job(context, root)
        except Refused as refused:
            root.hemline.said, root.hemline.failed = str(refused), True
            self.report({"ERROR"}, str(refused))
            return {"CANCELLED"}
        root.hemline.said, root.hemline.failed = "", False
        return {"FINISHED"}


class HEMLINE_OT_stop(bpy.types.Operator):
    """Stop hemline and keep the previous result"""

    bl_idname, bl_label = "hemline.stop", "Stop"

    @classmethod
    def poll(cls, context):
        return Job.running is not None

    def execute(self, context):
        Job.running.stop()
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

    def run_on(self, context, root):
        return {"CACHE": bake_to_caches, "KEYS": bake_to_keys}[self.into](root, context.scene)


class HEMLINE_PT_panel(bpy.types.Panel):
    """Settings of the active object, in the sidebar of the 3D view."""

    bl_label, bl_category, bl_space_type, bl_region_type = "hemline", "hemline", "VIEW_3D", "UI"

    def draw(self, context):
        layout, root = self.layout, root_of(context.object)
        layout.use_property_split = True
        if root is None:
            layout.operator("hemline.add", icon="ADD")
            return
        settings = root.hemline
        for names in (
            ("model", "motion"),
            ("garment", "mesh") if settings.model in ("lag", "live", "swingar") else (),
            ("start", "seconds", "untangle"),
            ("body", "shapes"),
            ("fps", "detail", "first_frame"),
            ("with_body", "fit_range", "live"),
        ):
            column = layout.column(align=True)
            for name in names:
                column.prop(settings, name)
        layout.column(align=True).prop(settings, "betas")
        self.draw_doing(context, root)

    def draw_doing(self, context, root):
        layout, job = self.layout, Job.running
        if job is None:
            layout.operator("hemline.play", icon="PLAY")
        else:
            row = layout.row(align=True)
            row.progress(factor=job.share, text=f"{job.stage} {100 * job.share:.0f} %")
            row.operator("hemline.stop", text="", icon="CANCEL")
        if root.hemline.played and not cache_of(root) and not part_of(root, "garment").data.shape_keys:
            layout.label(text="The point cache is gone: press Play", icon="ERROR")
        elif root.hemline.played and is_outdated(root, context.scene):
            layout.label(text="Settings were changed: press Play", icon="INFO")
        row = layout.row(align=True)
        row.operator("hemline.bake", text="Bake Cache").into = "CACHE"
        row.operator("hemline.bake", text="Bake Keys").into = "KEYS"
        column = layout.column(align=True)
        column.alert = root.hemline.failed
        for line in root.hemline.said.splitlines():
            for piece in textwrap.wrap(line, max(20, context.region.width // 8)):
                column.label(text=piece)


CLASSES = (
    HemlinePreferences,
    HemlineSettings,
    HEMLINE_OT_add,
    HEMLINE_OT_play,
    HEMLINE_OT_stop,
    HEMLINE_OT_bake,
    HEMLINE_PT_panel,
)


def menu(self, context) -> None:
    """Adds the entry to the menu Add > Mesh."""
    self.layout.operator("hemline.add", icon="MOD_CLOTH")


def register() -> None:
    """Registers the add-on; Blender calls it when it is enabled."""
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Object.hemline = PointerProperty(type=HemlineSettings)
    bpy.types.VIEW3D_MT_mesh_add.append(menu)


def unregister() -> None:
    """Unregisters the add-on; objects keep their settings."""
    for timer in (watch_job, play_changed):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    if Job.running is not None:
        Job.running.stop()
        Job.running = None
    bpy.types.VIEW3D_MT_mesh_add.remove(menu)
    del bpy.types.Object.hemline
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
