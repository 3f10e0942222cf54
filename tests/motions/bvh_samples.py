"""A made-up person with a T-pose as zero pose, and a writer of BVH text, for the tests of the reader."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from hemline.motions.bvh import Bvh, BvhSkeleton
from hemline.motions.quaternions import inverse, multiply, rotate

LIMBS = {
    "Hips": (None, (0, 0, 0)),
    "LeftUpLeg": ("Hips", (10, -8, 1)),
    "LeftLeg": ("LeftUpLeg", (0, -41, 0)),
    "LeftFoot": ("LeftLeg", (0, -43, 0)),
    "LeftToeBase": ("LeftFoot", (0, -5, 13)),
    "RightUpLeg": ("Hips", (-10, -8, 1)),
    "RightLeg": ("RightUpLeg", (0, -41, 0)),
    "RightFoot": ("RightLeg", (0, -43, 0)),
    "RightToeBase": ("RightFoot", (0, -5, 13)),
    "LowerBack": ("Hips", (0, 2, 0)),
    "Spine": ("LowerBack", (0, 11, -1)),
    "Spine1": ("Spine", (0, 12, 0)),
    "Neck": ("Spine1", (0, 13, 0)),
    "Head": ("Neck", (0, 10, 1)),
    "LeftShoulder": ("Spine1", (2, 11, 1)),
    "LeftArm": ("LeftShoulder", (16, 1, -1)),
    "LeftForeArm": ("LeftArm", (28, 0, 0)),
    "LeftHand": ("LeftForeArm", (24, 0, 0)),
    "LeftMiddle": ("LeftHand", (9, 0, 0)),
    "LeftThumb": ("LeftHand", (3, 0, 4)),
    "RightShoulder": ("Spine1", (-2, 11, 1)),
    "RightArm": ("RightShoulder", (-16, 1, -1)),
    "RightForeArm": ("RightArm", (-28, 0, 0)),
    "RightHand": ("RightForeArm", (-24, 0, 0)),
    "RightMiddle": ("RightHand", (-9, 0, 0)),
    "RightThumb": ("RightHand", (-3, 0, 4)),
}
ENDS = {
    "LeftToeBase": (0, 0, 6),
    "RightToeBase": (0, 0, 6),
    "Head": (0, 12, 0),
    "LeftThumb": (2, 0, 2),
    "RightThumb": (-2, 0, 2),
}
NAMES = tuple(LIMBS)
OURS = {
    "pelvis": "Hips",
    "left_hip": "LeftUpLeg",
    "left_knee": "LeftLeg",
    "left_ankle": "LeftFoot",
    "left_foot": "LeftToeBase",
    "right_foot": "RightToeBase",
    "left_wrist": "LeftHand",
    "right_wrist": "RightHand",
    "right_hip": "RightUpLeg",
    "right_knee": "RightLeg",
    "right_ankle": "RightFoot",
    "spine1": "LowerBack",
    "spine2": "Spine",
    "spine3": "Spine1",
    "neck": "Neck",
    "head": "Head",
    "left_collar": "LeftShoulder",
    "left_shoulder": "LeftArm",
    "left_elbow": "LeftForeArm",
    "right_collar": "RightShoulder",
    "right_shoulder": "RightArm",
    "right_elbow": "RightForeArm",
}


def quaternions(rotation: Rotation) -> np.ndarray:
    """scipy's rotations as wxyz."""
    return rotation.as_quat()[..., [3, 0, 1, 2]]


def person(frames: int = 20, seed: int = 0) -> Bvh:
    """Random turns of all joints; elbows bend forward and knees backward only."""
    chance = np.random.default_rng(seed)
    rotations = np.empty((frames, len(NAMES), 4))
    for joint, name in enumerate(NAMES):
        if name.endswith("ForeArm"):
            bend = chance.uniform(0.2, 1.8, frames) * (-1 if name.startswith("Left") else 1)
            turn = Rotation.from_rotvec(bend[:, None] * [0, 1, 0])
        elif name.endswith("Leg") and "Up" not in name:
            turn = Rotation.from_rotvec(chance.uniform(0.2, 1.8, frames)[:, None] * [1, 0, 0])
        elif name.endswith(("Thumb", "Middle")):
            turn = Rotation.from_rotvec(np.zeros((frames, 3)))
        else:
            turn = Rotation.from_rotvec(chance.normal(0, 0.4, (frames, 3)))
        rotations[:, joint] = quaternions(turn)
    parents = tuple(NAMES.index(parent) if parent else -1 for parent, _ in LIMBS.values())
    skeleton = BvhSkeleton(
        names=NAMES,
        parents=parents,
        offsets=np.array([offset for _, offset in LIMBS.values()], dtype=float),
        ends={NAMES.index(name): np.array(end, dtype=float) for name, end in ENDS.items()},
        channels=tuple(() for _ in NAMES),
    )
    positions = chance.normal(0, 50, (frames, 3)) + [0, 95, 0]
    return Bvh(skeleton, rotations, {0: positions}, 60.0)


def rezeroed(bvh: Bvh, turns: dict[str, Rotation]) -> Bvh:
    """The same motion on a rig whose zero pose has the named joints turned, globally, by the inverse of `turns`."""
    constant = np.zeros((len(NAMES), 4))
    constant[:, 0] = 1
    for name, turn in turns.items():
        constant[NAMES.index(name)] = quaternions(turn)
    skeleton = bvh.skeleton
    rotations, offsets = bvh.rotations.copy(), skeleton.offsets.copy()
    for joint, parent in enumerate(skeleton.parents):
        above = constant[parent] if parent >= 0 else np.array([1.0, 0, 0, 0])
        offsets[joint] = rotate(inverse(above), offsets[joint])
        rotations[:, joint] = multiply(multiply(inverse(above), rotations[:, joint]), constant[joint])
    ends = {joint: rotate(inverse(constant[joint]), end) for joint, end in skeleton.ends.items()}
    return Bvh(replace(skeleton, offsets=offsets, ends=ends), rotations, bvh.positions, bvh.fps)


def text_of(bvh: Bvh, orders: dict[str, str] | None = None, names: dict[str, str] | None = None) -> str:
    """BVH text with the given order of rotation channels a joint, ZYX where none is given; Euler angles by scipy."""
    skeleton, orders, names = bvh.skeleton, orders or {}, names or {}
    lines, columns = ["HIERARCHY"], [bvh.positions[0]]

    def write(joint: int, depth: int) -> None:
        name, pad = skeleton.names[joint], "\t" * depth
        order = orders.get(name, "ZYX")
        turned = Rotation.from_quat(bvh.rotations[:, joint][:, [1, 2, 3, 0]])
        columns.append(turned.as_euler(order, degrees=True))
        root = skeleton.parents[joint] < 0
        channels = ["Xposition", "Yposition", "Zposition"] * root + [f"{axis}rotation" for axis in order]
        lines.extend(
            [
                f"{pad}{'ROOT' if root else 'JOINT'} {names.get(name, name)}",
                pad + "{",
                f"{pad}\tOFFSET {' '.join(f'{x:.9g}' for x in skeleton.offsets[joint])}",
                f"{pad}\tCHANNELS {len(channels)} {' '.join(channels)}",
            ]
        )
        for child, parent in enumerate(skeleton.parents):
            if parent == joint:
                write(child, depth + 1)
        if joint in skeleton.ends:
            end = " ".join(f"{x:.9g}" for x in skeleton.ends[joint])
            lines.extend([f"{pad}\tEnd Site", pad + "\t{", f"{pad}\t\tOFFSET {end}", pad + "\t}"])
        lines.append(pad + "}")

    write(0, 0)
    lines.extend(["MOTION", f"Frames: {len(bvh.rotations)}", f"Frame Time: {1 / bvh.fps:.7f}"])
    lines.extend(" ".join(f"{x:.7f}" for x in row) for row in np.concatenate(columns, axis=1))
    return "\n".join(lines) + "\n"
