"""The lag network: what plays against what is trained, its files, and what it refuses."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

import hemline
from hemline import animators, bodies, garments
from hemline.animators.coarse.features.columns import DYNAMIC, STATIC
from hemline.animators.coarse.proxy_on_body import Cells
from hemline.animators.coarse.relatives import Relatives
from hemline.animators.coarse.wearable import CoarseWearable
from hemline.animators.coarse.weights import Weights
from hemline.animators.lag import KIND, LagConfig
from hemline.animators.lag.lag_net import LagNet, layer_sizes
from hemline.animators.lag.lag_network import LagNetwork
from hemline.errors import BadDataset, BadInput, BadModel
from hemline.files import read_tensors, write_tensors
from hemline.garments import coarser_garment

WIDTH = 16


def weights(seed: int = 0) -> Weights:
    random, sizes = np.random.default_rng(seed), layer_sizes(STATIC.count + DYNAMIC.count, WIDTH)
    drawn = {name: 0.2 * random.normal(size=size).astype(np.float32) for name, size in sizes.items()}
    biases = {name: 0.1 * random.normal(size=size[1]).astype(np.float32) for name, size in sizes.items()}
    known = Relatives(["a", "b", "c"], random.normal(size=(3, 256)).astype(np.float32))
    network = LagNetwork(LagNet(drawn, biases))
    return Weights(KIND, LagConfig(width=WIDTH), network, known, {"train_mm": 2.0}, ["a licence"]).as_stored()


@pytest.fixture(scope="module")
def cape():
    return coarser_garment(garments.load("cape-light"), 0.15)[0]


def by_formula(net, static, features, cells):
    """The formula of `LagNet`, vertex by vertex."""

    def layer(name, inputs):
        return np.maximum(inputs @ net.weights[name] + net.biases[name], 0)

    h = layer("second", layer("first", np.concatenate([static, features], axis=1).astype(np.float64)))
    c = layer("cell", np.array([h[cells.cell == each].mean(axis=0) for each in range(cells.count)]))
    c = layer("all_cells", np.concatenate([c, np.tile(c.mean(axis=0), (len(c), 1))], axis=1))
    heard = np.einsum("vk,vkw->vw", cells.shares, c[cells.near])
    return layer("third", np.concatenate([h, heard], axis=1)) @ net.weights["fourth"] + net.biases["fourth"]


def test_what_plays_is_the_formula_and_what_was_trained(cape):
    torch = pytest.importorskip("torch")
    from hemline.animators.lag.fit.lag_training import TorchCells, TorchLagNet

    random, cells = np.random.default_rng(1), Cells.of(cape)
    static, features = (
        random.normal(size=(len(cape.vertices), n)).astype(np.float32) for n in (STATIC.count, DYNAMIC.count)
    )
    mean, spread = (
        random.normal(size=STATIC.count + DYNAMIC.count),
        random.uniform(0.5, 2, STATIC.count + DYNAMIC.count),
    )
    trained = TorchLagNet(WIDTH, mean.astype(np.float32), spread.astype(np.float32), seed=4)
    with torch.no_grad():
        trained.weights["fourth"].normal_(generator=torch.Generator().manual_seed(5))
        expected = trained(
            torch.from_numpy(static), torch.from_numpy(features)[None], TorchCells.of(cells, torch.device("cpu"))
        )[0].numpy()
    net = trained.to_runtime()
    played = net.displacements(net.static(static), features, cells)
    np.testing.assert_allclose(played, expected, atol=2e-5 * np.abs(expected).max())
    np.testing.assert_allclose(played, by_formula(net, static, features, cells), atol=2e-5 * np.abs(expected).max())


def test_products_of_half_precision_come_near_to_those_of_single(cape):
    torch = pytest.importorskip("torch")
    from hemline.animators.lag.fit.lag_training import TorchCells, TorchLagNet

    random, cells, outs = np.random.default_rng(6), TorchCells.of(Cells.of(cape), torch.device("cpu")), []
    static, features = (
        random.normal(size=(len(cape.vertices), n)).astype(np.float32) for n in (STATIC.count, DYNAMIC.count)
    )
    for precision in ("float32", "bfloat16"):
        zero, one = (
            np.zeros(STATIC.count + DYNAMIC.count, np.float32),
            np.ones(STATIC.count + DYNAMIC.count, np.float32),
        )
        net = TorchLagNet(WIDTH, zero, one, 4, precision)
        with torch.no_grad():
            net.weights["fourth"].normal_(generator=torch.Generator().manual_seed(5))
            outs.append(net(torch.from_numpy(static), torch.from_numpy(features)[None], cells).numpy())
    apart = np.linalg.norm(outs[1] - outs[0]) / np.linalg.norm(outs[0])
    assert 0 < apart < 0.02


def test_a_fit_begins_at_skinning():
    pytest.importorskip("torch")
    from hemline.animators.lag.fit.lag_training import TorchLagNet

    net = TorchLagNet(
        WIDTH, np.zeros(STATIC.count + DYNAMIC.count, np.float32), np.ones(STATIC.count + DYNAMIC.count, np.float32), 0
    ).to_runtime()
    assert (net.weights["fourth"] == 0).all() and (net.biases["fourth"] == 0).all()


def test_the_order_of_vertices_does_not_matter(cape):
    net, random, cells = weights().network.net, np.random.default_rng(2), Cells.of(cape)
    static, features = (
        random.normal(size=(len(cape.vertices), n)).astype(np.float32) for n in (STATIC.count, DYNAMIC.count)
    )
    order = random.permutation(len(static))
    other = Cells(cells.cell[order], cells.near[order], cells.shares[order])
    one = net.displacements(net.static(static), features, cells)
    np.testing.assert_allclose(
        net.displacements(net.static(static[order]), features[order], other), one[order], atol=1e-4
    )


def test_no_weight_is_sized_by_a_garment(cape):
    for shape in ((len(array), *array.shape[1:]) for array in weights().network.net.weights.values()):
        assert len(cape.vertices) not in shape


def test_it_travels_in_a_file_without_a_garment_and_with_one(cape, tmp_path):
    made, body = CoarseWearable(weights()), bodies.load("anny24").shaped()
    made.save(tmp_path / "lag.safetensors")
    read = hemline.load(tmp_path / "lag.safetensors")
    assert isinstance(read, animators.Wearable) and not isinstance(read, animators.Animator)
    for name, array in made.weights.arrays().items():
        np.testing.assert_array_equal(read.weights.arrays()[name], array)
    worn = read.animator_for(cape, body)
    worn.save(tmp_path / "worn.safetensors")
    again = hemline.load(tmp_path / "worn.safetensors")
    motion = body.placed(hemline.motions.load("run"))
    ends = []
    for each in (worn, again):
        state = each.start(body.posed(motion[0]))
        for frame in range(1, 5):
            state, vertices = each.step(state, body.posed(motion[frame]), 1 / motion.fps)
        ends.append(vertices)
    np.testing.assert_array_equal(*ends)
    assert again.weights.licences == ["a licence"]


@pytest.mark.parametrize("name", ["weight.first", "bias.cell", "weight.fourth"])
@pytest.mark.parametrize("damage", ["missing", "longer", "nan"])
def test_damaged_weights_are_refused(tmp_path, name, damage):
    path = tmp_path / "lag.safetensors"
    CoarseWearable(weights()).save(path)
    arrays, metadata = read_tensors(path, "model")
    if damage == "missing":
        del arrays[name]
    elif damage == "longer":
        arrays[name] = np.concatenate([arrays[name], arrays[name]])
    else:
        arrays[name] = np.full_like(arrays[name], np.nan)
    write_tensors(path, arrays, metadata)
    with pytest.raises(BadModel, match=name):
        hemline.load(path)


def test_a_cut_file_and_another_version_are_refused(tmp_path):
    path = tmp_path / "lag.safetensors"
    CoarseWearable(weights()).save(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(BadModel):
        hemline.load(path)
    path.write_bytes(whole)
    arrays, metadata = read_tensors(path, "model")
    write_tensors(path, arrays, metadata | {"lag": {"version": 99}})
    with pytest.raises(BadModel, match=r"reads version 1 of lag; got version 99"):
        hemline.load(path)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"width": 0}, "option 'width' must be positive"),
        ({"edge_weight": -1.0}, "option 'edge_weight' must not be negative"),
        ({"held_out": 0.0}, "option 'held_out' must be positive"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, complaint):
    with pytest.raises(BadInput, match=complaint):
        LagConfig(**options)


def test_options_travel_in_json():
    config = replace(LagConfig(), width=WIDTH)
    assert LagConfig(**json.loads(json.dumps(asdict(config)))) == config


def test_one_garment_is_not_enough(tmp_path):
    from hemline.datasets import create

    with pytest.raises(BadDataset, match=r"fitted to many garments; got cape-light; name several datasets, or go on"):
        KIND.fit(create(tmp_path / "cape", garments.load("cape-light")))


def test_the_nearest_relative_of_a_garment_of_the_fit_is_itself(cape):
    others = [coarser_garment(garments.load(name), 0.08)[0] for name in ("skirt-light", "tshirt-light", "dress-light")]
    found = Relatives.of_garments([*others, cape]).nearest(cape)
    assert len(found) == 3 and found[0] == (cape.name, pytest.approx(0, abs=1e-3))
    assert [far for _, far in found] == sorted(far for _, far in found) and found[1][1] > 0.5


@pytest.mark.parametrize(("spacing", "strange"), [(1e-3, True), (10.0, False)])
def test_a_garment_unlike_all_of_the_fit_is_warned_of(cape, capsys, spacing, strange):
    from hemline.cli.model import report_relatives
    from hemline.errors import HemlineWarning

    known = Relatives(["a", "b"], np.array([np.zeros(256), np.full(256, spacing)], np.float32))
    worn = CoarseWearable(replace(weights(), relatives=known)).animator_for(cape, bodies.load("anny24").shaped())
    if strange:
        with pytest.warns(HemlineWarning, match=r"'cape-light' is unlike all garments that lag was fitted to"):
            report_relatives(worn)
    else:
        report_relatives(worn)
    assert "garments of the fit most like 'cape-light': " in capsys.readouterr().err
