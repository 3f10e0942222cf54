"""Makes a body of a rigged character from elsewhere, a GLB or VRM with a skin."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.arrays import Float, Int, Joints
from hemline.bodies.body import Body
from hemline.bodies.model import INFLUENCES
from hemline.errors import BadBody, BadMotion, list_names
from hemline.motions import JOINT_NAMES, PARENTS
from hemline.motions.rigs.gltf_clip import animation_names
from hemline.motions.rigs.gltf_rig import GltfRig, read_rig
from hemline.motions.rigs.t_pose import t_pose_turns
from hemline.motions.rigs.units import METRIC, unit_of

from .character_mesh import read_character_mesh
from .closed_mesh import close_mesh

CHARACTERS = (".glb", ".vrm", ".gltf", ".fbx")
"""Endings of files of rigged characters."""

_HEIGHTS = (0.3, 4.0)
_AT = JOINT_NAMES.index
_SIDES = ("left", "right")


@dataclass(frozen=True, eq=False)
class Character:
    """A character, and how a body is made of it.

    Attributes:
        rig: File and bones of the character.
        owners: Joint of the body that each node of the file follows; -1: none.
        mapped: Node of each joint of the body for which the file has a bone.
        to_body: Transform from the world of the file to that of the body, both at rest: turn, scale to metres, shift.
        joints: Joints of the body at rest, the pelvis at the origin [m].
        notes: What was found, guessed or changed, one sentence each.
    """

    rig: GltfRig
    owners: Int[np.ndarray, " nodes"]
    mapped: dict[str, int]
    to_body: Float[np.ndarray, "4 4"]
    joints: Joints
    notes: tuple[str, ...]


def read_skeleton(
    path: str | Path, *, height: float | None = None, unit: str | None = None, leg_length: float | None = None
) -> Character:
    """Reads the bones of a character, without its mesh.

    Args:
        path: A `.glb`, `.vrm` or `.gltf`.
        height: Target height [m]; None: as it is.
        leg_length: Target length of the legs, hip to knee to ankle [m]; None: as they are.
        unit: `m`, `dm`, `cm`, `mm` or `inch`; None: guessed from the length of the legs.

    Raises:
        BadBody: The file cannot be read, has no skin, is not a humanoid, or does not have the size of a person.
    """
    if height is not None and not _HEIGHTS[0] <= height <= _HEIGHTS[1]:
        raise BadBody("a height must be that of a person in metres", height, f"give {_HEIGHTS[0]} to {_HEIGHTS[1]}")
    rig = read_rig(path, error=BadBody, skinned=True)
    owners, mapped = owners_of(rig)
    places = rig.skeleton.zero_positions
    found = rig.match.joints
    turn, turned = _upright(places, found)
    places = places @ turn.T
    at = {name: places[joint] for name, joint in found.items()}
    leg = float(np.mean([_leg(at, side) for side in _SIDES]))
    if leg_length is not None:
        scale, scale_note = leg_length / leg, f"scaled to legs of {leg_length:.3g} m"
    else:
        scale, scale_note = _scale(rig, turn, leg, height, unit)
    to_body = np.eye(4)
    to_body[:3, :3] = scale * turn
    joints, missing = _joints({name: scale * place for name, place in at.items()}, _ours(rig, scale * places))
    to_body[:3, 3] = -joints[0]
    notes = [rig.how, scale_note]
    if turned:
        notes.append(turned)
    if not rig.in_bind_pose:
        notes.append("the file shows a pose: the pose that its skin was bound in is the rest pose")
    bones = rig.skin_bones
    ours = len(bones & {*mapped.values()})
    notes.append(f"{len(bones)} bones, {ours} of them ours; {len(bones) - ours} others go with the joint above them")
    if missing:
        notes.append(f"no bone for {', '.join(missing)}: put between its neighbours, moves nothing")
    return Character(rig, owners, mapped, to_body, joints - joints[0], tuple(notes))


def read_character(path: str | Path, *, height: float | None = None, unit: str | None = None) -> tuple[Body, Character]:
    """Reads a rigged character as a body, and returns both.

    Its bones are mapped onto the 24 joints of hemline. Weights of other bones (fingers, twists, hair) go to the joint
    above. Each vertex keeps its six largest weights, scaled to sum to 1. The body has no shape coefficients.

    Args:
        path: A `.glb`, `.vrm` or `.gltf`.
        height: Target height [m]; None: as it is.
        unit: `m`, `dm`, `cm`, `mm` or `inch`; None: guessed from the length of the legs.

    Raises:
        BadBody: The file cannot be read, has no skin, is not a humanoid, does not have the size of a person, or has
            weights that are NaN or a mesh that encloses nothing.
    """
    character = read_skeleton(path, height=height, unit=unit)
    mesh = read_character_mesh(character.rig, character.owners)
    moved = mesh.vertices @ character.to_body[:3, :3].T + character.to_body[:3, 3]
    mesh = type(mesh)(moved, mesh.faces, mesh.weights, mesh.parts, mesh.names, mesh.notes)
    closed = close_mesh(mesh, str(path))
    indices, weights = _largest(closed.weights)
    body = Body(
        name=Path(path).stem,
        template=closed.vertices,
        faces=closed.faces,
        shapedirs=np.zeros((0, len(closed.vertices), 3)),
        joints=character.joints,
        joint_shapedirs=np.zeros((0, len(JOINT_NAMES), 3)),
        weight_indices=indices,
        weights=weights,
        parents=np.array(PARENTS),
        rest_offsets=_rest_offsets(character),
        licence=_licence(character.rig),
    )
    heads = list_names(animation_names(character.rig.gltf))
    animation_notes = (f"animations: {heads}",) if heads else ()
    size = f"{np.ptp(closed.vertices[:, 1]):.2f} m tall, {len(closed.vertices)} vertices, {len(closed.faces)} triangles"
    notes = (size, *character.notes, *mesh.notes, *closed.notes, *animation_notes)
    return body, Character(
        character.rig, character.owners, character.mapped, character.to_body, character.joints, notes
    )


def owners_of(rig: GltfRig) -> tuple[np.ndarray, dict[str, int]]:
    """Returns the joint that each node follows, and the node of each joint that has one."""
    mapped = {name: rig.bones[joint] for name, joint in _ours(rig).items()}
    joint_of = {node: _AT(name) for name, node in mapped.items()}
    owners = np.full(len(rig.nodes.names), -1)
    bones, thumbs = set(rig.bones), {rig.bones[joint] for joint in rig.match.thumbs.values()}
    hands = {mapped[f"{side}_wrist"]: _AT(f"{side}_hand") for side in _SIDES if f"{side}_hand" in mapped}
    for node in rig.nodes.order:
        parent = rig.nodes.parents[node]
        if node in joint_of:
            owners[node] = joint_of[node]
        elif parent in hands and node not in thumbs:
            owners[node] = hands[parent]
        elif parent >= 0:
            owners[node] = owners[parent]
        if owners[node] < 0 and node in bones:
            owners[node] = _AT("pelvis")
    return owners, mapped


def _ours(rig: GltfRig, places: np.ndarray | None = None) -> dict:
    """Returns the bone of each joint, with those of spine and hands; or their positions, if `places` are given."""
    joints, spine = dict(rig.match.joints), rig.match.spine
    count, above = len(spine), len(spine) + 1
    for level in (3, 2, 1):
        place = round(level * count / 3)
        if 1 <= place < above:
            joints[f"spine{level}"], above = spine[place - 1], place
    for side, middle in rig.match.middles.items():
        joints[f"{side}_hand"] = middle
    return joints if places is None else {name: places[joint] for name, joint in joints.items()}


def _joints(found: dict[str, np.ndarray], ours: dict[str, np.ndarray]) -> tuple[np.ndarray, list[str]]:
    """Returns the positions of the 24 joints, and the names of those that the rig has no bone for.

    The pelvis is midway between the hips, as in clips.
    """
    at = dict(ours)
    at["pelvis"] = (found["left_hip"] + found["right_hip"]) / 2
    missing = [name for name in JOINT_NAMES if name not in at]
    for level in (1, 2):
        if f"spine{level}" not in at:
            below = at["pelvis"] if level == 1 else at["spine1"]
            upper = 3 if f"spine{level + 1}" not in at else level + 1
            at[f"spine{level}"] = below + (at[f"spine{upper}"] - below) / (upper - level + 1)
    at.setdefault("neck", at["spine3"] + 0.6 * (at["head"] - at["spine3"]))
    for side in _SIDES:
        at.setdefault(f"{side}_collar", 0.5 * (at["spine3"] + at[f"{side}_shoulder"]))
        ankle, arm = at[f"{side}_ankle"], at[f"{side}_wrist"] - at[f"{side}_elbow"]
        at.setdefault(f"{side}_foot", ankle + np.array([0, -0.06, 0.15]) * _leg(at, side))
        at.setdefault(f"{side}_hand", at[f"{side}_wrist"] + 0.35 * arm)
    return np.array([at[name] for name in JOINT_NAMES]), missing


def _upright(places: np.ndarray, found: dict[str, int]) -> tuple[np.ndarray, str]:
    """Returns the quarter turns after which y is up and the left is along +x, and a note about them."""
    up = _axis(places[found["head"]] - places[found["left_hip"]])
    left = _axis((places[found["left_hip"]] - places[found["right_hip"]]) * (np.abs(up) < 0.5))
    turn = np.stack([left, up, np.cross(left, up)])
    if np.abs(turn - np.eye(3)).max() < 1e-6:
        return turn, ""
    ahead = np.cross(left, up)
    return turn, f"{_axis_name(up)} up, facing {_axis_name(ahead)}: turned to y up, facing z"


def _axis(direction: np.ndarray) -> np.ndarray:
    axis, best = np.zeros(3), int(np.argmax(np.abs(direction)))
    axis[best] = np.sign(direction[best]) or 1
    return axis


def _axis_name(axis: np.ndarray) -> str:
    best = int(np.argmax(np.abs(axis)))
    return ("-" if axis[best] < 0 else "") + "xyz"[best]


def _leg(at: dict[str, np.ndarray], side: str) -> float:
    hip, knee, ankle = (at[f"{side}_{name}"] for name in ("hip", "knee", "ankle"))
    return float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))


def _scale(rig: GltfRig, turn: np.ndarray, leg: float, height: float | None, unit: str | None) -> tuple[float, str]:
    """Returns the size of the file's unit [m], and a note that says how it was found."""
    path = rig.gltf.path
    if height is not None and unit is not None:
        raise BadBody("height and unit exclude each other", f"{height:g} m and '{unit}'", "give one of them")
    if height is not None:
        mesh = read_character_mesh(rig, np.zeros(len(rig.nodes.names), int))
        scale = height / float(np.ptp((mesh.vertices @ turn.T)[:, 1]))
        return scale, f"scaled by {scale:.4g} to be {height:g} m tall"
    try:
        unit, note = unit_of(leg, unit, path.name, units=METRIC)
    except BadMotion as reason:
        cure = f"{reason.cure}, or say how tall it is with --height"
        raise BadBody(reason.what, reason.got, cure) from reason
    return METRIC[unit], note


def _rest_offsets(character: Character) -> np.ndarray:
    """Returns global rotations from the rest pose to the T-pose, of joints for which the character has a bone."""
    there = {name: character.joints[_AT(name)] for name in character.rig.match.joints}
    turns = t_pose_turns(there)
    offsets = np.tile([1.0, 0, 0, 0], (len(JOINT_NAMES), 1))
    for name, turn in turns.items():
        offsets[_AT(name)] = turn
    for side in _SIDES:
        offsets[_AT(f"{side}_hand")] = turns[f"{side}_wrist"]
    return offsets


def _largest(weights: Float[np.ndarray, "verts joints"]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the `INFLUENCES` joints of each vertex with the largest weights, strongest first, scaled to sum to 1."""
    order = np.argsort(-weights, axis=1, kind="stable")[:, :INFLUENCES]
    largest = np.take_along_axis(weights, order, axis=1)
    return np.where(largest > 0, order, 0), largest / largest.sum(axis=1, keepdims=True)


def _licence(rig: GltfRig) -> str:
    """Returns the terms that the file states."""
    document, extensions = rig.gltf.document, rig.gltf.extensions
    terms = [str(document["asset"].get("copyright") or "")]
    for name, keys in (("VRMC_vrm", ("name", "authors", "licenseUrl")), ("VRM", ("title", "author", "licenseName"))):
        meta = extensions.get(name, {}).get("meta", {}) if isinstance(extensions.get(name), dict) else {}
        terms += [f"{key}: {meta[key]}" for key in keys if meta.get(key)]
    text = "; ".join(line for line in terms if line)
    return text[:500] or f"as {rig.gltf.path.name} has it; its makers' terms hold"
