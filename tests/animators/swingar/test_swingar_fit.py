"""Fits of lag and swingar: they learn what trails, are the same after a kill, and go on from what was learned."""

from dataclasses import replace
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

import hemline
from hemline import bodies
from hemline.animators import lag, swingar
from hemline.animators.coarse.fit.fit import split_takes
from hemline.animators.lag import KIND, LagConfig
from hemline.animators.swingar import SwingarConfig
from hemline.datasets import open_collection, open_dataset
from hemline.errors import BadDataset, BadInput
from tests.animators import swaying_takes as made

pytest.importorskip("torch")

QUICK = LagConfig(
    width=24, epochs=12, rate=5e-3, frames=6, vertices=128, garments=1, stride=1, held_out=0.25, fewest=150, most=400
)
BRIEF = replace(QUICK, epochs=3, frames=2, vertices=64, most=200)
"""Its error falls in each epoch, so that the last one is what is kept."""


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    root = tmp_path_factory.mktemp("swaying")
    for name in made.SMALL:
        made.swaying(root / name, name)
    return [root / name for name in made.SMALL]


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    """Three garments in two clips: a garment and a clip to learn from, one of each to choose by."""
    root = tmp_path_factory.mktemp("few")
    for name in (names := list(made.SMALL)[:3]):
        made.swaying(root / name, name, made.CLIPS[:2])
    return [root / name for name in names]


@pytest.fixture(scope="module")
def fitted(folders):
    return KIND.fit(open_collection(folders), QUICK)


def test_sides_share_neither_subject_nor_garment(folders):
    sides = split_takes(open_collection(folders), 0.25)
    assert sum(map(len, sides.values())) == len(made.SMALL) * len(made.CLIPS)
    kinds = {name: ({e.row.subject for e in each}, {e.dataset for e in each}) for name, each in sides.items()}
    assert not kinds["train"][0] & kinds["new_clip"][0] and not kinds["train"][1] & kinds["new_garment"][1]
    assert not kinds["train"][0] & kinds["both_new"][0] and not kinds["train"][1] & kinds["both_new"][1]
    assert all(sides.values())


def test_it_learns_what_trails_on_garments_and_clips_never_seen(fitted):
    for name in ("train", "new_clip", "new_garment", "both_new"):
        assert fitted.figures[f"{name}_mm"] < 0.7 * fitted.figures[f"{name}_skinned_mm"], name
    names = fitted.weights.relatives.names
    assert set(names) < set(made.SMALL) and len(names) == fitted.figures["garments"] >= 2


def test_garments_that_skinning_misses_less_count_more(folders, tmp_path):
    from hemline.animators.coarse.fit.split_frames import SplitFrames
    from hemline.animators.coarse.fit.walk import TakeWalk
    from hemline.animators.lag.fit.fit_lag import scales
    from hemline.animators.lag.fit.lag_samples import garment_samples
    from hemline.animators.lag.fit.lag_training import LagObjective, TorchLagNet

    data = open_collection(folders)
    frames = SplitFrames.of(data, {"train": data.clips()[::4]}, TakeWalk(QUICK.size, 4), tmp_path)
    samples = garment_samples(frames, "train")
    missed = np.array([np.linalg.norm(each.displacements(), axis=2).mean() for each in samples])
    net, losses = TorchLagNet(8, *scales(samples), 0), {}
    for evenness in (0.0, 1.0):
        config = replace(QUICK, evenness=evenness, unknown=1e-9, mirrored=False, edge_weight=0.0)
        objective = LagObjective(net, samples, [], config)
        firsts = [
            next(i for i, (garment, _) in enumerate(objective._chunks) if garment == k) for k in range(len(samples))
        ]
        each = [objective.loss(np.array([i]), np.random.default_rng(0), slice(None)).item() for i in firsts]
        losses[evenness] = np.array(each)
    # a device keeps the frames as the file does: the loss has the same bits, mirrored frames and edges included
    objective = LagObjective(net, samples, [], QUICK)
    read = objective.loss(np.arange(4), np.random.default_rng(1), slice(None)).item()
    for each in objective.train:
        each.keep()
    assert objective.loss(np.arange(4), np.random.default_rng(1), slice(None)).item() == read
    # the network begins as skinning, so what it misses is what skinning misses, and shares of it are alike
    ratio = losses[1.0] / losses[0.0] * (missed + 1e-3)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-4)
    assert missed.max() > 1.1 * missed.min()


def test_a_fit_that_was_killed_comes_to_the_same_bits(few, tmp_path, monkeypatch):
    class Killed(Exception):
        pass

    def kill(stage, done, total):
        if stage == "learn" and done == 1:
            raise Killed

    # a minute passes whenever the trainer looks at its clock: it keeps every epoch
    monkeypatch.setattr("hemline.learning.fit.trainer.time", SimpleNamespace(monotonic=count(0, 60).__next__))
    data, seen = open_collection(few), []
    with pytest.raises(Killed):
        KIND.fit(data, BRIEF, progress=kill, checkpoints=tmp_path / "half")
    again = KIND.fit(data, BRIEF, progress=lambda *at: seen.append(at), checkpoints=tmp_path / "half")
    assert [at for at in seen if at[0] == "learn"] == [("learn", 2, 3), ("learn", 3, 3)]
    for name, array in KIND.fit(data, BRIEF).weights.arrays().items():
        np.testing.assert_array_equal(again.weights.arrays()[name], array, err_msg=name)


def test_it_goes_on_from_a_model_with_takes_of_one_garment(folders, fitted, tmp_path):
    fitted.save(tmp_path / "before.safetensors")
    config = replace(QUICK, start=str(tmp_path / "before.safetensors"), epochs=4, rate=1e-3, width=64)
    after = KIND.fit(open_dataset(folders[-1]), config)
    assert after.weights.config.width == QUICK.width, "the sizes are those of what is gone on from"
    assert after.figures["new_clip_mm"] < 0.7 * after.figures["new_clip_skinned_mm"]
    assert after.weights.relatives.names == [*fitted.weights.relatives.names, "dress-light"]


def test_only_a_model_of_its_kind_is_gone_on_from(folders):
    with pytest.raises(BadInput, match=r"option 'start' must name a lag model; got 'cape', a model of ropes"):
        KIND.fit(open_dataset(folders[0]), replace(QUICK, start="cape"))


def test_too_few_garments_are_refused(folders):
    with pytest.raises(BadDataset, match=r"a split by garment needs three"):
        KIND.fit(open_collection(folders[:2]), QUICK)


@pytest.fixture(scope="module")
def graph(folders):
    config = SwingarConfig(
        epochs=4, groups=40, rate=3e-3, garments=1, frames=8, stride=4, held_out=0.25, fewest=100, most=200
    )
    return swingar.KIND.fit(open_collection(folders), config)


def test_the_graph_network_learns_what_trails(graph):
    assert graph.figures["held_out_mm"] < 0.7 * graph.figures["held_out_skinned_mm"]


def test_the_graph_network_is_played_and_read_back(graph, tmp_path):
    graph.save(tmp_path / "graph.safetensors")
    read = hemline.load(tmp_path / "graph.safetensors")
    body, garment = bodies.load("anny24").shaped(), made.small("tshirt-light")
    motion, ends = body.placed(hemline.motions.load("walk")), []
    for each in (graph, read):
        worn = each.animator_for(garment, body)
        state = worn.start(body.posed(motion[0]))
        for frame in range(1, 6):
            state, vertices = worn.step(state, body.posed(motion[frame]), 1 / motion.fps)
        ends.append(vertices)
    np.testing.assert_array_equal(*ends)
    moved = np.linalg.norm(ends[0] - motion[5].translation, axis=1)
    assert np.isfinite(moved).all() and moved.max() < 1.5


def test_options_of_one_network_are_not_those_of_the_other():
    for kind, name in ((lag.KIND, "alpha"), (lag.KIND, "groups"), (swingar.KIND, "width"), (swingar.KIND, "precision")):
        with pytest.raises(TypeError, match=name):
            kind.Config(**{name: 1})
