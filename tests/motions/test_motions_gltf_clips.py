"""Animations of glTF files whose skins and names are unlike those of most: written by the tests' own writer."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest

from hemline import motions
from hemline.errors import BadMotion, HemlineWarning
from tests.motions.rig_samples import Sample, apart_mm, sample


def write_clip(
    path, truth: Sample, *, names=("walk",), bound: bool | None = None, posed_frame: int | None = None
) -> None:
    """Writes a clip as GLB.

    Args:
        path: The file.
        truth: The clip; its bones lie as in the zero pose of its rig.
        names: Names of animations, all of them the clip.
        bound: Whether the skin has bind matrices; None: there is no skin.
        posed_frame: The frame that the nodes show; None: the zero pose.
    """
    binary, document = bytearray(), {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": [], "animations": []}

    def add(array: np.ndarray, shape: str) -> int:
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes})
        binary.extend(np.ascontiguousarray(array, "<f4").tobytes())
        view = len(document["bufferViews"]) - 1
        document["accessors"].append({"bufferView": view, "componentType": 5126, "count": len(array), "type": shape})
        return len(document["accessors"]) - 1

    skeleton, rotations = truth.bvh.skeleton, truth.bvh.rotations[:, :, [1, 2, 3, 0]].astype("<f4")
    metres = 0.01 * skeleton.offsets
    document["nodes"] = [
        {
            "name": name,
            "translation": metres[joint].tolist(),
            "rotation": [0, 0, 0, 1] if posed_frame is None else rotations[posed_frame, joint].tolist(),
        }
        for joint, name in enumerate(skeleton.names)
    ]
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            document["nodes"][parent].setdefault("children", []).append(joint)
    times = add((np.arange(len(rotations)) / truth.bvh.fps).astype("<f4"), "SCALAR")
    outputs = [add(rotations[:, joint], "VEC4") for joint in range(24)]
    way = add((0.01 * truth.bvh.positions[0]).astype("<f4"), "VEC3")
    samplers = [{"input": times, "output": output} for output in (*outputs, way)]
    targets = [{"node": joint, "path": "rotation"} for joint in range(24)] + [{"node": 0, "path": "translation"}]
    channels = [{"sampler": number, "target": target} for number, target in enumerate(targets)]
    document["animations"] = [{"name": name, "channels": channels, "samplers": samplers} for name in names]
    if bound is not None:
        document["skins"] = [{"joints": list(range(24))}]
        if bound:
            binds = np.tile(np.eye(4, dtype="<f4"), (24, 1, 1))
            binds[:, 3, :3] = -0.01 * skeleton.zero_positions
            document["skins"][0]["inverseBindMatrices"] = add(binds.reshape(24, 16), "MAT4")
    document["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary)) + struct.pack("<I4s", len(text), b"JSON")
    path.write_bytes(head + text + struct.pack("<I4s", len(binary), b"BIN\0") + bytes(binary))


@pytest.mark.parametrize(
    ("bound", "posed_frame"), [(None, None), (None, 10), (True, None), (True, 10), (False, None), (False, 10)]
)
def test_the_pose_of_nodes_does_not_matter(tmp_path, bound, posed_frame):
    """With a skin, with one that has no bind matrices, and without: in the rest pose, and in the middle of a step."""
    truth = sample("walk")
    write_clip(tmp_path / "walk.glb", truth, bound=bound, posed_frame=posed_frame)
    mean, most = apart_mm(motions.read(tmp_path / "walk.glb"), truth)
    assert mean < 18 and most < 60


def test_a_sleeper_goes_on_sleeping(tmp_path):
    """In a bed half a metre above the floor: glTF has y up, whatever a body does."""
    truth = sample("walk", frames=slice(0, 1))
    local = np.zeros_like(truth.bvh.rotations)
    local[..., 0] = 1
    local[:, 0] = [np.sqrt(0.5), -np.sqrt(0.5), 0, 0]
    asleep = replace(truth, bvh=replace(truth.bvh, rotations=local, positions={0: np.array([[0.0, 60, 300]])}))
    write_clip(tmp_path / "sleep.glb", asleep, bound=True)
    with pytest.warns(HemlineWarning, match="lies or leans in 100 % of the frames, with y up"):
        found = motions.read(tmp_path / "sleep.glb")
    assert np.allclose(np.abs(found.rotations[0, 0]), [np.sqrt(0.5), np.sqrt(0.5), 0, 0], atol=1e-5)


def test_a_name_may_hold_colons_and_dots(tmp_path):
    write_clip(tmp_path / "it.glb", sample("walk"), names=("mixamo.com|Layer0:walk", "char:run"))
    assert motions.read(f"{tmp_path}/it.glb:mixamo.com|Layer0:walk").name == "mixamo.com|Layer0:walk"
    assert motions.open_motion(f"{tmp_path}/it.glb:char:run").name == "char:run"


def test_animations_of_one_name_are_told_apart_by_numbers(tmp_path):
    write_clip(tmp_path / "it.glb", sample("walk"), names=("walk", "walk"))
    with pytest.raises(BadMotion, match="has 2 animations; got 0 'walk', 1 'walk'; name one: .*it.glb:0"):
        motions.read(tmp_path / "it.glb")
    with pytest.raises(BadMotion, match="has 2 animations 'walk'; got 0 'walk', 1 'walk'; number one: .*it.glb:0"):
        motions.read(f"{tmp_path}/it.glb:walk")
    assert motions.read(f"{tmp_path}/it.glb:1").name == "walk"


def test_one_key_is_a_pose(tmp_path):
    truth = sample("walk", frames=slice(30, 31))
    write_clip(tmp_path / "pose.glb", truth, bound=True)
    pose = motions.read(tmp_path / "pose.glb")
    assert len(pose) == 1 and apart_mm(pose, truth)[0] < 18
