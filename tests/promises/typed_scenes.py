"""What a user does, with every call of hemline compared with its annotations: `python typed_scenes.py SCENE`.

Run in a process of its own, as the hook must be there before hemline is imported. Kernels are compiled, not checked.
"""

import json
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import PathFinder
from pathlib import Path

from jaxtyping import TypeCheckError, install_import_hook

from tests.promises import checked


class Unchecked(MetaPathFinder):
    """Finds some modules as they are.

    Kernels and their compiler, as numba compiles functions and no checked wrappers of them; and options, whose
    functions say that they return a number where they return a dataclass's field, as `dataclasses.field` does.
    """

    def find_spec(self, fullname, path=None, target=None):
        """The plain module, or None: the next finder is asked."""
        if fullname.startswith("hemline.") and (".compiled" in fullname or fullname.endswith(("kernels", ".options"))):
            return PathFinder.find_spec(fullname, path, target)
        return None


install_import_hook("hemline", "tests.promises.checked.checked")
sys.meta_path.insert(0, Unchecked())

import numpy as np  # noqa: E402

import hemline  # noqa: E402
from hemline import bodies, garments, motions  # noqa: E402
from hemline.cli import main  # noqa: E402

SAMPLES = Path(__file__).parents[1]


def verb(line: str) -> None:
    """Run one command in this process; it must succeed."""
    assert main(line.split()) == 0, line


def napkin(rows: int = 15, columns: int = 20) -> None:
    """A cape of few vertices as a file."""
    garments.write("napkin.safetensors", garments.make_cape(bodies.load("anny24").shaped(), rows=rows, columns=columns))


def clip(name: str, frames: int) -> str:
    """The start of a shipped excerpt as a file."""
    motions.write(f"{name}.safetensors", motions.load(name)[:frames])
    return f"{name}.safetensors"


def wrong_shape() -> None:
    """A mesh whose faces have four corners, and one whose vertices are whole numbers, are refused by the checker."""
    from hemline.meshes import vertex_normals

    triangle = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
    vertex_normals(*triangle)
    for bad in ((triangle[0], np.array([[0, 1, 2, 0]], np.int32)), (np.eye(3, dtype=np.int32), triangle[1])):
        try:
            vertex_normals(*bad)
        except TypeCheckError:
            continue
        raise AssertionError("nothing was checked")


def play() -> None:
    """The shipped cape, on other shapes too, measured and untangled, into every format."""
    run, cape = clip("run", 5), hemline.load("cape")
    body = bodies.load("anny24").shaped(betas=[0.5, -1.0])
    motion = motions.load("run")[:4]
    frames = list(hemline.play(cape, body, motion, fps=60, pre_roll=0.1, measure=True, untangle=True))
    near, far = (hemline.Player.prepare(cape, body, detail=detail) for detail in (0.5, 0.2))
    state = near.switch_to(near.start(motion[0], pre_roll=0.1), far)
    far.step(state, motion[1], 1 / 30)
    hemline.detail_for(5.0, {0.5: near.error, 0.2: far.error})
    recorded = hemline.record(frames, garment_name="cape", garment_faces=cape.garment.faces, motion=motion, fps=60)
    for ending in hemline.export.FORMATS:
        assert hemline.export.write(Path(f"cape{ending}"), recorded)
    verb(f"evaluate cape -m {run} --json --picture worst.png")
    verb(f"animate cape -m {run} -o cape.npz --betas 1 --explain")


def simulate() -> None:
    """A few vertices in gusts of wind; the take is exported."""
    napkin()
    verb(f"simulate napkin.safetensors -m {clip('run', 6)} -o data --fps 10 --wind 2 0 0 --gusts 1 --quantised")
    verb("export data --take 0 -o take.npz --lead-in")


def rest() -> None:
    """At rest, and how that changes with a joint."""
    napkin()
    shaped, garment = bodies.load("anny24").shaped(), garments.read("napkin.safetensors")
    settled = hemline.sim.settle(garment, shaped, shaped.rest_pose)
    hemline.sim.Sensitivities(settled).turn("left_shoulder", np.eye(3)[0])
    hemline.sim.produce_posed("posed", garment, [[shaped.rest_pose]], [(), (1.0,)])


def fit() -> None:
    """From four clips to a model, evaluated beside the simulation."""
    napkin(12, 16)
    clips = " ".join(clip(name, 31) for name in ("walk", "turn", "jump", "kick"))
    verb(f"simulate napkin.safetensors -m {clips} -o data")
    short = "--epochs 3 --correction-components 4 --components 4 --shape-components 4 --hidden 16"
    verb(f"fit data -o napkin-model.safetensors {short} --batch 16 --threads 1")
    verb("evaluate napkin-model.safetensors -m kick.safetensors --truth data --json")
    verb("evaluate napkin-model.safetensors -m kick.safetensors --truth data --drive truth --json")


def close_fitting() -> None:
    """From anchors to a model of a shirt, on another shape; poses of a clip sorted into clusters."""
    from hemline.motions.pose_clusters import cluster_poses
    from hemline.sim.takes.database import sample_poses
    from tests.animators import formula_garment as made

    made.make_dataset(Path("anchors"), 4, singles=1, shapes=made.SHAPES[:3])
    verb("fit anchors --animator agentdress -o shirt.safetensors --pose-modes 4")
    verb(f"evaluate shirt.safetensors -m {clip('walk', 5)} --betas 1 0 0 0 0.5 --json")
    cluster_poses(sample_poses([motions.load("walk")[:40]]), np.ones(24), 2)


def tryon() -> None:
    """A shirt in centimetres, turned, that somebody else made; clothes by the files of MakeHuman's kind."""
    shirt = garments.load("tshirt-light")
    lines = [f"v {100 * x:.4f} {100 * y:.4f} {100 * z:.4f}" for x, y, z in shirt.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in shirt.faces.tolist()]
    Path("shirt.obj").write_text("\n".join(lines) + "\n")
    verb("tryon shirt.obj -o shirt.safetensors --picture shirt.png")


def read() -> None:
    """Files of others: SMPL, BVH, AMASS, clothes bound to a base mesh; what ships, by name."""
    for name in garments.names():
        garments.load(name)
    for name in motions.names():
        motion = motions.load(name)
        motions.longest_clean(motion)
    body = bodies.load("anny24")
    garments.wear_together([garments.load("tshirt-light"), garments.load("skirt-light")])
    bodies.write("body.safetensors", body)
    bodies.read("body.safetensors").shaped([1.0]).untangle_motion(motions.load("kick")[:5])


SCENES = {scene.__name__: scene for scene in (wrong_shape, play, simulate, rest, fit, close_fitting, tryon, read)}

if __name__ == "__main__":
    SCENES[sys.argv[1]]()
    print(json.dumps(dict(checked.decorated)), file=sys.stderr)
