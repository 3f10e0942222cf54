"""A garment that a coarser mesh of it is simulated for."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.datasets import Take, create, open_dataset
from hemline.make.data_mesh import DataMesh
from hemline.meshes import edge_strains
from hemline.motions import Motion
from hemline.motions.quaternions import to_matrix


@pytest.fixture(scope="module")
def garment():
    return garments.load("tshirt")


@pytest.fixture(scope="module")
def mesh(garment) -> DataMesh:
    return DataMesh.of(garment, 4.0)


def take_of(mesh: DataMesh, frames: np.ndarray, **others) -> Take:
    """A take of the simulated mesh whose body stands still."""
    body = bodies.load("anny24").shaped()
    pose, count = body.rest_pose, len(frames)
    motion = Motion(
        np.repeat(pose.rotations[None], count, 0),
        np.repeat(pose.translation[None], count, 0),
        fps=30.0,
        leg_length=body.leg_length,
        name="still",
    )
    inputs = {"garment": mesh.simulated.hash, "clip": "still", "part": 0, "simulator": 1} | others.pop("inputs", {})
    whole = {"kind": "clip", "betas": np.zeros(16, np.float32), "figures": {}} | others
    return Take(
        vertices=frames.astype(np.float32),
        motion=motion,
        lead_in=np.zeros(count, bool),
        pinched=np.zeros(count, np.int32),
        inputs=inputs,
        **whole,
    )


def carry(mesh: DataMesh, take: Take, folder) -> Take:
    coarse = create(folder / "coarse", mesh.simulated)
    coarse.add(take)
    mesh.carry(open_dataset(folder / "coarse"), folder / "fine", mesh.garment.vertices)
    fine = open_dataset(folder / "fine")
    assert fine.garment.hash == mesh.garment.hash
    return fine.take(fine.rows()[-1])


@pytest.mark.parametrize(("minutes", "most"), [(0.01, 500), (4.0, 600), (10.0, 1500)])
def test_a_short_run_simulates_few_vertices(garment, minutes, most):
    mesh = DataMesh.of(garment, minutes)
    assert mesh.is_coarser
    assert len(mesh.simulated.vertices) == pytest.approx(most, abs=2)
    assert mesh.cost_ratio == len(garment.vertices) / len(mesh.simulated.vertices)


def test_a_long_run_simulates_the_garment(garment):
    mesh = DataMesh.of(garment, 60.0)
    assert not mesh.is_coarser
    assert mesh.simulated is garment
    assert mesh.cost_ratio == 1.0


def test_a_rigid_motion_carries_the_whole_garment_rigidly(mesh, tmp_path):
    turn = to_matrix(np.array([0.8, 0.1, -0.5, 0.3]) / np.linalg.norm([0.8, 0.1, -0.5, 0.3]))
    shift = np.array([0.3, -0.2, 1.5])
    moved = carry(mesh, take_of(mesh, (mesh.simulated.vertices @ turn.T + shift)[None]), tmp_path)
    np.testing.assert_allclose(moved.vertices[0], mesh.garment.vertices @ turn.T + shift, atol=2e-5)


def test_vertices_that_are_simulated_are_where_the_simulation_has_them(mesh, tmp_path):
    swing = mesh.simulated.vertices + 0.01 * np.sin(8 * mesh.simulated.vertices[:, [1]]) * np.array([1.0, 0.0, 0.5])
    carried = carry(mesh, take_of(mesh, swing[None]), tmp_path).vertices[0]
    np.testing.assert_allclose(carried[mesh.vertex_ids], swing, atol=6e-4)
    whole = mesh.garment.vertices + 0.01 * np.sin(8 * mesh.garment.vertices[:, [1]]) * np.array([1.0, 0.0, 0.5])
    assert np.linalg.norm(carried - whole, axis=1).max() < 2.5e-3  # between them it is the smooth swing


def test_carried_cloth_keeps_its_lengths_where_the_simulated_mesh_bends(mesh, tmp_path):
    """The shirt is bent about its middle by a radian; its edges keep their lengths but for those in the bend."""
    bent = bend(mesh.simulated.vertices)
    carried = carry(mesh, take_of(mesh, bent[None]), tmp_path).vertices[0]
    alone = mesh._embedding(mesh.garment.vertices).fine_vertices(bent)
    stretch, before, own = (
        np.percentile(edge_strains(each, garment.faces, garment.rest_edges), 99)
        for each, garment in ((carried, mesh.garment), (alone, mesh.garment), (bent, mesh.simulated))
    )
    assert before > own + 0.02
    assert stretch < before - 0.02
    assert np.linalg.norm(carried - alone, axis=1).mean() < 2e-3


def bend(vertices: np.ndarray) -> np.ndarray:
    """Rolls everything above the middle backwards about a horizontal axis, over 6 cm."""
    height = vertices[:, 1] - vertices[:, 1].mean()
    angle = np.clip(height / 0.06, 0.0, 1.0)
    sine, cosine = np.sin(angle), np.cos(angle)
    turned = vertices - [0.0, vertices[:, 1].mean(), 0.0]
    return np.stack(
        [turned[:, 0], cosine * turned[:, 1] - sine * turned[:, 2], sine * turned[:, 1] + cosine * turned[:, 2]], 1
    )


def test_derivatives_are_carried_as_means(mesh, tmp_path):
    lift = np.tile(np.array([0.0, 0.5, 0.0], np.float32), (len(mesh.simulated.vertices), 1))
    slope = np.outer(mesh.simulated.vertices[:, 1], [1.0, 0.0, 0.0]).astype(np.float32)
    take = take_of(mesh, mesh.simulated.vertices[None], kind="anchor", derivatives={"turn.0.0": lift, "beta.0": slope})
    carried = carry(mesh, take, tmp_path).derivatives
    np.testing.assert_allclose(carried["turn.0.0"], np.tile([0, 0.5, 0], (len(mesh.garment.vertices), 1)), atol=1e-6)
    assert np.abs(carried["beta.0"][:, 0] - mesh.garment.vertices[:, 1]).max() < 0.03


def test_what_was_carried_is_not_carried_again(mesh, tmp_path):
    take = take_of(mesh, mesh.simulated.vertices[None])
    carry(mesh, take, tmp_path)
    (file,) = (tmp_path / "fine" / "takes").iterdir()
    before = file.stat().st_mtime_ns
    carry(mesh, take, tmp_path)
    carry(mesh, replace(take, inputs=dict(take.inputs) | {"part": 1}), tmp_path)
    assert file.stat().st_mtime_ns == before
    assert len(open_dataset(tmp_path / "fine").clips()) == 2


def test_a_run_of_another_length_does_not_mix_its_takes_with_former_ones(garment, mesh, tmp_path):
    carry(mesh, take_of(mesh, mesh.simulated.vertices[None]), tmp_path)
    mesh.remove_others(tmp_path / "fine")
    assert len(open_dataset(tmp_path / "fine").rows()) == 1
    whole = DataMesh.of(garment, 60.0)
    own = replace(take_of(whole, garment.vertices[None]), inputs={"garment": garment.hash, "clip": "own", "part": 0})
    create(tmp_path / "fine", garment).add(own)
    whole.remove_others(tmp_path / "fine")
    (row,) = open_dataset(tmp_path / "fine").rows()
    assert row.clip == "own"
    whole.remove_others(tmp_path / "absent")
