"""Garments of hemline in Blender: a model on a motion, as an object that can be played again at any time.

Blender's own Python lacks what hemline needs, so the add-on calls the program `hemline` and reads the point caches
(PC2) that it writes. An object, made by *Add > Mesh > hemline garment*, holds the settings. *Play* moves garment and
body under it by Mesh Cache modifiers; what else was done to these objects (materials, modifiers) stays. *Bake* puts
the caches beside the .blend, or the frames into shape keys. The page `integrations/blender/README.md` tells the rest.
"""

# Blender's classes name their properties by annotations that are calls, and `bpy` is in Blender alone.
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
    "description": "Garments that swing: plays a model of hemline on a motion",
    "category": "Animation",
}

PARTS = {"garment": (0.72, 0.23, 0.17), "body": (0.70, 0.68, 0.66)}
"""Names of the parts, and the colours that they get when they are made (sRGB)."""
MODIFIER = "hemline"
BEATS_S, QUIET_S = 0.1, 0.6
"""How often a running program is looked at; how long settings must rest before they are played by themselves [s]."""


class Refused(Exception):
    """What cannot be done, in words for the user."""


# ---------------------------------------------------------------------------------------------- calling hemline


def executable(context) -> str:
    """The program: the one that the preferences name, else the first on the PATH."""
    addon = context.preferences.addons.get(__name__)
    named = addon.preferences.executable if addon else ""
    found = shutil.which(bpy.path.abspath(named) if named else "hemline")
    if found is None:
        got = f"'{named}' is no program" if named else "none on the PATH"
        raise Refused(f"hemline was not found; got {got}; name it in Preferences > Add-ons > hemline garments")
    return found


def named(text: str) -> str:
    """A name as it is, a file with its whole path."""
    return os.path.abspath(bpy.path.abspath(text)) if text.startswith("//") or Path(text).suffix else text


def rate(scene) -> float:
    """Frames a second of a scene."""
    return scene.render.fps / scene.render.fps_base


def arguments(root, scene) -> list[str]:
    """What hemline is asked for; all that changes the caches is in it."""
    asked = root.hemline
    words = ["animate", named(asked.model), "--motion", named(asked.motion)]
    words += ["--fps", repr(asked.fps or rate(scene)), "--detail", f"{asked.detail:.6g}"]
    betas = np.trim_zeros(np.array(asked.betas), "b")
    words += ["--betas", *(f"{beta:.6g}" for beta in betas)] if len(betas) else []
    for flag, value in (("--garment", asked.garment), ("--body", asked.body), ("--shapes", asked.shapes)):
        words += [flag, named(value)] if value else []
    words += ["--start", f"{asked.start:.6g}"] if asked.start else []
    words += ["--seconds", f"{asked.seconds:.6g}"] if asked.seconds else []
    return words + (["--untangle"] if asked.untangle else [])


def all_asked(root, scene) -> str:
    """All that what is shown depends on, for a look at whether it was changed."""
    asked = root.hemline
    mesh = asked.mesh.name if asked.mesh else ""
    return json.dumps([arguments(root, scene), mesh, repr(rate(scene)), asked.with_body])


class Job:
    """One run of hemline, read by a thread while Blender goes on."""

    running: "Job | None" = None
    """The one that the panel shows; there is one at a time."""
    folders: ClassVar[set[Path]] = set()
    """Folders that were made since Blender was started: none but these are ever removed, whatever a .blend names."""

    def __init__(self, context, root):
        self.owner, self.scene = root.session_uid, context.scene.name
        self.asked = all_asked(root, context.scene)
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
        """End the program; what was played before stays."""
        self.stopped = True
        self.process.terminate()

    def result(self) -> list[Path]:
        """Wait for the end; the caches and meshes that were written."""
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
        """Remove what the program wrote."""
        shutil.rmtree(self.folder, ignore_errors=True)


def write_mesh(mesh_object, path: Path, context) -> Path:
    """A mesh of the scene as OBJ for hemline: the world's metres, y up."""
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
    """Vertices (verts, 3) in metres, y up, triangles (faces, 3), and the notices, of an OBJ that hemline wrote."""
    lines = path.read_text(encoding="utf-8").splitlines()
    vertices = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float32)
    faces = np.array([line.split()[1:4] for line in lines if line.startswith("f ")], np.int32) - 1
    return vertices, faces, "\n".join(line[2:] for line in lines if line.startswith("# "))


def z_up(vertices: np.ndarray) -> np.ndarray:
    """Blender's axes of vertices that are y up."""
    return np.stack([vertices[..., 0], -vertices[..., 2], vertices[..., 1]], axis=-1)


def read_frames(path: str) -> np.ndarray:
    """Vertices (frames, verts, 3) in Blender's axes [m] of a PC2 file."""
    header = np.fromfile(path, np.dtype("<i4"), 8)
    points, frames = int(header[4]), int(header[7])
    return z_up(np.memmap(path, np.dtype("<f4"), "r", 32, (frames, points, 3)))


def part_of(root, part: str):
    """The garment or the body of an object, or None."""
    return next((child for child in root.children if child.hemline.part == part), None)


def root_of(chosen):
    """The object with the settings, of itself or of one of its parts; None of any other."""
    while chosen is not None and not chosen.hemline.is_root:
        chosen = chosen.parent
    return chosen


def shown(root, part: str, path: Path, cache: Path, timing: dict) -> None:
    """Give a part its mesh and its cache; an object that exists is kept, with all that was done to it."""
    vertices, faces, notices = read_obj(path)
    found = part_of(root, part) or made(root, part)
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
    cached(found, str(cache), timing)


def made(root, part: str):
    """A new part of an object, with a plain material."""
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


def cached(part, path: str, timing: dict) -> None:
    """The modifier that moves a part, first of all, reading a cache whose y is up."""
    modifier = part.modifiers.get(MODIFIER) or part.modifiers.new(MODIFIER, "MESH_CACHE")
    part.modifiers.move(part.modifiers.find(MODIFIER), 0)
    modifier.cache_format, modifier.filepath = "PC2", path
    modifier.forward_axis, modifier.up_axis, modifier.interpolation = "POS_Z", "NEG_Y", "LINEAR"
    modifier.frame_scale, modifier.frame_start = timing["scale"], timing["start"]


def timing(root, scene) -> dict:
    """Sample = `scale` x frame - `start`, as the modifier counts."""
    scale = (root.hemline.fps or rate(scene)) / rate(scene)
    return {"scale": scale, "start": scale * root.hemline.first_frame}


def retimed(settings, context) -> None:
    """The first frame acts at once: nothing has to be played again."""
    root = settings.id_data
    for part in root.children:
        modifier = part.modifiers.get(MODIFIER)
        if modifier is not None:
            modifier.frame_start = timing(root, context.scene)["start"]


def cache_of(root) -> str:
    """Path of the garment's cache, or "" where there is none (any more)."""
    garment = part_of(root, "garment")
    modifier = garment.modifiers.get(MODIFIER) if garment else None
    path = bpy.path.abspath(modifier.filepath) if modifier else ""
    return path if os.path.isfile(path) else ""


def played(job: Job) -> str:
    """Show what a run wrote, on the object that asked for it; what hemline said.

    Raises:
        Refused: It failed, or the object is gone; what was shown before stays.
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
                shown(root, part, mesh, cache, timing(root, scene))
        if "body" not in wanted and part_of(root, "body"):
            bpy.data.objects.remove(part_of(root, "body"))
        root.hemline.played = job.asked
        root.hemline.frames = len(read_frames(str(files[0])))
        if root.hemline.fit_range:
            last = (root.hemline.frames - 1) / timing(root, scene)["scale"]
            scene.frame_start, scene.frame_end = root.hemline.first_frame, root.hemline.first_frame + round(last)
    except Refused:
        job.clear()
        raise
    if before in Job.folders and not in_use(before):
        shutil.rmtree(before, ignore_errors=True)
    return "\n".join(job.said)


def in_use(folder: Path) -> bool:
    """Whether some object reads a cache of a folder: a copy of ours does."""
    modifiers = (modifier for each in bpy.data.objects for modifier in each.modifiers if modifier.type == "MESH_CACHE")
    return any(Path(bpy.path.abspath(modifier.filepath)).resolve().parent == folder for modifier in modifiers)


# ---------------------------------------------------------------------------------------------- what acts by itself


def looked_at() -> float | None:
    """A timer: draw how far the program is, show what it wrote when it ends."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
    job = Job.running
    if job is None:
        return None
    if job.process.poll() is None:
        return BEATS_S
    Job.running = None
    root = next((each for each in bpy.data.objects if each.session_uid == job.owner), None)
    try:
        said, failed = played(job), False
    except Refused as refused:
        said, failed = str(refused), True
    if root is not None:
        root.hemline.said, root.hemline.failed = said, failed
    return BEATS_S  # once more, so that the end is drawn


def began(context, root) -> None:
    """Start a run and the timer that looks after it."""
    if Job.running is not None:
        raise Refused("hemline is at work on another object; wait for it, or stop it")
    Job.running = Job(context, root)
    if not bpy.app.timers.is_registered(looked_at):
        bpy.app.timers.register(looked_at, first_interval=BEATS_S, persistent=True)


def quiet() -> float | None:
    """A timer: settings have rested; play those objects that want it."""
    if Job.running is not None:
        return QUIET_S
    for root in bpy.context.scene.objects:
        if root.hemline.is_root and root.hemline.live and outdated(root, bpy.context.scene):
            try:
                began(bpy.context, root)
            except Refused as refused:
                root.hemline.said, root.hemline.failed = str(refused), True
                continue
            return QUIET_S
    return None


def changed(settings, context) -> None:
    """A setting was changed: where that is wanted, play it soon."""
    if settings.live:
        if bpy.app.timers.is_registered(quiet):
            bpy.app.timers.unregister(quiet)
        bpy.app.timers.register(quiet, first_interval=QUIET_S)


def outdated(root, scene) -> bool:
    """Whether settings are others than those that were played."""
    return root.hemline.played != all_asked(root, scene)


# ---------------------------------------------------------------------------------------------- baking


def baked_parts(root, scene) -> list:
    """Parts that can be baked.

    Raises:
        Refused: Nothing was played, its caches are gone, or settings were changed since.
    """
    if not cache_of(root):
        raise Refused("nothing to bake; got no point cache; press Play first")
    if outdated(root, scene):
        raise Refused("the settings are others than those that were played; press Play first")
    return [part for part in (part_of(root, each) for each in PARTS) if part is not None]


def baked_to_caches(root, scene) -> str:
    """Put the caches beside the .blend, all or none."""
    if not bpy.data.is_saved:
        raise Refused("point caches lie beside the .blend; got one that was never saved; save it first, or bake keys")
    parts, folder = baked_parts(root, scene), Path(bpy.path.abspath("//hemline"))
    stem = bpy.path.clean_name(root.name)
    targets = [folder / f"{stem}{suffix}.pc2" for suffix in ("", "_body")[: len(parts)]]
    try:
        folder.mkdir(exist_ok=True)
        copied([bpy.path.abspath(part.modifiers[MODIFIER].filepath) for part in parts], targets)
    except OSError as error:
        got = f"{Path(error.filename2 or error.filename or folder).name}: {error.strerror or error}"
        raise Refused(f"cannot write into {folder}; got {got}; make room there, or bake keys") from error
    for part, target in zip(parts, targets, strict=True):
        part.modifiers[MODIFIER].filepath = bpy.path.relpath(str(target))
    return f"{root.hemline.frames} frames in {folder}"


def copied(sources: list[str], targets: list[Path]) -> None:
    """Copy files to others, all or none; at each moment each of the others is whole, the old one or the new one."""
    with tempfile.TemporaryDirectory(dir=targets[0].parent) as waiting:
        copies = [
            shutil.copyfile(source, Path(waiting) / target.name)
            for source, target in zip(sources, targets, strict=True)
        ]
        before = [also_named(target, Path(waiting) / f"{target.name}.before") for target in targets]
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


def also_named(path: Path, name: Path) -> "Path | None":
    """Give a file a second name, or copy it where the disk knows no second names; None: there is no file."""
    if not path.is_file():
        return None
    try:
        os.link(path, name)
    except OSError:
        shutil.copyfile(path, name)
    return name


def baked_to_keys(root, scene) -> str:
    """Put every sample into a shape key, and the key's value on a line from 0 to 1 and back."""
    parts = baked_parts(root, scene)
    scale, first = timing(root, scene)["scale"], root.hemline.first_frame
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
    """Curves of an action, in Blender 4 and in its later layers."""
    action = animation.action
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    bags = (strip.channelbag(animation.action_slot) for layer in action.layers for strip in layer.strips)
    return [curve for bag in bags for curve in bag.fcurves]


# ---------------------------------------------------------------------------------------------- what users see


class HemlinePreferences(bpy.types.AddonPreferences):
    """Where hemline is."""

    bl_idname = __name__
    executable: StringProperty(
        name="hemline",
        subtype="FILE_PATH",
        description="The program, such as .venv/bin/hemline; empty: the one on PATH",
    )

    def draw(self, context):
        self.layout.prop(self, "executable")
        try:
            self.layout.label(text=f"uses {executable(context)}", icon="CHECKMARK")
        except Refused as refused:
            self.layout.label(text=str(refused), icon="ERROR")


class HemlineSettings(bpy.types.PropertyGroup):
    """What an object plays, and what became of it."""

    is_root: BoolProperty()
    part: StringProperty()
    model: StringProperty(
        name="Model",
        default="cape",
        update=changed,
        subtype="FILE_PATH",
        description="A model file, or the name of a shipped one: cape, skirt, tshirt-light, longsleeve-light, "
        "trousers-light; lag, live and swingar play any garment",
    )
    motion: StringProperty(
        name="Motion",
        default="run",
        update=changed,
        subtype="FILE_PATH",
        description="A clip (BVH, AMASS npz), or the name of a shipped one: walk, run, turn, jump, kick, dance",
    )
    garment: StringProperty(
        name="Garment",
        update=changed,
        subtype="FILE_PATH",
        description="For the models lag, live and swingar: a mesh, the name of a garment, or one from measures, "
        "as dress:7",
    )
    mesh: PointerProperty(
        name="or Mesh",
        type=bpy.types.Object,
        update=changed,
        poll=lambda self, each: each.type == "MESH" and not each.hemline.part,
        description="For the models lag, live and swingar: a mesh of this scene, as it is now",
    )
    body: StringProperty(
        name="Body", update=changed, subtype="FILE_PATH", description="Another body; empty: the model's own"
    )
    shapes: StringProperty(
        name="Shapes",
        update=changed,
        subtype="FILE_PATH",
        description="A model of the same garment that knows what shapes do; empty: none",
    )
    betas: FloatVectorProperty(
        name="Betas", size=10, update=changed, soft_min=-2, soft_max=2, description="Shape of the body"
    )
    start: FloatProperty(
        name="From", min=0, unit="TIME_ABSOLUTE", update=changed, description="Where in the clip to begin [s]"
    )
    seconds: FloatProperty(
        name="Seconds",
        min=0,
        unit="TIME_ABSOLUTE",
        update=changed,
        description="How much of the clip; 0: to its end [s]",
    )
    untangle: BoolProperty(name="Untangle", update=changed, description="Lift limbs out of each other first")
    fps: FloatProperty(name="Rate", min=0, update=changed, description="Samples a second; 0: the scene's frames")
    detail: FloatProperty(
        name="Quality", default=1, min=0.02, max=1, update=changed, description="Share of the garment's vertices"
    )
    first_frame: IntProperty(name="First Frame", default=1, update=retimed, description="Where the clip begins")
    with_body: BoolProperty(name="Body Mesh", default=True, update=changed, description="Show the body, too")
    fit_range: BoolProperty(name="Fit Range", default=True, description="Give the scene the frames of the clip")
    live: BoolProperty(name="Live", update=changed, description="Play again whenever a setting was changed")
    played: StringProperty()
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
    """An operator on the active object, or on that of which it is a part."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012, Blender's own way

    @classmethod
    def poll(cls, context):
        return root_of(context.object) is not None

    def execute(self, context):
        root = root_of(context.object)
        try:
            said, failed = self.done(context, root), False
        except Refused as refused:
            said, failed = str(refused), True
        root.hemline.said, root.hemline.failed = said, failed
        if said:
            self.report({"ERROR" if failed else "INFO"}, said)
        return {"CANCELLED" if failed else "FINISHED"}


class HEMLINE_OT_play(OnAnObject, bpy.types.Operator):
    """Play the model on the motion, and show it"""

    bl_idname, bl_label = "hemline.play", "Play"

    def done(self, context, root):
        return played(Job(context, root))

    def invoke(self, context, event):
        root = root_of(context.object)
        try:
            began(context, root)
        except Refused as refused:
            root.hemline.said, root.hemline.failed = str(refused), True
            self.report({"ERROR"}, str(refused))
            return {"CANCELLED"}
        root.hemline.said, root.hemline.failed = "", False
        return {"FINISHED"}


class HEMLINE_OT_stop(bpy.types.Operator):
    """Stop hemline; what was played before stays"""

    bl_idname, bl_label = "hemline.stop", "Stop"

    @classmethod
    def poll(cls, context):
        return Job.running is not None

    def execute(self, context):
        Job.running.stop()
        return {"FINISHED"}


class HEMLINE_OT_bake(OnAnObject, bpy.types.Operator):
    """Make what was played part of this file, so that it needs hemline no more"""

    bl_idname, bl_label = "hemline.bake", "Bake"
    into: EnumProperty(
        name="Into",
        items=[
            ("CACHE", "Point Cache", "PC2 files in the folder 'hemline' beside the .blend"),
            ("KEYS", "Shape Keys", "A shape key a frame, inside the .blend"),
        ],
    )

    def done(self, context, root):
        return {"CACHE": baked_to_caches, "KEYS": baked_to_keys}[self.into](root, context.scene)


class HEMLINE_PT_panel(bpy.types.Panel):
    """Settings of the active object, in the sidebar of the 3D view."""

    bl_label, bl_category, bl_space_type, bl_region_type = "hemline", "hemline", "VIEW_3D", "UI"

    def draw(self, context):
        layout, root = self.layout, root_of(context.object)
        layout.use_property_split = True
        if root is None:
            layout.operator("hemline.add", icon="ADD")
            return
        asked = root.hemline
        for names in (
            ("model", "motion"),
            ("garment", "mesh") if asked.model in ("lag", "live", "swingar") else (),
            ("start", "seconds", "untangle"),
            ("body", "shapes"),
            ("fps", "detail", "first_frame"),
            ("with_body", "fit_range", "live"),
        ):
            column = layout.column(align=True)
            for name in names:
                column.prop(asked, name)
        layout.column(align=True).prop(asked, "betas")
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
        elif root.hemline.played and outdated(root, context.scene):
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
    """A line of Add > Mesh."""
    self.layout.operator("hemline.add", icon="MOD_CLOTH")


def register() -> None:
    """Blender calls this when the add-on is enabled."""
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Object.hemline = PointerProperty(type=HemlineSettings)
    bpy.types.VIEW3D_MT_mesh_add.append(menu)


def unregister() -> None:
    """Blender calls this when the add-on is disabled; objects stay, with their settings."""
    for timer in (looked_at, quiet):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    if Job.running is not None:
        Job.running.stop()
        Job.running = None
    bpy.types.VIEW3D_MT_mesh_add.remove(menu)
    del bpy.types.Object.hemline
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
