"""Rigged characters made of the shipped body by script: other names, unit, axes, more bones, other meshes, any pose."""

import functools
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from hemline import bodies
from hemline.export.glb.glb_buffer import Buffer
from hemline.export.glb.glb_document import pack_glb
from hemline.meshes import coarsen
from hemline.motions import JOINT_NAMES, PARENTS

MIXAMO = {"pelvis": "Hips", "spine1": "Spine", "spine2": "Spine1", "spine3": "Spine2", "neck": "Neck", "head": "Head"}
SMPL = {"pelvis": "Pelvis", "spine1": "Spine1", "spine2": "Spine2", "spine3": "Spine3", "neck": "Neck", "head": "Head"}
UNREAL = {"pelvis": "pelvis", "spine1": "spine_01", "spine2": "spine_02", "spine3": "spine_03"}
UNREAL |= {"neck": "neck_01", "head": "head"}
RIGIFY = {"pelvis": "spine", "spine1": "spine.001", "spine2": "spine.002", "spine3": "spine.003"}
RIGIFY |= {"neck": "spine.004", "head": "head"}
MAKEHUMAN = {"pelvis": "root", "spine1": "spine05", "spine2": "spine03", "spine3": "spine01"}
MAKEHUMAN |= {"neck": "neck01", "head": "head"}
UNITY = {"pelvis": "Hips", "spine1": "Spine", "spine2": "Chest", "spine3": "UpperChest", "neck": "Neck", "head": "Head"}
_LIMBS = ("collar", "shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle", "foot")


def _sided(trunk: Mapping[str, str], pattern: str, words: str, left: str, right: str) -> dict[str, str]:
    limbs = dict(zip(_LIMBS, words.split(), strict=True))
    sides = {"left": left, "right": right}
    return dict(trunk) | {
        f"{s}_{k}": pattern.format(side=w, part=v) for s, w in sides.items() for k, v in limbs.items()
    }


CUSTOMS = {
    "mixamo": _sided(
        {k: f"mixamorig:{v}" for k, v in MIXAMO.items()},
        "mixamorig:{side}{part}",
        "Shoulder Arm ForeArm Hand HandMiddle1 UpLeg Leg Foot ToeBase",
        "Left",
        "Right",
    ),
    "smpl": _sided(SMPL, "{side}_{part}", "Collar Shoulder Elbow Wrist Hand Hip Knee Ankle Foot", "L", "R"),
    "unreal": _sided(
        UNREAL, "{part}_{side}", "clavicle upperarm lowerarm hand middle_01 thigh calf foot ball", "l", "r"
    ),
    "rigify": _sided(
        {k: f"DEF-{v}" for k, v in RIGIFY.items()},
        "DEF-{part}.{side}",
        "shoulder upper_arm forearm hand f_middle.01 thigh shin foot toe",
        "L",
        "R",
    ),
    "makehuman": _sided(
        MAKEHUMAN,
        "{part}.{side}",
        "clavicle upperarm01 lowerarm01 wrist finger3-1 upperleg01 lowerleg01 foot toe1-1",
        "L",
        "R",
    ),
    "unity": _sided(
        UNITY,
        "{side}{part}",
        "Shoulder UpperArm LowerArm Hand MiddleProximal UpperLeg LowerLeg Foot Toes",
        "Left",
        "Right",
    ),
    "nameless": {name: f"Bone.{number:03d}" for number, name in enumerate(JOINT_NAMES)},
}
"""What rigs call our joints, by custom."""


@functools.cache
def small_body() -> bodies.Body:
    """The shipped body with 3,000 of its vertices, without shapes."""
    full = bodies.load()
    fewer = coarsen(full.template, full.faces, 3000)
    return replace(
        full,
        template=full.template[fewer.kept],
        faces=fewer.faces,
        shapedirs=np.zeros((0, len(fewer.kept), 3)),
        joint_shapedirs=np.zeros((0, 24, 3)),
        weight_indices=full.weight_indices[fewer.kept],
        weights=full.weights[fewer.kept],
    )


def in_proportion(sizes: Mapping[str, float]) -> bodies.Body:
    """The shipped body with the bones and the flesh of each joint scaled.

    Args:
        sizes: Scale by a part of the joint's name; that of "" holds for all others.
    """
    full = bodies.load()
    scale = np.array(
        [next((sizes[part] for part in sizes if part and part in name), sizes[""]) for name in JOINT_NAMES]
    )
    joints = full.joints.astype(np.float64)
    moved = joints.copy()
    for joint, above in enumerate(PARENTS[1:], 1):
        moved[joint] = moved[above] + scale[above] * (joints[joint] - joints[above])
    dense = np.zeros((len(full.template), len(JOINT_NAMES)))
    np.add.at(dense, (np.arange(len(dense))[:, None], full.weight_indices), full.weights)
    of_each = moved + scale[:, None] * (full.template[:, None] - joints)
    return replace(
        full,
        template=np.einsum("vj,vjc->vc", dense, of_each),
        joints=moved,
        shapedirs=np.zeros((0, len(full.template), 3)),
        joint_shapedirs=np.zeros((0, 24, 3)),
    )


@functools.cache
def child() -> bodies.Body:
    """A body of 1.16 m with a child's proportions."""
    limbs = {"hip": 0.62, "knee": 0.6, "ankle": 0.7, "foot": 0.7, "shoulder": 0.62, "elbow": 0.62, "collar": 0.68}
    return in_proportion({"head": 0.95, "neck": 0.75, **limbs, "": 0.7})


@functools.cache
def cartoon() -> bodies.Body:
    """A body with a head, hands and feet that are far too large."""
    large = {"head": 2.2, "ankle": 1.3, "foot": 1.3, "wrist": 1.3, "hand": 1.3}
    return in_proportion({**large, "neck": 0.7, "shoulder": 0.75, "elbow": 0.75, "": 0.85})


@dataclass(frozen=True)
class Sample:
    """How a character is made.

    Attributes:
        names: Its bones by our joint; joints that are not there are merged into those above.
        scale: The unit of its positions is so many to a metre.
        z_up: Whether z is up and it faces -y.
        armature: Scale of the node above all bones; positions are divided by it.
        turned: Whether the bones' own axes are turned at random, as in real files.
        extra: Twist bones added to each limb bone, which take half of its weights.
        loose: Bones that move nothing, hung from the head, in chains of ten.
        pose: Rotations about own axes of bones, by joint, in which the file shows it, as rotation vectors [rad].
        parts: What the triangles are cut into: names of meshes, by the centre of each triangle (x, y, z).
        vrm: 1 or 0: a map of humanoid bones as VRM 1.0 or 0.x has it.
        clips: Animations by name: times [s] and rotations (frames, 24, 4) wxyz of the joints against their rest, in the
            axes of the file.
        weights: What is done to the weights before they are written.
        body: The body that it is made of.
    """

    names: Mapping[str, str] = field(default_factory=lambda: CUSTOMS["mixamo"])
    scale: float = 1.0
    z_up: bool = False
    armature: float = 1.0
    turned: bool = True
    extra: int = 0
    loose: int = 0
    pose: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    parts: Callable[[np.ndarray], np.ndarray] | None = None
    vrm: int | None = None
    clips: Mapping[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    weights: Callable[[np.ndarray], np.ndarray] = lambda weights: weights
    body: bodies.Body = field(default_factory=small_body)


def write_character(path: Path, sample: Sample) -> Path:
    """Write the shipped body as somebody else's character."""
    body = sample.body
    turn = Rotation.from_euler("x", 90, degrees=True).as_matrix() if sample.z_up else np.eye(3)
    unit = sample.scale / sample.armature
    joints, vertices = unit * body.joints @ turn.T, unit * (body.template + [0, 0.9, 0]) @ turn.T
    joints = joints + unit * np.array([0, 0.9, 0]) @ turn.T
    owner, ours = _owners(sample.names)
    dense = np.zeros((len(vertices), len(JOINT_NAMES)))
    np.add.at(dense, (np.arange(len(vertices))[:, None], np.array(owner)[body.weight_indices]), body.weights)
    bones, parents, places, columns = [], [], [], []
    at = {}
    for joint in ours:
        at[joint] = len(bones)
        above = PARENTS[joint]
        while above >= 0 and owner[above] != above:
            above = PARENTS[above]
        bones.append(sample.names[JOINT_NAMES[joint]])
        parents.append(at[above] if above >= 0 else -1)
        places.append(joints[joint])
        columns.append(dense[:, joint])
    for joint in ours:
        if JOINT_NAMES[joint].split("_")[-1] in ("shoulder", "elbow", "hip", "knee"):
            for number in range(sample.extra):
                share = columns[at[joint]] / 2
                columns[at[joint]] = columns[at[joint]] - share
                bones.append(f"{bones[at[joint]]}_twist_{number:02d}")
                parents.append(at[joint])
                places.append(joints[joint] * 0.5 + joints[JOINT_NAMES.index(_below(JOINT_NAMES[joint]))] * 0.5)
                columns.append(share)
    for number in range(sample.loose):
        head = at[JOINT_NAMES.index("head")]
        parents.append(len(bones) - 1 if number % 10 else head)
        places.append(places[parents[-1]] + unit * turn @ np.array([0.01 * (number % 7 - 3), 0.02, -0.01]))
        bones.append(f"hair_{number:03d}")
        columns.append(np.zeros(len(vertices)))
    content = _document(sample, body, bones, parents, np.array(places), vertices, np.stack(columns, 1), at)
    if path.suffix == ".gltf":
        import base64

        document, binary = content
        uri = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
        document["buffers"][0]["uri"] = uri
        path.write_text(json.dumps(document))
    else:
        path.write_bytes(pack_glb(*content))
    return path


def _below(name: str) -> str:
    after = {"shoulder": "elbow", "elbow": "wrist", "hip": "knee", "knee": "ankle"}
    side, _, part = name.partition("_")
    return f"{side}_{after[part]}"


def _owners(names: Mapping[str, str]) -> tuple[list[int], list[int]]:
    """The joint that each of the 24 goes with, and those that are there."""
    owner: list[int] = []
    for joint, name in enumerate(JOINT_NAMES):
        owner.append(joint if name in names else owner[PARENTS[joint]])
    return owner, [joint for joint in range(len(JOINT_NAMES)) if owner[joint] == joint]


def _document(sample, body, bones, parents, places, vertices, weights, at):
    random, buffer, count = np.random.default_rng(3), Buffer(), len(bones)
    axes = Rotation.random(count, random_state=random) if sample.turned else Rotation.identity(count)
    axes = axes.as_matrix()
    rest = np.tile(np.eye(4), (count, 1, 1))
    rest[:, :3, :3], rest[:, :3, 3] = axes, places
    shown = {at[JOINT_NAMES.index(name)]: Rotation.from_rotvec(turn).as_matrix() for name, turn in sample.pose.items()}
    nodes = [{"name": "Armature", "scale": [sample.armature] * 3, "children": []}]
    for bone, parent in enumerate(parents):
        local = np.linalg.inv(rest[parent]) @ rest[bone] if parent >= 0 else rest[bone]
        turned = local[:3, :3] @ axes[bone].T @ shown.get(bone, np.eye(3)) @ axes[bone]
        node = {"name": bones[bone], "translation": local[:3, 3].tolist()}
        nodes.append(node | {"rotation": Rotation.from_matrix(turned).as_quat().tolist()})
        nodes[parent + 1].setdefault("children", []).append(bone + 1)
    inverse = np.linalg.inv(rest).swapaxes(1, 2).reshape(-1, 16).astype(np.float32)
    document = {
        "asset": {"version": "2.0", "copyright": "CC0, made for a test"},
        "scene": 0,
        "nodes": nodes,
        "meshes": [],
        "skins": [{"inverseBindMatrices": buffer.add(inverse, "MAT4"), "joints": list(range(1, count + 1))}],
    }
    order = np.argsort(-weights, axis=1, kind="stable")[:, :8]
    kept = sample.weights(np.take_along_axis(weights, order, axis=1).astype(np.float32))
    attributes = {"POSITION": buffer.add_attribute(vertices.astype(np.float32), "VEC3", bounds=True)}
    for four in range(2):
        part = slice(4 * four, 4 * four + 4)
        attributes[f"JOINTS_{four}"] = buffer.add_numbers(order[:, part].astype(np.uint16), "VEC4")
        attributes[f"WEIGHTS_{four}"] = buffer.add_attribute(kept[:, part], "VEC4")
    centres = body.template[body.faces].mean(axis=1)
    labels = sample.parts(centres) if sample.parts else np.full(len(centres), "Body")
    for name in np.unique(labels[labels != ""]):
        primitive = {"attributes": attributes, "indices": buffer.add_indices(body.faces[labels == name])}
        document["nodes"].append({"name": str(name), "mesh": len(document["meshes"]), "skin": 0})
        document["meshes"].append({"name": str(name), "primitives": [primitive]})
    document["scenes"] = [{"nodes": [0, *range(count + 1, len(document["nodes"]))]}]
    if sample.clips:
        document["animations"] = [
            _animation(buffer, name, *clip, rest, parents, axes, at) for name, clip in sample.clips.items()
        ]
    if sample.vrm is not None:
        document["extensions"] = _vrm(sample.vrm, at)
        document["extensionsUsed"] = list(document["extensions"])
    return document | buffer.entries(), buffer.content()


def _animation(buffer, name, times, rotations, rest, parents, axes, at):
    """Each bone turned by its rotation about its own joint, in the frame of its parent's rest axes."""
    at_times = buffer.add(times.astype(np.float32), "SCALAR", bounds=True)
    channels, samplers = [], []
    for joint, bone in at.items():
        parent = parents[bone]
        above = axes[parent] if parent >= 0 else np.eye(3)
        turn = Rotation.from_quat(rotations[:, joint][:, [1, 2, 3, 0]]).as_matrix()
        local = Rotation.from_matrix(above.T @ turn @ axes[bone]).as_quat()
        channels.append({"sampler": len(samplers), "target": {"node": bone + 1, "path": "rotation"}})
        samplers.append({"input": at_times, "output": buffer.add(local.astype(np.float32), "VEC4")})
    return {"name": name, "channels": channels, "samplers": samplers}


def _vrm(version, at):
    from hemline.export.vrm.vrm_humanoid import VRM_BONES

    nodes = {VRM_BONES[JOINT_NAMES[joint]]: bone + 1 for joint, bone in at.items() if JOINT_NAMES[joint] in VRM_BONES}
    if version == 1:
        bones = {name: {"node": node} for name, node in nodes.items()}
        meta = {"name": "Test", "authors": ["nobody"], "licenseUrl": "https://vrm.dev/licenses/1.0/"}
        return {"VRMC_vrm": {"specVersion": "1.0", "meta": meta, "humanoid": {"humanBones": bones}}}
    bones = [{"bone": name, "node": node} for name, node in nodes.items()]
    return {"VRM": {"meta": {"title": "Test", "author": "nobody"}, "humanoid": {"humanBones": bones}}}
