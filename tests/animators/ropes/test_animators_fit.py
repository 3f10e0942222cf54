"""A whole fit, from a dataset on disk to a model that plays: a cape that trails its key joint by a formula."""

import importlib.util
import sys
from dataclasses import replace

import numpy as np
import pytest

from hemline import animators, bodies, garments
from hemline.animators.ropes import AnimatorRopes, RopesConfig
from hemline.animators.ropes.bones.bones import bones_of_mesh
from hemline.animators.ropes.fit.fit import fit
from hemline.animators.ropes.fit.fit_ropes import fit_ropes, sample_frames
from hemline.animators.ropes.fit.gather import TakeFrames, gather
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.datasets import Take, create
from hemline.errors import BadDataset, BadOutput, MissingExtra
from hemline.learning.key_frame import to_key_frame
from hemline.motions import Motion
from hemline.motions.quaternions import multiply

pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
ROWS, COLUMNS, LEAD_IN = 15, 20, 4
TINY = RopesConfig(
    components=10,
    shape_components=10,
    hidden=48,
    epochs=60,
    batch=32,
    collision_vertices=50,
    correction_components=12,
    skinning_rate=3e-3,
    shape_rate=1e-3,
    checkpoint_epochs=20,
    threads=1,
    second_columns=2,
)
BRIEF = replace(TINY, epochs=6, checkpoint_epochs=2)


def swinging(shaped, clip: int, frames: int = 40) -> Motion:
    """The body turns from side to side while it goes."""
    t = np.arange(frames) / 30 + clip
    rest = shaped.rest_pose
    rotations = np.repeat(rest.rotations[None], frames, axis=0).astype(np.float64)
    half = 0.4 * np.sin((2 + 0.3 * clip) * t)
    turn = np.stack([np.cos(half), 0 * t, np.sin(half), 0 * t], axis=1)
    rotations[:, 0] = multiply(turn, rotations[:, 0])
    travel = np.stack([0.2 * np.sin(t), 0 * t, t], axis=1)
    return Motion(
        rotations.astype(np.float32),
        (rest.translation + travel).astype(np.float32),
        fps=30.0,
        leg_length=shaped.leg_length,
        name=f"clip{clip}",
        licence="free",
    )


def trailing(garment, shaped, motion: Motion) -> np.ndarray:
    """Returns vertices (frames, verts, 3) that trail behind the key joint, more with the distance from it [m]."""
    neck = 12
    transforms = shaped.transforms_of(motion.rotations, motion.translations)[0][:, neck]
    depth = np.clip(garment.vertices[:, 1].max() - garment.vertices[:, 1], 0, None)
    turn = np.gradient(np.unwrap(np.arctan2(transforms[:, 0, 2], transforms[:, 0, 0])))[:, None] * 3
    local = np.repeat(garment.vertices[None], len(motion), axis=0)
    local[..., 0] += turn * depth**1.5
    local[..., 1] += 0.5 * (turn * depth) ** 2
    local[..., 2] += 0.3 * turn * depth * np.sin(6 * depth)
    return (np.einsum("fij,fvj->fvi", transforms[:, :, :3], local) + transforms[:, None, :, 3]).astype(np.float32)


def take(garment, shaped, motion: Motion, clip: int, kind: str = "clip") -> Take:
    rest = kind == "rest"
    frames = len(motion)
    vertices = np.repeat(garment.vertices[None], frames, axis=0) if rest else trailing(garment, shaped, motion)
    inputs = {"garment": garment.hash, "clip": "" if rest else motion.name, "subject": f"{clip}", "part": 0}
    inputs |= {"settings": {"air_density": 1.2}}
    return Take(
        kind,
        vertices,
        motion,
        shaped.betas,
        (np.arange(frames) < LEAD_IN) & (not rest),
        np.zeros(frames, np.int32),
        {"edge_strain_p99": 0.02},
        inputs,
    )


@pytest.fixture(scope="module")
def shaped():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def garment(shaped):
    chains = tuple(tuple(row * COLUMNS + column for row in range(1, ROWS, 3)) for column in (2, 7, 12, 17))
    return replace(garments.make_cape(shaped, rows=ROWS, columns=COLUMNS), chains=chains)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory, garment, shaped):
    found = create(tmp_path_factory.mktemp("takes") / "dataset", garment)
    rest = shaped.rest_pose
    still = Motion(rest.rotations[None], rest.translation[None], fps=30.0, leg_length=shaped.leg_length, name="rest")
    found.add(take(garment, shaped, still, 0, "rest"))
    for clip in range(10):
        found.add(take(garment, shaped, swinging(shaped, clip), clip))
    return found


@pytest.fixture(scope="module")
def fitted(dataset) -> AnimatorRopes:
    return fit(dataset, TINY, seed=0)


@pytest.fixture(scope="module")
def brief(dataset) -> AnimatorRopes:
    """A short fit, which is not accurate."""
    return fit(dataset, BRIEF, seed=0)


def test_frames_are_gathered_without_lead_ins_and_split_by_clip(dataset, garment, shaped, tmp_path):
    source = TakeFrames.of(dataset)
    ropes = build_ropes(garment, shaped, rest=garment.vertices)
    frames, clear = gather(source, ropes, tmp_path, mirror=False)
    assert len(frames.side) == 10 * (40 - LEAD_IN)
    assert [len(part) for part in (frames.train, frames.val, frames.test)] == [8 * 36, 36, 36]
    assert all(len(set(frames.side[i : i + 36])) == 1 for i in range(0, 360, 36))
    # the displacement is that of the formula, in the frame of the neck
    motion = swinging(shaped, int(source.rows[0].subject))
    truth = trailing(garment, shaped, motion)[LEAD_IN]
    neck = shaped.posed(motion[LEAD_IN]).transforms[12].astype(np.float64)
    expected = (truth - neck[:, 3]) @ neck[:, :3] - garment.vertices
    np.testing.assert_allclose(frames.displacements[0].reshape(-1, 3), expected, atol=2e-6)
    # bones carried by the body hardly move in the frame of the neck, the others as the cloth does
    assert frames.free.reshape(-1, 3)[ropes.kinematic].max() == 0
    node = int(np.flatnonzero(frames.free.reshape(-1, 3)[:, 0])[-1])
    on_mesh = ropes.positions_on(expected)[node]
    np.testing.assert_allclose(frames.bones[0].reshape(-1, 3)[node], on_mesh, atol=2e-6)
    assert frames.rope_bones.shape == frames.bones.shape
    # clearances know where the body is: half-spaces in the frame of the neck whose points are body vertices
    near = np.isfinite(clear.heights[0])
    skin = (shaped.posed(motion[LEAD_IN]).vertices - neck[:, 3]) @ neck[:, :3]
    here = (expected + garment.vertices)[near]
    nearest = skin[np.linalg.norm(here[:, None] - skin, axis=2).argmin(axis=1)]
    found = np.einsum("vi,vi->v", clear.normals[0][near].astype(float), here - nearest)
    assert near.any()
    np.testing.assert_allclose(clear.heights[0][near], found, atol=2e-4)  # float16 of 8 cm: 0.06 mm


def test_a_fit_lays_bones_by_skinning_decomposition_where_asked(dataset, garment, shaped):
    source = TakeFrames.of(dataset)
    asked = replace(TINY, layout="ssdr", calibrate=False, chains=4, chain_bones=5)
    ropes, figures = fit_ropes(source, shaped, garment.vertices, asked, None)
    even, _ = fit_ropes(source, shaped, garment.vertices, replace(asked, layout="geodesic"), None)
    assert len(ropes.chains.offsets) == 5 and figures["train_ropes_mm"] > 0
    assert even.node_count == 4 * 5 + 5 and ropes.node_count <= even.node_count
    assert not np.array_equal(ropes.rest[ropes.chains.offsets[:-1] + 1], even.rest[even.chains.offsets[:-1] + 1])
    # from frames without the motion of the neck, of the takes to train on alone
    frames = sample_frames(source, shaped).vertices
    assert frames.shape == (80, ROWS * COLUMNS, 3)
    neck = shaped.posed(shaped.rest_pose).transforms[12].astype(np.float64)
    np.testing.assert_allclose(
        frames[:, :COLUMNS],
        np.broadcast_to(to_key_frame(neck, garment.vertices[:COLUMNS]), (80, COLUMNS, 3)),
        atol=0.02,
    )


def test_takes_on_other_bodies_only_lay_chains_from_the_rim_and_no_decomposition(dataset, garment, shaped):
    source = TakeFrames.of(dataset)
    rows = tuple(replace(row, betas=(1.0, *row.betas[1:])) for row in source.rows)
    other = TakeFrames(dataset, rows, source.sides)
    assert sample_frames(other, shaped) is None
    ropes, figures = fit_ropes(other, shaped, garment.vertices, replace(TINY, layout="geodesic", chains=4), None)
    assert len(ropes.chains.offsets) == 5 and not figures
    with pytest.raises(BadDataset, match="other shapes of the body only; simulate clips without --betas"):
        fit_ropes(other, shaped, garment.vertices, replace(TINY, layout="ssdr"), None)


def test_mirrored_frames_are_for_training_only_and_are_mirror_images(dataset, garment, tmp_path):
    source, ropes = TakeFrames.of(dataset), build_ropes(garment, bodies.load("anny24").shaped(), rest=garment.vertices)
    frames, _ = gather(source, ropes, tmp_path, mirror=True)
    assert [len(part) for part in (frames.train, frames.val, frames.test)] == [2 * 8 * 36, 36, 36]
    one, image = frames.displacements[:36], frames.displacements[36:72]
    across = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)[:, ::-1].reshape(-1)
    here = garment.vertices + one.reshape(36, -1, 3)
    there = garment.vertices + image.reshape(36, -1, 3)
    np.testing.assert_allclose(there, here[:, across] * [-1, 1, 1], atol=3e-6)


def test_a_fitted_model_plays_unseen_clips_from_their_bones(fitted, dataset):
    rest_error, error = [], []
    for row in dataset.split("test"):
        seen = dataset.take(row)
        body = bodies.load("anny24").shaped(row.betas)
        state = fitted.start(body.posed(seen.motion[0]))
        for index in seen.clip_frames:
            posed = body.posed(seen.motion[int(index)])
            state, vertices = fitted.follow(state, posed, 1 / 30, seen.vertices[index])
            error.append(np.linalg.norm(vertices - seen.vertices[index], axis=1).mean() * 1e3)
            key = posed.transforms[12]
            stiff = fitted.rest @ key[:, :3].T + key[:, 3]
            rest_error.append(np.linalg.norm(stiff - seen.vertices[index], axis=1).mean() * 1e3)
    assert np.mean(error) < 0.25 * np.mean(rest_error)
    # what the model file says is what playing it gives, but for the 16 bits of the coefficients
    assert np.mean(error) == pytest.approx(fitted.figures["test_error_mm"], rel=0.02, abs=0.05)


def test_bones_that_are_given_are_used(fitted, dataset):
    seen = dataset.take(dataset.clips()[0])
    body = bodies.load("anny24").shaped()
    posed = body.posed(seen.motion[9])
    state = fitted.start(posed)
    bones = bones_of_mesh(fitted.ropes, seen.vertices[9], posed)
    _, one = fitted.step(state, posed, 1 / 30, bones=bones)
    _, two = fitted.follow(state, posed, 1 / 30, seen.vertices[9])
    np.testing.assert_array_equal(one, two)
    # the ropes' own are corrected, given ones are not: by what gravity's direction adds here
    strong = replace(fitted.correction, matrix=np.ones_like(fitted.correction.matrix))
    roped = replace(fitted, correction=strong)
    after, own = roped.step(roped.start(posed), posed, 1 / 30)
    _, uncorrected = fitted.step(state, posed, 1 / 30, bones=after.bones.ropes.positions)
    assert np.abs(own - uncorrected).max() > 1e-4
    bones[-1] += 0.1
    _, other = fitted.step(state, posed, 1 / 30, bones=bones)
    assert np.abs(other - one).max() > 1e-4


def test_the_figures_of_own_bones_are_what_playing_gives(fitted, dataset):
    body, error = bodies.load("anny24").shaped(), []
    for row in dataset.split("test"):
        seen = dataset.take(row)
        state = fitted.start(body.posed(seen.motion[0]))
        for index in range(len(seen.motion)):
            state, vertices = fitted.step(state, body.posed(seen.motion[index]), 1 / 30)
            if not seen.lead_in[index]:
                error.append(np.linalg.norm(vertices - seen.vertices[index], axis=1).mean() * 1e3)
    corrected = "corrected" if fitted.correction.matrix.any() else "uncorrected"
    assert fitted.figures[f"test_{corrected}_error_mm"] == pytest.approx(np.mean(error), rel=0.02)


def test_a_fitted_model_is_saved_with_what_it_needs(fitted, tmp_path):
    fitted.save(tmp_path / "cape.safetensors")
    back = animators.load(tmp_path / "cape.safetensors")
    assert back.figures == fitted.figures
    assert back.config == TINY
    assert "free" in back.licences
    assert back.garment.hash == fitted.garment.hash


def test_the_constants_of_the_ropes_come_closer_to_the_truth(garment, shaped, tmp_path):
    """The clips are longer than the windows of the calibration."""
    long = create(tmp_path / "long", garment)
    rest = shaped.rest_pose
    still = Motion(rest.rotations[None], rest.translation[None], fps=30.0, leg_length=shaped.leg_length, name="rest")
    long.add(take(garment, shaped, still, 0, "rest"))
    for clip in range(4):
        long.add(take(garment, shaped, swinging(shaped, clip, 80), clip))
    short = replace(TINY, epochs=1)
    calibrated, laid = (fit(long, replace(short, calibrate=each), seed=0) for each in (True, False))
    assert calibrated.figures["train_ropes_mm"] < laid.figures["train_ropes_mm"]
    assert calibrated.figures["held_out_ropes_mm"] > 0


def test_the_same_seed_gives_the_same_file(brief, dataset, tmp_path):
    again = fit(dataset, BRIEF, seed=0)
    for name, model in (("a", brief), ("b", again)):
        model.save(tmp_path / f"{name}.safetensors")
    assert (tmp_path / "a.safetensors").read_bytes() == (tmp_path / "b.safetensors").read_bytes()


def test_a_killed_fit_goes_on_and_leaves_no_checkpoints(brief, dataset, tmp_path):
    folder, seen = tmp_path / "cape.fitting", []

    def killed(stage, done, total):
        if (stage, done) == ("shape network", 5):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fit(dataset, BRIEF, seed=0, checkpoints=folder, progress=killed)
    assert folder.exists()
    end = fit(dataset, BRIEF, seed=0, checkpoints=folder, progress=lambda *at: seen.append(at))
    assert not folder.exists()
    assert ("skinning network", 1, 6) not in seen and ("shape network", 4, 6) not in seen
    assert ("shape network", 5, 6) in seen
    for one, two in zip(brief.shape.weights, end.shape.weights, strict=True):
        np.testing.assert_array_equal(one, two)


def stopped_at(stage: str):
    """Returns a progress function that stops a fit at the given stage."""

    def stop(told, done, total):
        if told == stage:
            raise KeyboardInterrupt

    return stop


def test_a_fit_that_stops_leaves_no_mapped_frames_and_nothing_of_others_goes(dataset, tmp_path):
    folder = tmp_path / "cape.fitting"
    with pytest.raises(KeyboardInterrupt):
        fit(dataset, BRIEF, seed=0, checkpoints=folder, progress=stopped_at("frames"))
    assert not folder.exists()  # there was no checkpoint yet
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    fit(dataset, BRIEF, seed=0, checkpoints=folder)
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


def test_a_file_in_the_place_of_the_checkpoints_is_said(dataset, tmp_path):
    (tmp_path / "cape.fitting").write_text("mine")
    with pytest.raises(BadOutput, match="cannot make .*cape.fitting; got File exists"):
        fit(dataset, BRIEF, seed=0, checkpoints=tmp_path / "cape.fitting")


def test_a_dataset_without_takes_is_refused(tmp_path, garment):
    with pytest.raises(BadDataset, match="holds no take to train on; got 0 takes; simulate more clips"):
        fit(create(tmp_path / "empty", garment), TINY)


def test_without_torch_it_says_how_to_get_it(dataset, monkeypatch):
    import importlib.util

    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name == "torch" else found(name, *rest)
    )
    with pytest.raises(MissingExtra, match=r"needs torch; it is not installed; run: pip install 'hemline\[learn\]'"):
        fit(dataset, TINY)


def test_linear_maps_and_ropes_need_no_torch(dataset, monkeypatch, tmp_path):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name == "torch" else found(name, *rest)
    )
    for module in ("torch", "hemline.animators.ropes.fit.networks"):
        monkeypatch.setitem(sys.modules, module, None)
    model = fit(dataset, replace(TINY, epochs=0))
    model.save(tmp_path / "linear.safetensors")
    back = animators.load(tmp_path / "linear.safetensors")
    assert len(back.skinning.weights) == len(back.shape.weights) == 1
    moved = np.random.default_rng(0).normal(0, 0.1, 3 * model.ropes.node_count).astype(np.float32)
    np.testing.assert_array_equal(back.skinning(moved), model.skinning(moved))
    np.testing.assert_allclose(back.skinning(moved), back.skinning.many(moved[None])[0], atol=1e-5)
    assert model.figures["test_error_mm"] < 2 * model.figures["test_ridge_mm"] + 1
