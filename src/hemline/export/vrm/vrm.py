"""VRM 1.0: a GLB file with a humanoid, its licence, and spring bones."""

from pathlib import Path

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadOutput
from hemline.export.character import BoundMesh, DressedCharacter, bone_names
from hemline.export.glb.glb_buffer import Buffer
from hemline.export.glb.glb_document import asset, material, pack_glb
from hemline.export.shading import unit_normals
from hemline.files import atomic_write, check_writable

from .vrm_humanoid import humanoid, meta
from .vrm_springs import LIMIT, is_limited, springs

VRM_ENDING = ".vrm"


def write_vrm(path: str | Path, character: DressedCharacter) -> tuple[Path, ...]:
    """Writes a character as VRM 1.0, whole or not at all.

    Args:
        path: The file to write; it ends in `.vrm`.
        character: The character.

    Raises:
        BadOutput: The path has another ending, or cannot be written.

    Format: https://github.com/vrm-c/vrm-specification, `VRMC_vrm` and `VRMC_springBone` 1.0.
    """
    path = Path(path)
    check_character_path(path)
    content = vrm_bytes(character)
    with atomic_write(path) as temporary:
        temporary.write_bytes(content)
    return (path,)


def check_character_path(path: str | Path) -> None:
    """Refuses a path that `write_vrm` could not write, before any work is done.

    Raises:
        BadOutput: The path has another ending, or the folder cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != VRM_ENDING:
        raise BadOutput(f"a character is written as {VRM_ENDING}", path.name, f"name it {path.stem}{VRM_ENDING}")
    check_writable(path)


def vrm_bytes(character: DressedCharacter) -> bytes:
    """Returns the bytes that `write_vrm` writes."""
    buffer = Buffer()
    nodes, first = _bone_nodes(character)
    document = {
        "asset": asset(character.notices),
        "extensionsUsed": ["VRMC_vrm", "VRMC_springBone", *([LIMIT] if is_limited(character.chains) else [])],
        "extensions": {
            "VRMC_vrm": {
                "specVersion": "1.0",
                "meta": meta(character.name, character.notices),
                "humanoid": {"humanBones": humanoid(character.joint_names, first)},
            },
            "VRMC_springBone": springs(character, first),
        },
        "scene": 0,
        "scenes": [{"nodes": [0, *range(len(nodes), len(nodes) + len(character.meshes))]}],
        "nodes": nodes,
        "meshes": [],
        "materials": [],
        "skins": [],
    }
    axes = _axes(character)
    for mesh in character.meshes:
        _add_mesh(document, buffer, mesh, axes, first)
    return pack_glb(document | buffer.entries(), buffer.content())


def _axes(character: DressedCharacter) -> Float[np.ndarray, "bones 3 3"]:
    """Returns the axes of each bone at rest, as columns: those of the world for joints, of its chain for the others."""
    chains = character.chains
    joints = np.tile(np.eye(3), (len(character.joints), 1, 1))
    return np.concatenate([joints, np.repeat(chains.frames, np.diff(chains.offsets), axis=0)])


def _bone_nodes(character: DressedCharacter) -> tuple[list[dict], int]:
    """Returns the nodes (one on the floor, the joints, the chains) and the number of the first joint.

    Joints are not rotated. The axis y of the bones of a chain points down and z outwards, since the limits of
    `VRMC_springBone_limit` are unstable for bones that point along their own -y.
    """
    from scipy.spatial.transform import Rotation

    chains, joint_count = character.chains, len(character.joints)
    places = np.concatenate([character.joints, chains.bones]).astype(np.float64)
    parents = np.concatenate([character.parents, np.arange(len(chains.bones)) + joint_count - 1])
    parents[joint_count + chains.offsets[:-1]] = chains.joints
    axes = _axes(character)
    at = places - np.where(parents[:, None] >= 0, places[parents], 0)
    swinging = parents >= joint_count
    at[swinging] = np.einsum("bji,bj->bi", axes[swinging], at[swinging])
    nodes: list[dict] = [{"name": f"{character.name} character", "children": []}]
    for name, place, parent in zip(bone_names(character), at.tolist(), parents.tolist(), strict=True):
        nodes[parent + 1].setdefault("children", []).append(len(nodes))
        nodes.append({"name": name, "translation": place})
    turns = Rotation.from_matrix(chains.frames).as_quat().tolist()
    for root, turn in zip((chains.offsets[:-1] + joint_count + 1).tolist(), turns, strict=True):
        nodes[root]["rotation"] = turn
    return nodes, 1


def _add_mesh(
    document: dict, buffer: Buffer, mesh: BoundMesh, axes: Float[np.ndarray, "bones 3 3"], first: int
) -> None:
    count = len(mesh.binds)
    joints = list(range(first, first + count))
    binds = np.tile(np.eye(4), (count, 1, 1))
    binds[:, :3] = np.swapaxes(axes[:count], 1, 2) @ mesh.binds
    columns = np.swapaxes(binds, 1, 2).reshape(-1, 16).astype(np.float32)
    document["skins"].append({"inverseBindMatrices": buffer.add(columns, "MAT4"), "joints": joints})
    vertices = np.asarray(mesh.vertices, np.float32)
    bones = np.where(mesh.weights > 0, mesh.bones, 0)
    primitive = {
        "attributes": {
            "POSITION": buffer.add_attribute(vertices, "VEC3", bounds=True),
            "NORMAL": buffer.add_attribute(unit_normals(vertices, mesh.faces), "VEC3"),
            "JOINTS_0": buffer.add_numbers(bones.astype(np.uint16), "VEC4"),
            "WEIGHTS_0": buffer.add_attribute(mesh.weights.astype(np.float32), "VEC4"),
        },
        "indices": buffer.add_indices(mesh.faces),
        "material": len(document["materials"]),
    }
    number = len(document["meshes"])
    document["nodes"].append({"name": mesh.name, "mesh": number, "skin": number})
    document["materials"].append(material(mesh.name, mesh.colour, both_sides=mesh.name != "body"))
    document["meshes"].append({"name": mesh.name, "primitives": [primitive]})
