"""Clips to export: a sheet that sways, over a body that bends."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from hemline.export import Clip, ClipSkeleton

FRAMES, FPS = 7, 24.0


def sheet():
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 9), np.linspace(0.4, 1.2, 11))
    corner = (np.arange(10)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + 10], 1), np.stack([corner, corner + 10, corner + 9], 1)]
    )
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, -0.25)], axis=1), faces.astype(np.int32)


def swaying():
    rest, faces = sheet()
    time = np.arange(FRAMES)[:, None] / FPS
    frames = np.repeat(rest[None], FRAMES, axis=0)
    frames[..., 2] += 0.3 * (1.2 - rest[:, 1]) * np.sin(9 * time) + 0.05 * np.cos(14 * rest[:, 0])
    frames[..., 0] += 0.4 * time
    return frames.astype(np.float32), faces


def bending():
    """A tube on three joints that bends, walks on and is skinned with six influences a vertex."""
    mesh = trimesh.creation.capsule(height=1.0, radius=0.12, count=[12, 24])
    vertices = (np.array(mesh.vertices)[:, [0, 2, 1]] * [1, 1, -1] + [0, 0.5, 0]).astype(np.float32)
    joints = np.array([[0, 0.1, 0], [0, 0.5, 0.02], [0, 0.9, 0], [0, 1.1, 0], [0, 0.3, 0.05]], np.float32)
    parents = np.array([-1, 0, 1, 2, 0], np.int32)
    near = np.exp(-((vertices[:, None, 1] - joints[None, :, 1]) ** 2) / 0.02) + 1e-3
    weights = np.concatenate([near, np.zeros((len(vertices), 1))], axis=1).astype(np.float32)
    weights /= weights.sum(axis=1, keepdims=True)
    indices = np.tile(np.array([0, 1, 2, 3, 4, 0], np.int32), (len(vertices), 1))
    transforms = chained(joints, parents)
    homogeneous = np.concatenate([vertices, np.ones((len(vertices), 1), np.float32)], axis=1)
    posed = np.einsum("fjrc,vc,vj->fvr", transforms, homogeneous, near_weights(indices, weights, len(joints)))
    skeleton = ClipSkeleton(joints, parents, transforms.astype(np.float32), vertices, indices, weights, tuple("abcde"))
    return posed.astype(np.float32), np.array(mesh.faces, np.int32), skeleton


def near_weights(indices, weights, joint_count):
    dense = np.zeros((len(indices), joint_count))
    np.add.at(dense, (np.arange(len(indices))[:, None], indices), weights)
    return dense


def chained(joints, parents):
    from scipy.spatial.transform import Rotation

    local = np.random.default_rng(0).normal(size=(len(joints), 3)) * 0.5
    turns, places = np.zeros((FRAMES, len(joints), 3, 3)), np.zeros((FRAMES, len(joints), 3))
    for frame in range(FRAMES):
        for joint, parent in enumerate(parents):
            turn = Rotation.from_rotvec(local[joint] * np.sin(0.8 * frame + joint)).as_matrix()
            if parent < 0:
                turns[frame, joint], places[frame, joint] = turn, joints[joint] + [0.1 * frame, 0.02 * frame, 0]
                continue
            turns[frame, joint] = turns[frame, parent] @ turn
            places[frame, joint] = places[frame, parent] + turns[frame, parent] @ (joints[joint] - joints[parent])
    shifts = places - np.einsum("fjrc,jc->fjr", turns, joints)
    return np.concatenate([turns, shifts[..., None]], axis=-1)


@pytest.fixture
def cloth_clip():
    vertices, faces = swaying()
    return Clip(vertices, faces, FPS, name="cape")


@pytest.fixture
def far_clip(cloth_clip):
    """A clip that runs 40 m, over which 16 bits have steps of 0.6 mm."""
    path = np.linspace([0, 0, 0], [3, 1, 40], cloth_clip.frame_count).astype(np.float32)
    return replace(cloth_clip, vertices=cloth_clip.vertices + path[:, None])


@pytest.fixture
def full_clip():
    vertices, faces = swaying()
    body, body_faces, skeleton = bending()
    notices = ("Body: CC0 1.0", "Motion: mocap.cs.cmu.edu,\nNSF EIA-0196217")
    return Clip(vertices, faces, FPS, body, body_faces, "red cape", notices=notices, skeleton=skeleton)
