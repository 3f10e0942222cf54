"""Compares a VRM character's garment, as three-vrm swings it, with simulated takes.

Run `python -m benchmarks.springs FILE.vrm TRUTH [--picture FILE.png]`. TRUTH is a dataset of the same garment and body
whose clips are of people that no fit has seen. Takes in which a limb is through the cloth are left out and counted.
Chromium plays each clip twice at 60 frames a second: by three-vrm as it is released, and with its joints as the
specification has them, limits of `VRMC_springBone_limit` included. Printed are the mean distance of the garment's
vertices to the simulated ones [mm], and the percentage of the legs' vertices behind the simulated cloth that are in
front of the played one. `--picture` writes the worst frame of each clip beside the simulation.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from hemline import pictures
from hemline.animators.ropes.springs import LEGS, skeleton_of, t_pose
from hemline.arrays import Bool, Faces, Vertices
from hemline.bench.machine import commit, machine
from hemline.bodies.body import PosedBody
from hemline.datasets import Row, Take, open_dataset
from hemline.export.vrm.vrm_humanoid import VRM_BONES
from hemline.meshes import ClosestTree, boundary_loops
from hemline.motions.motion import JOINT_NAMES, PARENTS
from hemline.springs import SkeletonMotion
from tests.export.web import three

FPS, EVERY = 60.0, 6
"""Frames a second of the player, and frames of a take from one comparison to the next."""
LEAST_IN_FRONT = 0.0005
"""Least distance in front of the cloth that counts [m]."""
BONES = [name for name in JOINT_NAMES if name in VRM_BONES]


def sides(
    vertices: Vertices, faces: Faces, skin: np.ndarray, normals: np.ndarray
) -> tuple[np.ndarray, Bool[np.ndarray, " skin"]]:
    """Returns the distance of skin in front of a garment [m], and whether it faces the cloth and not an edge of it."""
    tree = ClosestTree(np.asarray(vertices, np.float64), faces)
    closest = tree.closest(skin)
    outward = tree.outward(closest)
    side = np.sign(np.einsum("px,px->p", skin - closest.positions, outward)) * closest.distances
    rim = np.zeros(len(vertices), bool)
    for loop in boundary_loops(faces):
        rim[loop] = True
    used = closest.weights > 1e-6
    inner = (rim[faces[closest.faces]] & used).sum(axis=1) < used.sum(axis=1)
    return side, inner & (np.einsum("px,px->p", normals, outward) > 0)


def local_rotations(skeleton: SkeletonMotion) -> list[list[float]]:
    """Returns the rotation of each bone of VRM from the one above (xyzw), one list a frame."""
    turns = []
    for name in BONES:
        joint = JOINT_NAMES.index(name)
        above = skeleton.turns[:, PARENTS[joint]] if PARENTS[joint] >= 0 else np.eye(3)[None]
        turns.append(Rotation.from_matrix(np.swapaxes(above, 1, 2) @ skeleton.turns[:, joint]).as_quat())
    return np.stack(turns, axis=1).reshape(len(skeleton.turns), -1).round(7).tolist()


class Clip:
    """A take that is compared with, and what is compared of it."""

    def __init__(self, take: Take, name: str, faces: Faces, rest: PosedBody):
        self.name, self.faces = name, faces
        motion = take.motion.resample(FPS)
        self.skeleton = skeleton_of(rest, motion)
        run_up = len(self.skeleton.joints) - len(motion)
        frames = np.arange(int(take.lead_in.sum()), len(take.vertices), EVERY)
        played = run_up + np.round(frames * FPS / take.motion.fps).astype(int)
        there = played < len(self.skeleton.joints)
        self.kept, frames = played[there].tolist(), frames[there]
        self.truth = take.vertices[frames]
        self.posed = [rest.shaped.posed(take.motion[int(frame)]) for frame in frames]
        weights = np.zeros((len(rest.vertices), len(JOINT_NAMES)))
        body = rest.shaped.body
        np.add.at(weights, (np.arange(len(weights))[:, None], body.weight_indices), body.weights)
        self.legs = np.flatnonzero(np.isin(weights.argmax(axis=1), LEGS))

    def compare(self, found: dict[str, np.ndarray]) -> tuple[float, float, int]:
        """Returns the error [mm], the percentage of the legs in front, and the frame of the most."""
        (name,) = set(found) - {"body"}
        errors = 1000 * np.linalg.norm(found[name] - self.truth, axis=-1)
        front, covered = [], []
        for cloth, skin, truth, posed in zip(found[name], found["body"], self.truth, self.posed, strict=True):
            normals = posed.normals[self.legs]
            side, inner = sides(truth, self.faces, posed.vertices[self.legs].astype(np.float64), normals)
            behind = (side < 0) & inner
            side, inner = sides(cloth, self.faces, skin[self.legs].astype(np.float64), normals)
            front.append(int((behind & inner & (side > LEAST_IN_FRONT)).sum()))
            covered.append(int(behind.sum()))
        return float(errors.mean()), 100 * sum(front) / max(sum(covered), 1), int(np.argmax(front))


def usable(rows: list[Row]) -> list[Row]:
    """Returns the takes in which no limb is through the cloth, and says how many are left out."""
    kept = [row for row in rows if row.failed is None and not row.limbs_through]
    print(f"{len(rows) - len(kept)} of {len(rows)} takes left out: a limb is through the cloth, or the take failed")
    return kept


def main(file: Path, truth: Path, picture: Path | None) -> None:
    dataset = open_dataset(truth)
    rest = t_pose(dataset.body.shaped(dataset.garment.body_betas))
    faces, results, rows = dataset.garment.faces, [], []
    print(json.dumps({"machine": machine(), "commit": commit()}))
    for row in usable(dataset.clips()):
        clip = Clip(dataset.take(row), row.clip, faces, rest)
        names = [VRM_BONES[name] for name in BONES]
        arguments = (f"/{file.name}", names, local_rotations(clip.skeleton), clip.skeleton.joints[:, 0].tolist())
        figures = {"clip": clip.name}
        for label, specified in (("three_vrm", False), ("with_limits", True)):
            with three(file.parent.resolve()) as page:
                found = page("window.playVrm", *arguments, clip.kept, specified, specified)
            error, front, worst = clip.compare(found)
            figures |= {f"{label}_error_mm": round(error, 1), f"{label}_legs_percent": round(front, 2)}
            if not specified and picture:
                rows.append(_pictures(clip, found, worst))
        results.append(figures)
        print(json.dumps(figures), flush=True)
    mean = {name: round(float(np.mean([each[name] for each in results])), 2) for name in results[0] if name != "clip"}
    print(json.dumps({"clip": "mean"} | mean))
    if picture:
        pictures.write_png(picture, np.concatenate(rows))


def _pictures(clip: Clip, found: dict[str, np.ndarray], worst: int) -> np.ndarray:
    (name,) = set(found) - {"body"}
    posed = clip.posed[worst]
    shown = []
    for cloth, skin in ((found[name][worst], found["body"][worst]), (clip.truth[worst], posed.vertices)):
        meshes = [(cloth, clip.faces, "cloth"), (skin, posed.faces, "body")]
        shown += [pictures.picture_of(meshes, view, size=(300, 380)) for view in ("front", "three_quarter")]
    return np.concatenate(shown, axis=1)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("truth", type=Path)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    main(options.file, options.truth, options.picture)
