"""Chains around a post with a leg that swings, and their motion by plain NumPy and SciPy."""

import numpy as np
from scipy.spatial.transform import Rotation

from hemline.springs import CapsuleColliders, SkeletonMotion, SpringChains

COUNT, BONES = 6, 5
"""Chains of the sample, and bones of each."""


def ring(count: int = COUNT) -> SpringChains:
    """Chains that hang in a ring of 12 cm around joint 0, 8 cm a bone, a little outwards."""
    bones, outward = [], []
    for angle in 2 * np.pi * np.arange(count) / count:
        away = np.array([np.cos(angle), 0.0, np.sin(angle)])
        bones += [0.12 * away + step * np.array([0.02 * away[0], -0.08, 0.02 * away[2]]) for step in range(BONES)]
        outward.append(away)
    return SpringChains.at_rest(
        np.array(bones), BONES * np.arange(count + 1), np.zeros(count, np.int32), np.array(outward)
    )


def pairs(count: int = COUNT) -> np.ndarray:
    """Bones of neighbouring chains, side by side."""
    return np.array(
        [
            (BONES * chain + step, BONES * ((chain + 1) % count) + step)
            for chain in range(count)
            for step in range(1, BONES)
        ]
    )


def leg() -> CapsuleColliders:
    """A leg that joint 1 carries, down the middle of the ring."""
    at = np.array([[0.0, -0.02, 0.0]])
    return CapsuleColliders(np.array([1]), at, at - [[0.0, 0.4, 0.0]], np.array([0.05]), np.array([-1]))


def kicking(frames: int = 120, angle: float = 0.9) -> SkeletonMotion:
    """Joint 0 walks forwards, and joint 1 at the same place swings a leg."""
    time = np.arange(frames) / 60
    joints = np.zeros((frames, 2, 3))
    joints[:, :, 2] = 0.8 * time[:, None]
    turns = np.tile(np.eye(3), (frames, 2, 1, 1))
    turns[:, 1] = Rotation.from_rotvec(np.outer(-angle * np.sin(5 * time), [1, 0, 0])).as_matrix()
    turns[:, 0] = Rotation.from_rotvec(np.outer(0.3 * np.sin(3 * time), [0, 1, 0])).as_matrix()
    return SkeletonMotion(np.zeros((2, 3)), joints, turns)


def turn_between(start: np.ndarray, end: np.ndarray) -> Rotation:
    """The shortest rotation from one direction to another."""
    axis = np.cross(start, end)
    return Rotation.from_rotvec(axis / max(np.linalg.norm(axis), 1e-12) * np.arctan2(np.linalg.norm(axis), start @ end))


def swing_plainly(chains: SpringChains, capsules: CapsuleColliders, skeleton: SkeletonMotion, dt: float) -> np.ndarray:
    """The bones in each frame, by the words of the specification."""
    tails = np.zeros((len(skeleton.joints), len(chains.bones), 3))
    for frame in range(len(tails)):
        for chain, (span, joint) in enumerate(zip(chains.spans, chains.joints, strict=True)):
            above = Rotation.from_matrix(skeleton.turns[frame, joint])
            head = above.apply(chains.bones[span[0]] - skeleton.rest[joint]) + skeleton.joints[frame, joint]
            tails[frame, span[0]] = head
            for bone in span[1:]:
                way = chains.bones[bone] - chains.bones[bone - 1]
                length = np.linalg.norm(way)
                way = way / length
                tail = head + length * above.apply(way)
                if frame:
                    now, then = tails[frame - 1, bone], tails[max(frame - 2, 0), bone]
                    tail = now + (1 - chains.drag[bone]) * (now - then) + above.apply(way) * chains.stiffness[bone] * dt
                    tail = tail + np.array([0, -1, 0]) * chains.gravity[bone] * dt
                limit = above * _axes(chains, chain, bone, way)
                tail = _limited(chains, bone, limit, head, tail, length)
                for at, owner in enumerate(capsules.chains):
                    if owner not in (-1, chain):
                        continue
                    carrier = capsules.joints[at]
                    turn, rest = skeleton.turns[frame, carrier], skeleton.rest[carrier]
                    start, end = (
                        turn @ (each[at] - rest) + skeleton.joints[frame, carrier]
                        for each in (capsules.starts, capsules.ends)
                    )
                    along = np.clip((tail - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
                    off = tail - start - along * (end - start)
                    missing = capsules.radii[at] + chains.radii[bone] - np.linalg.norm(off)
                    if missing > 0:
                        tail = tail + missing * off / np.linalg.norm(off)
                        tail = _limited(chains, bone, limit, head, tail, length)
                tails[frame, bone] = tail
                above = above * turn_between(way, above.inv().apply((tail - head) / length))
                head = tail
    return tails


def _axes(chains: SpringChains, chain: int, bone: int, way: np.ndarray) -> Rotation:
    frame = Rotation.from_matrix(chains.frames[chain])
    local = frame.inv().apply(way)
    return frame * turn_between(np.array([0.0, 1.0, 0.0]), local) * Rotation.from_rotvec([chains.tilts[bone], 0, 0])


def _limited(chains, bone, limit, head, tail, length) -> np.ndarray:
    x, y, z = limit.inv().apply((tail - head) / np.linalg.norm(tail - head))
    if chains.inward[bone] < np.pi:
        pitch = np.clip(np.arctan2(z, y), -chains.pitches[bone], chains.pitches[bone])
        yaw = np.clip(np.arcsin(np.clip(x, -1, 1)), -chains.yaws[bone], chains.yaws[bone])
        x, y, z = np.sin(yaw), np.cos(yaw) * np.cos(pitch), np.cos(yaw) * np.sin(pitch)
    return head + length * limit.apply([x, y, z])
