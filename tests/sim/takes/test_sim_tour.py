"""Drapes along a tour: a body passes through poses, and the garment is kept in each of them."""

import json
from contextlib import nullcontext
from functools import cache

import numpy as np
import pytest

from hemline import garments, motions
from hemline.animators.agentdress.fit.fit import fit
from hemline.cli.main import main
from hemline.datasets import open_dataset
from hemline.garments import coarser_garment
from hemline.motions import JOINT_NAMES
from hemline.motions.motion import Motion
from hemline.motions.quaternions import multiply, rotate
from hemline.sim.takes import tour as touring
from hemline.sim.takes.database import sample_poses

CLIP = slice(0, 90)


@cache
def shirt():
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.1)
    return garment


def clips() -> list[Motion]:
    return [motions.load("walk")[CLIP]]


def make(folder, count, **others):
    return touring.make_tour(folder / "drapes", shirt(), clips(), count, tour=folder / "tour", **others)


@pytest.fixture(scope="module")
def toured(tmp_path_factory):
    """Seven poses in two parts."""
    folder, told = tmp_path_factory.mktemp("tour"), []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(touring, "PART_POSES", 4)
        count = make(folder, 7, progress=lambda *step: told.append(step))
    return folder, count, told


def test_every_pose_is_a_drape_and_the_t_pose_has_derivatives(toured):
    folder, count, told = toured
    drapes = open_dataset(folder / "drapes")
    takes = [drapes.take(row) for row in drapes.anchors()]
    upright = [take for take in takes if "turn.0.0" in take.derivatives]
    assert (count, len(takes), len(upright)) == (7, 8, 1)
    assert len(open_dataset(folder / "tour").clips()) == 2
    assert told[-1][0] == "poses" and told[-1][1] == told[-1][2]
    poses = sample_poses(clips())
    for take in takes:
        if take is not upright[0] and "turn.0.0" not in take.derivatives:
            dots = np.abs((poses[:, 1:] * take.motion[0].rotations[1:]).sum(axis=2))
            assert dots.min(axis=1).max() > 0.99  # one of those of the clip, but for limbs that were moved apart


def test_a_drape_is_the_frame_of_the_tour_in_which_the_body_pauses(toured):
    folder, *_ = toured
    drapes, tour = open_dataset(folder / "drapes"), open_dataset(folder / "tour")
    kept = {drapes.take(row).vertices.tobytes() for row in drapes.anchors()}
    for row in tour.clips():
        take = tour.take(row)
        frames = take.clip_frames
        for number in range(0, len(frames), touring.TOUR_FRAMES):
            assert take.vertices[frames[number]][None].tobytes() in kept
        assert take.vertices[frames[1]][None].tobytes() not in kept


def test_a_second_run_makes_nothing(toured):
    folder, *_ = toured
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(touring, "PART_POSES", 4)
        before = {path: path.stat().st_mtime_ns for path in folder.rglob("*.safetensors")}
        assert make(folder, 7) == 7
        assert {path: path.stat().st_mtime_ns for path in folder.rglob("*.safetensors")} == before


def test_what_was_simulated_is_kept_when_a_callback_stops_the_work(tmp_path):
    class Enough(Exception):
        pass

    def stop(stage, done, total):
        if done > total // 2 + 2:
            raise Enough

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(touring, "PART_POSES", 2)
        with pytest.raises(Enough):
            make(tmp_path, 4, progress=stop)
    rows = open_dataset(tmp_path / "drapes").anchors()
    assert len(rows) == 3  # the T-pose, and the two poses of the first part


def test_agentdress_is_fitted_to_it_and_follows_the_skin_of_other_bodies(toured):
    folder, *_ = toured
    drapes = open_dataset(folder / "drapes")
    with pytest.warns(match="settled on one body: on others it follows the skin"):
        model = fit(drapes)
    assert model.figures["shapes"] == 1 and model.figures["anchors"] == 7
    body = drapes.body
    shaped, pose = {"mean": body.shaped(), "large": body.shaped((2.0,))}, body.shaped().rest_pose
    worn = {}
    for name, each in shaped.items():
        posed = each.posed(pose)
        with nullcontext() if name == "mean" else pytest.warns(match="fitted on one body, and follows the skin"):
            worn[name] = model.step(model.start(posed), posed, 1 / 30)[1]
    moved = worn["large"] - worn["mean"]
    skin = (shaped["large"].vertices - shaped["mean"].vertices)[model.tables.nearest]
    away = np.linalg.norm(moved - skin, axis=1)
    assert np.linalg.norm(skin, axis=1).mean() > 0.02
    assert away.mean() < 0.25 * np.linalg.norm(skin, axis=1).mean()


def alike(shipped, rotations):
    """Cosine of half the angle by which the joint differs that differs most; of arms, the bones and the hands count.

    Straight arms that a recording wrings are turned back about their bones, which moves neither bones nor hands.
    """
    same = [k for k, name in enumerate(JOINT_NAMES) if k and not name.endswith(("shoulder", "elbow", "wrist"))]
    found = [np.abs((shipped[:, same] * rotations[:, same]).sum(axis=2)).min(axis=1)]
    for side in ("left", "right"):
        ours, theirs = np.array([[1.0, 0, 0, 0]]), np.array([[1.0, 0, 0, 0]])
        for name in ("shoulder", "elbow", "wrist"):
            joint = JOINT_NAMES.index(f"{side}_{name}")
            ours, theirs = multiply(ours, rotations[:, joint]), multiply(theirs, shipped[:, joint])
            if name != "wrist":
                bones = [rotate(each, np.array([1.0, 0, 0])) for each in (ours, theirs)]
                found.append((1 + (bones[0] * bones[1]).sum(axis=1)) / 2)
        found.append(np.abs((ours * theirs).sum(axis=1)))
    return np.min(found, axis=0)


def test_the_command_makes_a_tour_of_poses_of_many_people(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shirt().save("shirt.safetensors")
    assert main(["drape", "shirt.safetensors", "--tour", "3", "-o", "drapes", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"dataset": "drapes", "poses": 3}
    found = open_dataset("drapes")
    shipped = sample_poses([motions.varied_poses()])
    poses = [found.take(row).motion[0] for row in found.anchors()]
    near = [alike(shipped, pose.rotations[None]).max() for pose in poses]
    assert sum(each > 0.99 for each in near) >= 3
    assert main(["drape", "shirt.safetensors", "--tour", "3", "--anchors", "2", "-m", "walk", "-o", "drapes"]) == 2
    assert "--tour stands alone; got other poses" in capsys.readouterr().err
