"""Reads animations of glTF files as motions: those of Mixamo, VRM or any other humanoid rig."""

from pathlib import Path

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadMotion, list_names
from hemline.files.gltf import SCENES, Gltf
from hemline.files.gltf_nodes import Nodes, matrices
from hemline.motions.bvh import Bvh
from hemline.motions.quaternions import from_matrix, inverse, multiply, rotate, slerp

from .gltf_rig import LARGEST, GltfRig, read_rig
from .retarget import Retargeted, retarget_beside

_RATES = (5.0, 120.0)
_USUAL_RATE = 30.0
_FRAMES_MAX = 200_000
_POSES_UNCHECKED = 200_000
"""Number of node poses up to which the size of the file is not checked."""
_POSE_BYTES = 8
"""Least number of bytes in the file for each further pose of a node, as its keys take them."""


def split_name(path: str | Path) -> tuple[Path, str | None]:
    """Splits `FILE` or `FILE:NAME`, at the first colon after a known ending, into file and name of an animation."""
    text = str(path)
    for place, letter in enumerate(text):
        if letter == ":" and Path(text[:place]).suffix.lower() in SCENES:
            return Path(text[:place]), text[place + 1 :]
    return Path(path), None


def read_gltf_motion(path: str | Path, *, up: str | None = None) -> Retargeted:
    """Reads an animation of a GLB, VRM or glTF file.

    Rotations of bones are relative to their rest pose: the bind pose of the skin, or else the pose of the nodes.

    Args:
        path: `FILE`, if it holds one animation, or `FILE:NAME`; a number as NAME counts animations from 0.
        up: The axis that is up in it; None: found.

    Raises:
        BadMotion: The file cannot be read, or has no humanoid, no animation, several, none of that name, or far more
            frames than a file of its size can have keys for.
    """
    file, name = split_name(path)
    rig = read_rig(file, error=BadMotion, skinned=False)
    animation = _choose_animation(rig.gltf, file, name)
    with rig.gltf.readable():
        times, tracks = _tracks(rig.gltf, animation, len(rig.nodes.names))
    fps, moments = _moments(times, file)
    poses = len(moments) * len(rig.nodes.names)
    if poses > _POSES_UNCHECKED + rig.gltf.number_limit // _POSE_BYTES:
        got = f"{len(moments)} frames of {len(rig.nodes.names)} nodes in a file of {file.stat().st_size} bytes"
        raise BadMotion(f"{file}: the animation is too long for its few keys", got, "cut it, or key each frame")
    with rig.gltf.readable(), np.errstate(all="ignore"):
        world = _pose_nodes(rig.nodes, tracks, moments)
        if not (np.abs(world) < LARGEST).all():
            raise ValueError("keys")
        turned = _bone_motion(rig, world)
    title = str(animation.get("name") or file.stem)
    rigged = Bvh(rig.skeleton, *turned, fps)
    copyright_ = str(rig.gltf.document["asset"].get("copyright", ""))
    source = f"{file.name}, animation '{title}'"
    found, licence = rig.match, copyright_[:500]
    return retarget_beside(
        rigged, up=up, name=title, source=source, licence=licence, match=found, resting=True, file=file.name
    )


def animation_names(gltf: Gltf) -> list[str]:
    """Returns the names of the animations of a file; an animation without a name gets its number."""
    return [str(each.get("name") or number) for number, each in enumerate(gltf.all("animations"))]


def _choose_animation(gltf: Gltf, file: Path, name: str | None) -> dict:
    with gltf.readable():
        names, animations = animation_names(gltf), gltf.all("animations")
    if not animations:
        raise BadMotion(f"{file} has no animation", "none", "name a file with one, or a .bvh")
    twice = len(set(names)) < len(names)  # numbers tell equal names apart
    listed = [f"{number} '{each[:60]}'" if twice else each[:60] for number, each in enumerate(names)]
    shown = list_names(listed)
    first = "0" if twice else names[0]
    if name is None:
        if len(animations) > 1:
            raise BadMotion(f"{file} has {len(animations)} animations", shown, f"name one: {file}:{first}")
        return animations[0]
    if names.count(name) > 1:
        raise BadMotion(f"{file} has {names.count(name)} animations '{name}'", shown, f"number one: {file}:{first}")
    if name in names:
        return animations[names.index(name)]
    if name.isdecimal() and int(name) < len(animations):
        return animations[int(name)]
    raise BadMotion(f"{file} has no animation '{name}'", shown, f"name one of them: {file}:{first}")


class _Track:
    """Translation, rotation or scale of a node over time."""

    def __init__(self, times: np.ndarray, values: np.ndarray, interpolation: str, width: int) -> None:
        cubic = interpolation == "CUBICSPLINE"
        count = len(times)
        if not count or values.size != count * width * (3 if cubic else 1) or (np.diff(times) < 0).any():
            raise ValueError("keys")
        if not (np.isfinite(times).all() and np.isfinite(values).all()):
            raise ValueError("keys")
        self.times, self.interpolation, self.turns = times, interpolation, width == 4
        self.values = values.reshape(count, 3, width) if cubic else values.reshape(count, 1, width)

    def at(self, moments: np.ndarray) -> np.ndarray:
        """Returns the values at given moments, interpolated as the format defines [s]."""
        after = np.clip(np.searchsorted(self.times, moments, "right"), 1, max(len(self.times) - 1, 1))
        before, after = np.minimum(after - 1, len(self.times) - 1), np.minimum(after, len(self.times) - 1)
        span = self.times[after] - self.times[before]
        fraction = np.clip((moments - self.times[before]) / np.where(span > 0, span, 1), 0, 1)[:, None]
        middle = self.values.shape[1] // 2
        start, end = self.values[before, middle], self.values[after, middle]
        if self.interpolation == "STEP":
            values = np.where(fraction >= 1, end, start)
        elif self.interpolation == "CUBICSPLINE":
            out, into = span[:, None] * self.values[before, 2], span[:, None] * self.values[after, 0]
            s2, s3 = fraction**2, fraction**3
            values = (2 * s3 - 3 * s2 + 1) * start + (s3 - 2 * s2 + fraction) * out + (3 * s2 - 2 * s3) * end
            values = values + (s3 - s2) * into
        elif self.turns:
            values = slerp(_unit(start), _unit(end), fraction[:, 0])
        else:
            values = start + fraction * (end - start)
        return _unit(values) if self.turns else values


def _unit(quaternions: np.ndarray) -> np.ndarray:
    """Scales quaternions to length one; those of length zero become the identity."""
    lengths = np.linalg.norm(quaternions, axis=-1, keepdims=True)
    return np.where(lengths > 1e-9, quaternions / np.maximum(lengths, 1e-9), [0.0, 0.0, 0.0, 1.0])


def _tracks(gltf: Gltf, animation: dict, nodes: int) -> tuple[list[np.ndarray], dict[tuple[int, str], _Track]]:
    times, tracks = [], {}
    numbers: dict[int, np.ndarray] = {}
    made: dict[tuple, _Track] = {}

    def read(accessor: int) -> np.ndarray:
        """Returns the numbers of an accessor, cached, since many tracks may share them."""
        if accessor not in numbers:
            numbers[accessor] = gltf.array(accessor).astype(np.float64)
        return numbers[accessor]

    for channel in animation["channels"]:
        node, part = channel["target"].get("node"), channel["target"]["path"]
        width = {"translation": 3, "rotation": 4, "scale": 3}.get(part)
        if node is None or width is None:
            continue
        if not 0 <= node < nodes:
            raise ValueError("node")
        sampler = animation["samplers"][channel["sampler"]]
        parts = sampler["input"], sampler["output"], sampler.get("interpolation", "LINEAR"), width
        if parts not in made:
            made[parts] = _Track(read(parts[0]), read(parts[1]), *parts[2:])
            times.append(read(parts[0]))
        tracks[node, part] = made[parts]
    return times, tracks


def _moments(times: list[np.ndarray], file: Path) -> tuple[float, np.ndarray]:
    """Returns the frames a second of the most finely keyed track, and the moments of the frames [s]."""
    if not times:
        raise BadMotion(f"{file}: the animation moves no bone", "no track", "name another animation")
    first, last = min(each[0] for each in times), max(each[-1] for each in times)
    finest = max(times, key=len)
    steps = np.diff(finest)
    rate = 1 / np.median(steps[steps > 0]) if (steps > 0).any() else _USUAL_RATE
    whole = round(rate)
    rate = float(whole) if whole and abs(rate - whole) < 0.02 * rate else rate
    fps = rate if _RATES[0] <= rate <= _RATES[1] and len(finest) > 2 else _USUAL_RATE
    count = int(np.floor((last - first) * fps + 1e-3)) + 1
    if count > _FRAMES_MAX:
        raise BadMotion(f"{file}: an animation of at most {_FRAMES_MAX} frames is read", count, "cut it")
    return fps, first + np.arange(count) / fps


def _pose_nodes(
    nodes: Nodes, tracks: dict[tuple[int, str], _Track], moments: np.ndarray
) -> Float[np.ndarray, "frames nodes 4 4"]:
    frames = len(moments)
    moved, turned, scaled = (
        np.repeat(each[None], frames, 0) for each in (nodes.translations, nodes.rotations, nodes.scales)
    )
    for (node, part), track in tracks.items():
        values = track.at(moments)
        if part == "translation":
            moved[:, node] = values
        elif part == "rotation":
            turned[:, node] = values[:, [3, 0, 1, 2]]
        else:
            scaled[:, node] = values
    return nodes.to_world(matrices(moved, turned, scaled))


def _bone_motion(rig: GltfRig, world: np.ndarray) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Returns local rotations of bones relative to their rest pose, and the paths of those that carry the pelvis."""
    bones, parents = list(rig.bones), rig.skeleton.parents
    rest = from_matrix(_rotations(rig.rest[bones]))
    turned = multiply(from_matrix(_rotations(world[:, bones])), inverse(rest))
    local = turned.copy()
    for bone, parent in enumerate(parents):
        if parent >= 0:
            local[:, bone] = multiply(inverse(turned[:, parent]), turned[:, bone])
    places, paths = world[:, bones][..., :3, 3], {}
    for bone in rig.match.carriers:
        parent = parents[bone]
        moved = places[:, bone] - places[:, parent] if parent >= 0 else places[:, bone]
        paths[bone] = rotate(inverse(turned[:, parent]), moved) if parent >= 0 else moved
    return local, paths


def _rotations(matrix: np.ndarray) -> np.ndarray:
    """Returns the rotations of matrices with scale; for mirrored ones, those of their mirror image."""
    left, _, right = np.linalg.svd(matrix[..., :3, :3])
    flip = np.sign(np.linalg.det(left @ right))
    left[..., :, 2] *= flip[..., None]
    return left @ right
