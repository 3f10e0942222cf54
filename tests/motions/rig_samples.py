"""Shipped clips on skeletons of other makers: names, joint axes and worlds of their own, and the truth beside them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from hemline import motions
from hemline.motions import JOINT_NAMES, PARENTS, Motion
from hemline.motions.bvh import Bvh, BvhSkeleton
from hemline.motions.figure import FIGURE
from tests.motions.bvh_samples import quaternions

TRUNK = {"pelvis": "Hips", "spine1": "Spine", "spine2": "Spine1", "spine3": "Spine2", "neck": "Neck", "head": "Head"}
LIMBS = {
    "hip": "UpLeg",
    "knee": "Leg",
    "ankle": "Foot",
    "foot": "ToeBase",
    "collar": "Shoulder",
    "shoulder": "Arm",
    "elbow": "ForeArm",
    "wrist": "Hand",
    "hand": "HandMiddle1",
}
MIXAMO = tuple(
    TRUNK[name] if name in TRUNK else f"{name.split('_')[0].title()}{LIMBS[name.split('_')[1]]}" for name in JOINT_NAMES
)
WORLDS = {
    "z": Rotation.from_euler("x", 90, degrees=True),
    "-y": Rotation.from_euler("x", 180, degrees=True),
    "-z": Rotation.from_euler("x", -90, degrees=True),
    "x": Rotation.from_euler("z", -90, degrees=True),
    "-x": Rotation.from_euler("z", 90, degrees=True),
}
"""Rotations of a world with y up to one in which another axis is up."""


def upright_figure() -> np.ndarray:
    """The figure, its trunk plumb, as the rigs of most makers stand."""
    places = FIGURE.copy()
    trunk = [JOINT_NAMES.index(name) for name in (*TRUNK, "left_hip", "right_hip")]
    places[trunk, 2] = 0
    return places


def along_bones(places: np.ndarray) -> list[Rotation]:
    """Axes of which x lies along the bone, as in LAFAN1's, Biped's and Rokoko's files."""
    axes = []
    for joint in range(24):
        child = next((k for k in range(24) if PARENTS[k] == joint), None)
        bone = np.array([0, 1.0, 0]) if child is None or joint in (0, 9) else places[child] - places[joint]
        axes.append(Rotation.align_vectors([bone / np.linalg.norm(bone)], [[1, 0, 0]])[0])
    return axes


@dataclass(frozen=True, eq=False)
class Sample:
    """A clip on a rig, and the clip that it was made of."""

    bvh: Bvh
    motion: Motion
    places: np.ndarray


def sample(
    clip: str,
    axes: Sequence[Rotation] | None = None,
    *,
    world: Rotation | None = None,
    names: Sequence[str] = MIXAMO,
    places: np.ndarray | None = None,
    frames: slice = slice(0, 120, 4),
) -> Sample:
    """A shipped clip on the figure, in centimetres, written with joint axes and in a world of its own."""
    places = upright_figure() if places is None else places
    motion = motions.load(clip)[frames]
    axes = [Rotation.identity()] * 24 if axes is None else axes
    world = Rotation.identity() if world is None else world
    turned = [world * each * axes[joint] for joint, each in enumerate(globals_of(motion))]
    local = np.stack(
        [quaternions(turned[j] if PARENTS[j] < 0 else turned[PARENTS[j]].inv() * turned[j]) for j in range(24)],
        axis=1,
    )
    offsets = np.array(
        [
            axes[PARENTS[j]].inv().apply(places[j] - places[PARENTS[j]]) if PARENTS[j] >= 0 else np.zeros(3)
            for j in range(24)
        ]
    )
    skeleton = BvhSkeleton(tuple(names), PARENTS, 100 * offsets, {}, ((),) * 24)
    path = 100 * world.apply(motion.translations.astype(float))
    return Sample(Bvh(skeleton, local, {0: path}, motion.fps), motion, places)


def globals_of(motion: Motion) -> list[Rotation]:
    """Global rotations of the joints, by scipy."""
    turned: list[Rotation] = []
    for joint, parent in enumerate(PARENTS):
        local = Rotation.from_quat(motion.rotations[:, joint][:, [1, 2, 3, 0]].astype(float))
        turned.append(local if parent < 0 else turned[parent] * local)
    return turned


def joints_mm(motion: Motion, places: np.ndarray) -> np.ndarray:
    """Joints of a T-pose figure that a clip moves, about the pelvis, by scipy [mm]."""
    turned = globals_of(motion)
    found = np.zeros((len(motion), 24, 3))
    for joint in range(1, 24):
        above = PARENTS[joint]
        found[:, joint] = found[:, above] + turned[above].apply(places[joint] - places[above])
    return 1000 * found


def apart_mm(found: Motion, truth: Sample) -> tuple[float, float]:
    """Mean and largest distance between the joints of two clips about the pelvis [mm]."""
    off = np.linalg.norm(joints_mm(found, truth.places) - joints_mm(truth.motion, truth.places), axis=-1)
    return float(off.mean()), float(off.max())
