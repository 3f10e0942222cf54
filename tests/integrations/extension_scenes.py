"""Runs inside Blender: install the extension, play a scene of this file, tell what became of it.

`python extension_scenes.py SCENE FOLDER PACKAGE EXECUTABLE`: figures and messages in `FOLDER/told.json`, vertices by
name in `FOLDER/vertices.npz`.
"""

# bpy is in an environment of its own
# pyright: reportMissingImports=false, reportArgumentType=false

import json
import os
import re
import shutil
import sys
import time
from pathlib import Path

FOLDER, PACKAGE, EXECUTABLE = Path(sys.argv[2]), sys.argv[3], sys.argv[4]
os.environ["BLENDER_USER_RESOURCES"] = str(FOLDER / "blender")

import bpy  # noqa: E402
import numpy as np  # noqa: E402

ADDON = "bl_ext.user_default.hemline"
TOLD, VERTICES = {}, {}


def installed():
    """The extension, as *Install from Disk* installs it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(filepath=PACKAGE, repo="user_default", enable_on_install=True)
    preferences().executable = EXECUTABLE
    assert Path(sys.modules[ADDON].__file__).is_relative_to(FOLDER / "blender" / "extensions" / "user_default")


def preferences():
    return bpy.context.preferences.addons[ADDON].preferences


def module(name):
    """A module of the extension."""
    return sys.modules[f"{ADDON}.{name}"]


def added(**settings):
    """A new object with these settings, in a scene of 30 frames a second."""
    bpy.context.scene.render.fps = 30
    bpy.ops.hemline.add()
    root = bpy.context.object
    chosen = {"model": "cape", "motion": "run", "seconds": 0.4, "detail": 0.1} | settings
    for name, value in chosen.items():
        setattr(root.hemline, name, value)
    return root


def world(part, frames=range(1, 14)):
    """Vertices in the world at frames of the scene, in our axes."""
    places = []
    for frame in frames:
        bpy.context.scene.frame_set(int(frame // 1), subframe=float(frame % 1))
        evaluated = part.evaluated_get(bpy.context.evaluated_depsgraph_get())
        mesh = evaluated.to_mesh()
        local = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", local)
        matrix = np.array(evaluated.matrix_world)
        evaluated.to_mesh_clear()
        x, y, z = (local.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]).T
        places.append(np.stack([x, z, -y], axis=1))
    return np.array(places)


def parts(root):
    return {child.hemline.part: child for child in root.children}


def said(root, operator=bpy.ops.hemline, verb="play", **options) -> str:
    """What an operator that must fail says; the panel says the same."""
    try:
        getattr(operator, verb)(**options)
    except RuntimeError as error:
        text = str(error).removeprefix("Error: ").strip()
        assert root.hemline.failed and root.hemline.message == text
        return text
    raise AssertionError("this did not fail")


def scene_plays():
    """Garment and body, of another shape, from the eleventh frame on."""
    root = added(first_frame=11, betas=[0.5, -1.0, *[0.0] * 8], detail=1.0)
    bpy.ops.hemline.play()
    for name, part in parts(root).items():
        VERTICES[name] = world(part, range(11, 24))
        VERTICES[f"{name} too early"] = world(part, [5])
        VERTICES[f"{name} too late"] = world(part, [40])
        VERTICES[f"{name} faces"] = np.array([face.vertices[:] for face in part.data.polygons])
    scene = bpy.context.scene
    TOLD.update(range=[scene.frame_start, scene.frame_end], notices=parts(root)["body"]["notices"])
    root.hemline.first_frame = 101
    VERTICES["garment later"] = world(parts(root)["garment"], range(101, 114))
    root.location.x, root.rotation_euler.z = 2.0, np.pi / 2
    VERTICES["garment moved"] = world(parts(root)["garment"], [101])


def scene_rates():
    """60 samples a second in a scene of 24, and in one of 23.976."""
    root = added(fps=60.0, with_body=False)
    bpy.context.scene.render.fps = 24
    bpy.ops.hemline.play()
    VERTICES["garment"] = world(parts(root)["garment"], range(1, 10))
    TOLD["parts"] = list(parts(root))
    root.hemline.fps, bpy.context.scene.render.fps_base = 0.0, 1.001
    TOLD["outdated"] = module("playing").is_outdated(root, bpy.context.scene)
    bpy.ops.hemline.play()
    VERTICES["film"] = world(parts(root)["garment"], range(1, 10))
    TOLD["again"] = module("playing").is_outdated(root, bpy.context.scene)


def scene_blows():
    """Wind from behind, in Blender's axes, and for a model that it does not move."""
    root = added(wind=(0.5, -4.0, 0.25))
    bpy.ops.hemline.play()
    VERTICES["garment"] = world(parts(root)["garment"])
    root.hemline.wind = (0.0, 0.0, 0.0)
    TOLD["calm"] = module("program").animate_words(root.hemline, bpy.context.scene)
    root.hemline.wind = (0.0, -4.0, 0.0)
    root.hemline.model = "tshirt-light"
    TOLD["shirt"] = module("program").animate_words(root.hemline, bpy.context.scene)
    root.hemline.model = str(FOLDER / "shirt.safetensors")
    TOLD["refused"] = said(root)


def scene_keeps():
    """Materials, modifiers and the mesh of an object outlive another Play; a failure changes nothing."""
    root = added()
    bpy.ops.hemline.play()
    garment = parts(root)["garment"]
    garment.data.materials[0] = bpy.data.materials.new("mine")
    garment.modifiers.new("mine", "SUBSURF").show_viewport = False
    first, before = module("parts").cache_of(root), world(garment)
    root.hemline.motion = "nothing"
    TOLD["failed"] = said(root)
    assert module("parts").cache_of(root) == first and np.array_equal(world(garment), before)
    root.hemline.motion = "walk"
    TOLD["bake refused"] = said(root, verb="bake", into="KEYS")
    bpy.ops.hemline.play()
    assert parts(root)["garment"] == garment and not os.path.exists(first)
    TOLD.update(
        materials=[each.name for each in garment.data.materials],
        modifiers=[each.name for each in garment.modifiers],
        smoothed=all(face.use_smooth for face in garment.data.polygons),
        moved=float(np.abs(world(garment) - before).max()),
    )
    root.hemline.detail = 0.2
    bpy.ops.hemline.play()
    TOLD["finer"] = len(garment.data.vertices)
    TOLD["still"] = [each.name for each in garment.data.materials]


def scene_bakes_a_cache():
    """Beside the .blend; opened again without the caches that Play made."""
    root = added()
    bpy.ops.hemline.play()
    TOLD["unsaved"] = said(root, verb="bake", into="CACHE")
    blend = FOLDER / "project" / "scene.blend"
    blend.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    (blend.parent / "hemline").write_text("in the way")
    TOLD["locked"] = said(root, verb="bake", into="CACHE")
    (blend.parent / "hemline").unlink()
    (blend.parent / "hemline" / "hemline_body.pc2").mkdir(parents=True)
    TOLD["half locked"] = said(root, verb="bake", into="CACHE")
    assert [each.name for each in (blend.parent / "hemline").iterdir()] == ["hemline_body.pc2"]
    shutil.rmtree(blend.parent / "hemline")
    made = Path(module("parts").cache_of(root)).parent
    VERTICES["garment"] = world(parts(root)["garment"])
    bpy.ops.hemline.bake(into="CACHE")
    bpy.ops.wm.save_mainfile()
    shutil.rmtree(made)
    shutil.move(blend.parent, FOLDER / "moved")
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "moved" / "scene.blend"))
    (root,) = (each for each in bpy.data.objects if each.hemline.is_root)
    bpy.context.view_layer.objects.active = root
    VERTICES["opened"] = world(parts(root)["garment"])
    TOLD.update(
        files=sorted(str(each.relative_to(FOLDER / "moved")) for each in (FOLDER / "moved").rglob("*.pc2")),
        paths=[part.modifiers["hemline"].filepath for part in parts(root).values()],
    )


def scene_removes_its_own():
    """Played again, what Play wrote before goes; a folder that a .blend names does not, whatever it is called."""
    root = added()
    bpy.ops.hemline.play()
    made = Path(module("parts").cache_of(root)).parent
    mine = FOLDER / "hemline-winter-collection"
    mine.mkdir()
    (mine / "sketches.txt").write_text("mine")
    for part in parts(root).values():
        cache = Path(part.modifiers["hemline"].filepath)
        part.modifiers["hemline"].filepath = str(shutil.copy(cache, mine))
    bpy.ops.hemline.play()
    again = Path(module("parts").cache_of(root)).parent
    bpy.ops.hemline.play()
    TOLD.update(mine=sorted(each.name for each in mine.iterdir()), first=made.exists(), second=again.exists())


def scene_bakes_keys():
    """Opened where there is no add-on; then played again."""
    root = added(fps=20.0)
    bpy.ops.hemline.play()
    VERTICES["garment"] = world(parts(root)["garment"])
    bpy.ops.hemline.bake(into="KEYS")
    VERTICES["baked"] = world(parts(root)["garment"])
    TOLD["baked again"] = said(root, verb="bake", into="KEYS")
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / "scene.blend"))
    bpy.ops.preferences.addon_disable(module=ADDON)
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "scene.blend"))
    VERTICES["opened"] = world(bpy.data.objects["hemline garment"])
    bpy.ops.preferences.addon_enable(module=ADDON)
    preferences().executable = EXECUTABLE
    root = bpy.data.objects["hemline"]
    bpy.context.view_layer.objects.active = root
    bpy.ops.hemline.play()
    VERTICES["again"] = world(parts(root)["garment"])
    TOLD["keys"] = parts(root)["garment"].data.shape_keys is not None


def scene_wears_a_mesh():
    """A mesh of the scene, in a scene that counts centimetres."""
    bpy.context.scene.unit_settings.scale_length = 0.01
    own = own_mesh(scale=100)
    root = added(model="live", mesh=own, detail=1.0, seconds=0.2)
    bpy.ops.hemline.play()
    VERTICES["garment"] = world(parts(root)["garment"], range(1, 8))
    TOLD["said"] = root.hemline.message
    root.hemline.mesh = None
    TOLD["none"] = said(root)


def own_mesh(scale=1.0):
    """The garment of `own.npz`, an active object of the scene."""
    with np.load(FOLDER / "own.npz") as own:
        mesh = bpy.data.meshes.new("own")
        mesh.from_pydata((scale * module("mesh_files").z_up(own["vertices"])).tolist(), [], own["faces"].tolist())
    own = bpy.data.objects.new("own", mesh)
    bpy.context.collection.objects.link(own)
    bpy.context.view_layer.objects.active = own
    return own


def objects():
    """Names of everything that a failure must leave alone."""
    return sorted(each.name for kind in ("objects", "meshes", "images") for each in getattr(bpy.data, kind))


def scene_tries_on():
    """A mesh with UV map, material and pins; then played as it is worn; then what cannot be worn, and a stop."""
    own = own_mesh()
    own.data.uv_layers.new(name="pattern")
    own.data.materials.append(bpy.data.materials.new("mine"))
    with np.load(FOLDER / "own.npz") as arrays:
        own.vertex_groups.new(name="held").add(arrays["held"].tolist(), 1.0, "REPLACE")
        own.vertex_groups["held"].add(arrays["loose"].tolist(), 0.4, "REPLACE")
    own.hemline.pins, own.hemline.betas = "held", [0.5, *[0.0] * 9]
    bpy.ops.hemline.try_on()
    worn = bpy.data.objects["own worn"]
    VERTICES["worn"] = world(worn, [1])
    pins = worn.vertex_groups["pins"].index
    TOLD.update(
        message=own.hemline.message,
        pins=[each.index for each in worn.data.vertices if any(group.group == pins for group in each.groups)],
        kept=[worn.data.materials[0].name, worn.data.uv_layers[0].name, list(bpy.data.images["own worn"].size)],
    )
    bpy.context.view_layer.objects.active = worn
    bpy.ops.hemline.add(of_mesh=True)
    root = bpy.context.object
    root.hemline.seconds, root.hemline.material = 0.3, "wool"
    root.hemline.motion = "dance"
    bpy.context.scene.render.fps = 30
    bpy.ops.hemline.play()
    TOLD["betas"] = list(root.hemline.betas)
    VERTICES["garment"], VERTICES["body"] = (world(parts(root)[each], range(1, 11)) for each in ("garment", "body"))

    bpy.context.view_layer.objects.active = own
    before = objects()
    own.hemline.pins = "sleeves"
    TOLD["no group"] = said(own, verb="try_on")
    own.vertex_groups.new(name="sleeves").add([0], 0.3, "REPLACE")
    TOLD["no vertices"] = said(own, verb="try_on")
    own.hemline.pins = ""
    module("background").run_in_background(module("trying_on").start_try_on, bpy.context, own)
    bpy.ops.hemline.stop()
    watch()
    TOLD["stopped"] = own.hemline.message
    bpy.ops.mesh.primitive_cube_add()
    cube, before = bpy.context.object, objects()
    TOLD["cube"] = said(cube, verb="try_on")
    assert objects() == before


def scene_exports_alembic():
    """*File, Export, Alembic* of what was played, imported again."""
    root = added()
    bpy.ops.hemline.play()
    for part in parts(root).values():
        part.select_set(True)
    path = str(FOLDER / "played.abc")
    bpy.ops.wm.alembic_export(filepath=path, selected=True, as_background_job=False)
    known = set(bpy.data.objects)
    bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)
    for each in set(bpy.data.objects) - known:
        if each.type == "MESH":
            VERTICES["body" if "body" in each.name else "garment"] = world(each)


class Layout:
    """A layout that writes down what the panel draws, as Blender's module has no windows to draw it in."""

    def __init__(self, drawn):
        self.drawn = drawn

    def column(self, **_):
        return Layout(self.drawn)

    row = column

    def prop(self, settings, name):
        self.drawn.append(settings.bl_rna.properties[name].name)

    def prop_search(self, settings, name, collection, items):
        assert hasattr(collection, items)
        self.prop(settings, name)

    def operator(self, name, text=None, icon="NONE"):
        kind = getattr(bpy.ops.hemline, name.removeprefix("hemline."))
        self.drawn.append(text if text is not None else kind.get_rna_type().name)
        return type("Given", (), {})()

    def label(self, text, icon="NONE"):
        self.drawn.append(text)

    def progress(self, factor, text):
        assert 0 <= factor <= 1
        self.drawn.append(text)


def drawn():
    """What the panel shows for the active object."""
    panel = type("Panel", (), {"layout": Layout([])})()
    context = type("Context", (), {"object": bpy.context.object, "scene": bpy.context.scene})()
    context.region = type("Region", (), {"width": 300})()
    module("panel").HEMLINE_PT_panel.draw(panel, context)
    return panel.layout.drawn


def scene_runs_the_script():
    """The script of the page."""
    page = Path(__file__).parents[2] / "integrations" / "blender" / "README.md"
    (script,) = re.findall(r"^```python\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)
    exec(script, {})
    root = bpy.context.object
    TOLD.update(
        message=root.hemline.message,
        keys=len(parts(root)["garment"].data.shape_keys.key_blocks),
        range=[bpy.context.scene.frame_start, bpy.context.scene.frame_end],
    )


def scene_is_drawn():
    """The panel without an object, with a mesh, with an object, and while hemline is at work."""
    TOLD["nothing"] = drawn()
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    TOLD["mesh"] = drawn()
    root = added(seconds=1.0)
    TOLD["object"] = drawn()
    root.hemline.model = "tshirt-light"
    TOLD["shirt"] = drawn()
    root.hemline.model, root.hemline.mesh = "live", cube
    TOLD["garment"] = drawn()
    root.hemline.model = "cape"
    play_in_background(root)
    TOLD["at work"] = []
    while module("background").watch_job() is not None:
        TOLD["at work"] += [text for text in drawn() if text.startswith("animate")]
        time.sleep(0.02)
    root.hemline.motion = "walk"
    TOLD["changed"] = drawn()


def scene_refuses():
    """No hemline, no program, a wrong model, motion, betas, garment."""
    root = added()
    for name, settings in {
        "model": {"model": "cap"},
        "file": {"model": "//no.safetensors"},
        "damaged": {"model": PACKAGE},
        "motion": {"motion": "//no.bvh"},
        "betas": {"model": "tshirt-light", "body": "smpl"},
        "garment": {"model": "live"},
        "material": {"material": "silk"},
    }.items():
        for key, value in {"model": "cape", "motion": "run", "body": "", "material": "OWN", **settings}.items():
            setattr(root.hemline, key, value)
        TOLD[name] = said(root)
    root.hemline.material = "OWN"
    for name, program in {
        "no program": "/no/such/hemline",
        "another program": shutil.which("true"),
        "not run": str(FOLDER / "script"),
    }.items():
        preferences().executable = program
        TOLD[name] = said(root)
    preferences().executable, os.environ["PATH"] = "", str(FOLDER)
    TOLD["not on the path"] = said(root)
    assert not root.children and not list(Path(bpy.app.tempdir or "/tmp").glob("hemline-*/*.pc2"))


def play_in_background(root):
    module("background").run_in_background(module("playing").start_playing, bpy.context, root)


def watch():
    """Blender's timer, until the program has ended."""
    while module("background").watch_job() is not None:
        time.sleep(0.02)


def scene_plays_in_the_background():
    """As the button does: the timer looks after the program, tells how far it is, stops it, plays changes by itself."""
    root = added(seconds=1.0)
    play_in_background(root)
    stages = []
    while module("background").watch_job() is not None:
        job = module("background").running_job()
        stages += [[job.stage, job.share, job.seconds_left]] if job else []
        time.sleep(0.02)
    TOLD["stages"] = stages
    assert len(world(parts(root)["garment"], [1])[0]) == len(parts(root)["garment"].data.vertices)
    before = module("parts").cache_of(root)
    play_in_background(root)
    try:
        play_in_background(root)
    except module("refused").Refused as refused:
        TOLD["busy"] = str(refused)
    bpy.ops.hemline.stop()
    watch()
    TOLD["stopped"] = root.hemline.message
    assert module("parts").cache_of(root) == before
    root.hemline.live = True
    root.hemline.seconds = 0.2
    assert bpy.app.timers.is_registered(module("background").play_changed)
    module("background").play_changed()
    watch()
    TOLD["frames"] = root.hemline.frames
    root.hemline.motion = "nothing"
    module("background").play_changed()
    watch()
    TOLD["live"], TOLD["tried again"] = root.hemline.message, module("background").play_changed()
    root.hemline.motion, root.hemline.live = "run", False
    play_in_background(root)
    bpy.data.objects.remove(root)
    watch()
    watch_job = module("background").watch_job
    bpy.ops.preferences.addon_disable(module=ADDON)
    assert not hasattr(bpy.types.Object, "hemline") and not bpy.app.timers.is_registered(watch_job)


def scene_is_rendered():
    """A picture by Cycles, to look at."""
    root = added(detail=1.0, seconds=0.8)
    bpy.ops.hemline.play()
    scene = bpy.context.scene
    scene.frame_set(20)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    light = bpy.data.objects.new("light", bpy.data.lights.new("light", "SUN"))
    light.data.energy, light.rotation_euler = 4.0, (0.8, 0.3, 0.4)
    for each in (camera, light):
        scene.collection.objects.link(each)
    middle = world(parts(root)["body"], [20])[0].mean(axis=0)
    camera.location = (middle[0] - 2.6, -middle[2] + 2.2, middle[1] + 0.5)
    aim = camera.constraints.new("TRACK_TO")
    target = bpy.data.objects.new("target", None)
    target.location = (middle[0], -middle[2], middle[1])
    scene.collection.objects.link(target)
    aim.target = target
    scene.world = bpy.data.worlds.new("grey")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (0.6, 0.65, 0.7, 1)
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.device = 8, "CPU"
    scene.render.resolution_x, scene.render.resolution_y = 320, 320
    scene.render.filepath = str(FOLDER / "rendered.png")
    bpy.ops.render.render(write_still=True)
    VERTICES["picture"] = np.array(bpy.data.images.load(scene.render.filepath).pixels[:], np.float32).reshape(
        320, 320, 4
    )


def main(name):
    installed()
    globals()[f"scene_{name}"]()
    np.savez(FOLDER / "vertices.npz", **VERTICES)
    (FOLDER / "told.json").write_text(json.dumps(TOLD))
    shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    os._exit(0)  # after it has opened a .blend, Blender's module may wait for a thread of its own at exit, for ever


main(sys.argv[1])
