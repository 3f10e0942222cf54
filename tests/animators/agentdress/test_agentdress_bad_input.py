"""Unsuitable input for AgentDress: one line warns or refuses, and a refused command writes nothing."""

import warnings
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import hemline
from hemline import bodies, garments, motions
from hemline.animators import Bounded
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.distances import axes_between, region_distances
from hemline.animators.agentdress.fit.fit import _axes, fit
from hemline.cli.main import main
from hemline.datasets import create, open_dataset
from hemline.errors import BadBody, BadDataset, BadInput, BadModel, HemlineWarning
from hemline.files import read_tensors, write_tensors
from hemline.motions import Pose
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.playback import Player
from tests.animators import formula_garment as made

STILL = AgentDressConfig(decay_seconds=0.0)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return fit(made.make_dataset(tmp_path_factory.mktemp("anchors"), 12, singles=12), STILL)


@pytest.fixture
def saved(model, tmp_path, monkeypatch):
    """Saves the model and a clip of nine frames in the folder where commands run."""
    monkeypatch.chdir(tmp_path)
    model.save("shirt.safetensors")
    motions.write("short.safetensors", motions.load("walk")[:9])
    return "shirt.safetensors"


@cache
def stranger():
    """Returns another body of the same topology."""
    own = bodies.load("anny24")
    return replace(own, name="stranger", template=np.float32(1.01) * own.template)


def on(betas):
    shaped = made.body().body.shaped(np.asarray(betas, np.float32))
    return shaped.posed(shaped.rest_pose)


def play_pose(model, pose):
    posed = made.body().posed(pose)
    return model.step(model.start(posed), posed, 1 / 30)


def error_lines(capsys):
    """Returns the lines that a command printed on stderr between those that say what it does, and what comes next."""
    lines = capsys.readouterr().err.splitlines()
    return [line for line in lines[1:] if not line.startswith("next: ")]


# --- betas


def test_betas_beyond_one_and_a_half_times_the_fit_cause_a_warning(model):
    known: object = model
    assert isinstance(known, Bounded) and model.beta_range == (-3, 3)
    for betas in ((3.0, -3.0), (0.0, 0.0, 0.0, 0.0, 0.0, 3.0)):
        model.start(on(betas))  # no warning, which would be an error here
    for betas in ((3.1,), (0.0, -3.1), (0.0, 0.0, 0.0, 0.0, 0.0, 5.0)):
        with pytest.warns(HemlineWarning, match=r"fitted on betas from -2 to 2.* below -3 and above 3; got .*; choose"):
            _, vertices = model.step(model.start(on(betas)), on(betas), 1 / 30)
        assert np.isfinite(vertices).all()


def test_the_range_is_that_of_the_draped_shapes(tmp_path):
    found = fit(made.make_dataset(tmp_path / "data", 6, shapes=[(), (-1.0,), (1.0,), (0.0, -1.0), (0.0, 1.0)]), STILL)
    assert found.beta_range == (-1.5, 1.5)
    found.save(tmp_path / "model.safetensors")
    assert hemline.load(tmp_path / "model.safetensors").beta_range == (-1.5, 1.5)


def test_an_earlier_file_is_read_and_an_invalid_range_refused(model, tmp_path):
    model.save(tmp_path / "model.safetensors")
    arrays, metadata = read_tensors(tmp_path / "model.safetensors", "model", error=BadModel)
    held = dict(metadata["agentdress"])
    assert held.pop("betas") == [-2.0, 2.0]
    write_tensors(tmp_path / "old.safetensors", arrays, {**metadata, "agentdress": held})
    assert hemline.load(tmp_path / "old.safetensors").beta_range == (-3, 3)
    for betas in ([2.0, -2.0], [1.0], ["a", "b"], None, [-2.0, 1e9]):
        write_tensors(tmp_path / "bad.safetensors", arrays, {**metadata, "agentdress": {**held, "betas": betas}})
        with pytest.raises(BadModel, match="the lowest and the highest beta of its fit"):
            hemline.load(tmp_path / "bad.safetensors")


def test_commands_warn_of_betas_in_a_line_and_clamp_them_on_request(saved, capsys):
    asked = ["animate", saved, "-m", "short.safetensors"]
    assert main([*asked, "-o", "far.npz", "--betas", "5", "-1"]) == 0
    far = [line for line in error_lines(capsys) if "betas" in line]
    assert len(far) == 1 and far[0].startswith("hemline: warning: ") and "got 5 -1; " in far[0]
    assert main([*asked, "-o", "clamped.npz", "--betas", "5", "-1", "--clamp-betas"]) == 0
    assert main([*asked, "-o", "near.npz", "--betas", "3", "-1"]) == 0
    assert not [line for line in error_lines(capsys) if "betas" in line]
    each = {name: np.load(f"{name}.npz")["vertices"] for name in ("far", "clamped", "near")}
    np.testing.assert_array_equal(each["clamped"], each["near"])
    assert np.abs(each["far"] - each["near"]).max() > 0.02
    assert main(["evaluate", saved, "-m", "short.safetensors", "--betas", "5", "--clamp-betas", "--json"]) == 0
    assert not [line for line in error_lines(capsys) if "betas" in line]
    assert main(["animate", "cape", "-m", "short.safetensors", "-o", "no.npz", "--clamp-betas"]) == 2
    assert error_lines(capsys) == [
        "hemline: --clamp-betas needs a model that knows its range of betas; got ropes; leave it out"
    ]


@pytest.mark.parametrize(
    ("betas", "complaint"),
    [
        (["nan"], "betas must be finite"),
        (["inf"], "betas must be finite"),
        (["0"] * 17, "has 16 betas"),
        (["1e9"], "from -20 to 20"),
    ],
)
@pytest.mark.parametrize("clamp", [(), ("--clamp-betas",)])
def test_invalid_betas_are_refused_and_not_clamped(saved, capsys, betas, complaint, clamp):
    for verb in (["animate", "-o", "no.npz"], ["evaluate"]):
        assert main([*verb, saved, "-m", "short.safetensors", "--betas", *betas, *clamp]) == 2
        (line,) = error_lines(capsys)
        assert complaint in line


# --- garments


def test_a_loose_garment_causes_a_warning_with_the_error_to_expect(tmp_path, monkeypatch, capsys):
    close = fit(made.make_dataset(tmp_path / "close", 6), STILL)
    assert close.figures["skin_distance_mm"] < 30
    wide = made.rest_garment() * [1.6, 1.0, 1.6]
    monkeypatch.setattr(made, "rest_garment", lambda: wide)
    made.make_dataset(tmp_path / "loose", 6)
    assert (
        main(["fit", str(tmp_path / "loose"), "--animator", "agentdress", "-o", str(tmp_path / "m.safetensors")]) == 0
    )
    faulty, line = error_lines(capsys)  # limbs go through the cloth of this formula
    assert "have faults, and the fit learns them" in faulty
    figures = hemline.load(tmp_path / "m.safetensors").figures
    expected = figures["pose_left_out_mm"] + figures["shape_left_out_mm"]
    assert figures["skin_distance_mm"] > 1.5 * close.figures["skin_distance_mm"]
    assert line.startswith("hemline: warning: 'tshirt-light' is too loose for AgentDress")
    assert f"got {figures['skin_distance_mm']:.0f} mm" in line and f"errors of about {expected:.0f} mm" in line


@pytest.mark.parametrize(
    ("figures", "complaint"),
    [
        ({"edge_tension_p99": 0.7, "pinched": 0.0}, "too tight: .* more than 50 %; got 70 %; expect errors of about"),
        ({"edge_tension_p99": 0.2, "pinched": 63.0}, "is pinched .* 2 % of its vertices; got 10.0 %; expect errors"),
    ],
)
def test_a_tight_garment_causes_a_warning(tmp_path, monkeypatch, figures, complaint):
    """Figures of the simulation decide, those of the largest body first."""
    plain = made.anchor

    def settled(pose, betas=(), derivatives=None):
        here = figures if betas == (2.0,) else dict.fromkeys(figures, 0.0)
        return replace(plain(pose, betas, derivatives), figures=here)

    monkeypatch.setattr(made, "anchor", settled)
    with pytest.warns(HemlineWarning, match=complaint) as told:
        fit(made.make_dataset(tmp_path / "tight", 6), STILL)
    assert len(told) == 1


def test_few_anchors_cause_a_warning_and_play(tmp_path):
    """Two anchors are fewer than the five that a fit needs, and fewer than the regions."""
    data = made.make_dataset(tmp_path / "two", 2)
    with pytest.warns(
        HemlineWarning, match="needs at least 5 anchors to predict the effect of shapes in other poses; got 2; expect"
    ):
        found = fit(data, STILL)
    assert found.tables.regions.shape[1] > 2
    for number in (0, 1):
        pose = made.random_pose(number)
        away = np.linalg.norm(play_pose(found, pose)[1] - made.lifted_garment(pose), axis=1)
        assert 1e3 * away.mean() < 3
    _, vertices = play_pose(found, made.random_pose(50))
    assert np.isfinite(vertices).all() and np.abs(vertices).max() < 3


def test_regions_without_differences_between_anchors_are_finite():
    """One shoulder differs in all poses, in two of five, or in none, as seen by three regions."""
    regions, sensitivity = np.eye(3), np.zeros((3, 24, 3))
    sensitivity[0, made.SHOULDER], sensitivity[1, made.ELBOW], sensitivity[2, made.SPINE] = 0.2, 0.3, 0.4
    rotations = np.repeat(made.t_pose().rotations[None].astype(np.float64), 5, axis=0)
    rotations[:, made.SHOULDER] = from_axis_angle(np.linspace(0, 1, 5)[:, None] * [[0.0, 0.0, 1.0]])
    rotations[4, made.ELBOW] = from_axis_angle(np.array([0.0, 0.5, 0.0]))
    found = _axes(regions, sensitivity, rotations)
    apart = region_distances(axes_between(rotations, rotations), found).transpose(1, 0, 2)[:, ~np.eye(5, dtype=bool)]
    assert np.median(apart[0]) == pytest.approx(1) and np.median(apart[1]) == 0 and apart[1].mean() == pytest.approx(1)
    # three turns of one influence, 0.4 squared to the power 3/4: half of it is each axis' share
    np.testing.assert_allclose(found[2].reshape(24, 3)[made.SPINE], 0.5 * 0.4**1.5)


def test_one_anchor_is_refused_in_a_line(tmp_path, capsys):
    made.make_dataset(tmp_path / "one", 1)
    model = tmp_path / "m.safetensors"
    assert main(["fit", str(tmp_path / "one"), "--animator", "agentdress", "-o", str(model)]) == 2
    (line,) = error_lines(capsys)
    assert "fewer than two anchors on all shapes; got 1; run 'hemline drape --anchors' to its end" in line
    assert not model.exists()


# --- bodies and garments of somebody else


def test_anchors_of_another_body_are_refused(tmp_path):
    data = made.make_dataset(tmp_path / "data", 2)
    extra = made.anchor(made.anchor_pose(made.random_pose(7)), ())
    data.add(replace(extra, inputs={**extra.inputs, "body": stranger().hash}))
    with pytest.raises(BadDataset, match=f"made on another body than anny24 .*; got {stranger().hash}; put that body"):
        fit(data, STILL)


def test_garments_settled_in_different_ways_are_said(tmp_path):
    data = made.make_dataset(tmp_path / "data", 6)
    for number, ways in enumerate(({"protocol": "walk 1"}, {"protocol": "walk 2"}, {"protocol": "walk 2"})):
        extra = made.anchor(made.anchor_pose(made.random_pose(7 + number)), ())
        data.add(replace(extra, inputs={**extra.inputs, **ways, "simulator": 1}))
    told = (
        "settled in different ways.*; got 2 by 'walk 2' of simulator 1, 1 by 'walk 1' of simulator 1; drape them into"
    )
    with pytest.warns(HemlineWarning, match=told):
        fit(data, STILL)


def test_a_dataset_of_an_unknown_body_is_refused_in_a_line(tmp_path, capsys):
    create(tmp_path / "data", replace(made.shirt(), body_name="nobody.npz"))
    model = tmp_path / "m.safetensors"
    assert main(["fit", str(tmp_path / "data"), "--animator", "agentdress", "-o", str(model)]) == 2
    (line,) = error_lines(capsys)
    assert "nobody.npz" in line and not model.exists()
    with pytest.raises(BadBody, match="nobody.npz"):
        fit(open_dataset(tmp_path / "data"), STILL)


def test_a_model_on_another_body_is_refused_in_a_line(model, saved, capsys):
    with pytest.raises(BadInput, match="was fitted on body"):
        Player.prepare(model, stranger().shaped())
    bodies.write("stranger.safetensors", stranger())
    words = ["animate", saved, "-m", "short.safetensors", "-o", "no.npz", "--body", "stranger.safetensors"]
    assert main(words) == 2
    (line,) = error_lines(capsys)
    assert "was fitted on body 'anny24'; got body 'stranger.safetensors'; load that body, or fit again" in line


def test_a_folder_of_another_garment_is_left_as_it_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    napkin = garments.make_cape(bodies.load("anny24").shaped(), rows=6, columns=10, name="napkin")
    create("data", napkin)
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "data").rglob("*")}
    assert main(["drape", "tshirt-light", "-o", "data", "--anchors", "2", "-m", "walk"]) == 2
    (line,) = error_lines(capsys)
    assert "data was made for another garment; got napkin" in line and "choose another folder" in line
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "data").rglob("*")} == before


# --- poses


def test_novelty_is_the_distance_to_the_nearest_pose_of_the_fit(model):
    """Distances of the fit over regions give the same novelty, which is 0 at a pose of the fit."""
    tables = model.tables
    for number in (3, 70):
        pose = made.random_pose(number)
        turns = axes_between(
            made.anchor_pose(pose).rotations[None].astype(np.float64), tables.rotations.astype(np.float64)
        )
        apart = region_distances(turns, tables.axes.astype(np.float64))[0]
        plain = np.sqrt(sum(tables.regions[:, g].mean() * apart[g].min() for g in range(len(apart))))
        found = model.novelty(play_pose(model, pose)[0])
        assert found == pytest.approx(plain, abs=2e-3)
        assert (found < 2e-3) == (number == 3)
    assert np.isnan(model.novelty(model.start(on(()))))


def test_novelty_does_not_depend_on_heading_and_place(model):
    pose = made.random_pose(71)
    rotations = pose.rotations.astype(np.float64)
    rotations[0] = multiply(from_axis_angle(np.array([0.0, 2.0, 0.0])), rotations[0])
    there = Pose(rotations, pose.translation + [1.0, 0.0, -2.0])
    one, two = (model.novelty(play_pose(model, each)[0]) for each in (pose, there))
    assert one == pytest.approx(two, rel=1e-4)


def test_errors_grow_with_novelty(model):
    """With growing rotations of arm and spine, errors beyond the limit are more than twice those within."""
    novelties, errors = [], []
    for number in range(100, 140):
        random, reach = np.random.default_rng(number), 0.3 + 0.04 * (number - 100)
        joints = (made.ELBOW, made.SHOULDER, made.SPINE)
        pose = made.turn_joints(*((joint, tuple(random.uniform(-reach, reach, 3))) for joint in joints))
        state, vertices = play_pose(model, pose)
        novelties.append(model.novelty(state))
        errors.append(np.linalg.norm(vertices - made.lifted_garment(pose), axis=1).mean())
    beyond = np.array(novelties) > model.novelty_limit
    assert 5 < beyond.sum() < 35
    assert np.corrcoef(novelties, errors)[0, 1] > 0.6
    assert np.mean(np.array(errors)[beyond]) > 2 * np.mean(np.array(errors)[~beyond])


def test_frames_hold_the_novelty_of_animators_that_have_one(model):
    clip = motions.load("walk")[:3]
    player = Player.prepare(model, made.body())
    state, frame = player.step(player.start(clip[0], pre_roll=0.1), clip[1], 1 / 30)
    assert frame.novelty == model.novelty(state.animator) > 0
    player = Player.prepare(hemline.load("cape"), made.body())
    assert player.step(player.start(clip[0], pre_roll=0.1), clip[1], 1 / 30)[1].novelty is None


def test_commands_report_frames_in_new_poses(saved, capsys):
    """The fit contains small rotations of an arm and the spine. A kick is far from them, its rest pose is not."""
    rest = made.body().rest_pose
    still = replace(
        motions.load("walk")[:3],
        rotations=np.repeat(rest.rotations[None], 3, axis=0),
        translations=np.repeat(rest.translation[None], 3, axis=0),
    )
    motions.write("still.safetensors", still)
    assert main(["animate", saved, "-m", "still.safetensors", "-o", "still.npz"]) == 0
    assert error_lines(capsys) == []
    assert main(["evaluate", saved, "-m", "dance", "--seconds", "0.3", "--json"]) == 0
    (line,) = error_lines(capsys)
    assert line.startswith("hemline: warning: ") and "frames are in poses unlike all that 'tshirt-light'" in line


def test_a_warning_is_a_line_and_other_warnings_are_unchanged(model, saved, monkeypatch, capsys):
    from hemline.cli import model as opened

    plain = opened.open_model

    def loud(*words, **options):
        warnings.warn("of a library", UserWarning, stacklevel=1)
        return plain(*words, **options)

    monkeypatch.setattr(opened, "open_model", loud)
    with pytest.raises(UserWarning, match="of a library"):
        main(["animate", saved, "-m", "short.safetensors", "-o", "a.npz"])
    assert HemlineWarning("a\nb", 1, "c").args == ("a b; got 1; c",)
