"""Rest drapes of many shapes."""

import numpy as np
import pytest

from hemline import bodies, garments, sim
from hemline.datasets import open_dataset
from hemline.errors import BadBody, BadDataset


@pytest.fixture(scope="module")
def napkin():
    return garments.make_cape(bodies.load("anny24").shaped(), rows=20, columns=40, name="napkin")


@pytest.fixture(scope="module")
def draped(napkin, tmp_path_factory):
    folder = tmp_path_factory.mktemp("rests") / "data"
    return folder, sim.produce_rests(folder, napkin, sim.axis_shapes(1))


def test_agentdress_has_seventeen_shapes():
    shapes = sim.axis_shapes(4)
    assert len(shapes) == len(set(shapes)) == 17 and shapes[0] == ()
    padded = np.array([(*shape, *[0.0] * (4 - len(shape))) for shape in shapes])
    assert (np.count_nonzero(padded, axis=1) <= 1).all()
    assert sorted(padded[1:].sum(axis=1).tolist()) == sorted(4 * [-2.0, -1.0, 1.0, 2.0])


def test_each_shape_has_its_own_drape_and_keeps_its_betas(draped):
    folder, rests = draped
    dataset = open_dataset(folder)
    for betas, rest in zip(sim.axis_shapes(1), rests, strict=True):
        assert rest.kind == "rest" and len(rest.vertices) == 1 and rest.figures["inside"] == 0
        assert np.array_equal(dataset.rest(betas).vertices, rest.vertices)
    assert not dataset.clips()
    # the first beta is stature: the taller the body, the higher the cloth on its shoulders
    tops = {rest.betas[0]: rest.vertices[0, :, 1].max() for rest in rests}
    assert [tops[beta] for beta in sorted(tops)] == sorted(tops.values())


def test_it_is_what_the_garment_settled_there_is(draped, napkin):
    shaped = bodies.load("anny24").shaped((-2.0,))
    alone = sim.rest_drape(napkin, shaped)
    assert np.array_equal(draped[1][1].vertices, alone.vertices)


def test_what_is_there_is_not_made_again(draped, napkin):
    folder, _ = draped
    stamps = {path: path.stat().st_mtime_ns for path in (folder / "takes").iterdir()}
    done = []
    sim.produce_rests(folder, napkin, sim.axis_shapes(1), report=lambda *count: done.append(count))
    assert {path: path.stat().st_mtime_ns for path in (folder / "takes").iterdir()} == stamps
    assert done == [(number, 5) for number in range(1, 6)]


def test_a_shape_on_which_it_cannot_settle_says_why_and_the_others_are_there(napkin, tmp_path, monkeypatch):
    # gravity upwards and no time to settle: what hangs on nothing is found by its drape, here by a hostile setting
    settings = sim.SimSettings(gravity=(0.0, -1e7, 0.0), halvings=0)
    found = sim.produce_rests(tmp_path / "data", napkin, [()], settings=settings)
    assert isinstance(found[0], str) and "napkin" in found[0]
    assert not open_dataset(tmp_path / "data").rows()


def test_bad_betas_are_refused_before_anything_is_written(napkin, tmp_path):
    with pytest.raises(BadBody):
        sim.produce_rests(tmp_path / "data", napkin, [(), (np.nan,)])
    assert not (tmp_path / "data").exists()


def test_another_garments_dataset_is_refused(draped):
    other = garments.make_cape(bodies.load("anny24").shaped(), rows=12, columns=26, name="towel")
    with pytest.raises(BadDataset):
        sim.produce_rests(draped[0], other, [()])
