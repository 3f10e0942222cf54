"""How long the edges of a played garment may be: about as long as in its drapes."""

import numpy as np
import pytest

import hemline
from hemline.animators.agentdress.bounds import DEFAULT_STRETCH_LIMIT, LEAST_STRETCH_LIMIT, MOST_STRETCH_LIMIT
from hemline.animators.agentdress.fit.drape_stretch import stretch_limit
from hemline.animators.agentdress.fit.fit import fit
from hemline.datasets import create
from hemline.errors import BadModel
from hemline.files import read_tensors, write_tensors
from hemline.meshes import rest_lengths
from hemline.playback.player.layers import stretch_limits
from tests.animators import formula_garment as made


def dataset_of(folder, scales):
    """One drape in the rest pose for each scale of the garment at rest."""
    data = create(folder, made.shirt())
    for number, scale in enumerate(scales):
        take = made.anchor(made.random_pose(number))
        vertices = (scale * made.rest_garment()).astype(np.float32)[None]
        data.add(take.__class__(**{**vars(take), "vertices": vertices}))
    return data


def longest_at_rest():
    """The garment at rest with all edges at least as long as on the pattern."""
    garment = made.shirt()
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    rest = made.rest_garment()
    return rest * (lengths / np.linalg.norm(rest[edges[:, 0]] - rest[edges[:, 1]], axis=1)).max()


@pytest.mark.parametrize("scale", [1.08, 1.12])
def test_the_limit_is_the_usual_length_in_the_drapes(tmp_path, scale):
    """Drapes that are larger than the garment at rest in all directions have all edges longer by that factor."""
    rest = longest_at_rest()
    factor = float(np.linalg.norm(rest) / np.linalg.norm(made.rest_garment()))
    data = dataset_of(tmp_path / "data", [scale * factor] * 3)
    assert stretch_limit(data, rest) == pytest.approx(scale, abs=1e-3)


def test_the_limit_is_kept_between_bounds(tmp_path):
    rest = longest_at_rest()
    assert stretch_limit(dataset_of(tmp_path / "small", [0.9]), rest) == LEAST_STRETCH_LIMIT
    assert stretch_limit(dataset_of(tmp_path / "large", [9.0]), rest) == MOST_STRETCH_LIMIT


def test_it_is_in_the_file_and_files_without_it_have_the_former_one(tmp_path):
    model = fit(made.make_dataset(tmp_path / "data", 6))
    assert LEAST_STRETCH_LIMIT <= model.stretch_limit <= MOST_STRETCH_LIMIT
    assert stretch_limits(model) == (model.stretch_limit,)
    path = tmp_path / "shirt.safetensors"
    model.save(path)
    assert hemline.load(path).stretch_limit == model.stretch_limit
    arrays, metadata = read_tensors(path, "model")
    own = dict(metadata["agentdress"])
    del own["stretch_limit"]
    write_tensors(path, arrays, metadata | {"agentdress": own})
    assert hemline.load(path).stretch_limit == DEFAULT_STRETCH_LIMIT
    for wrong in (0.5, 2.5, "long", None):
        write_tensors(path, arrays, metadata | {"agentdress": own | {"stretch_limit": wrong}})
        with pytest.raises(BadModel, match="stretch limit"):
            hemline.load(path)


def test_shipped_shirts_have_the_former_limit_and_ropes_have_none():
    assert stretch_limits(hemline.load("tshirt-light")) == (DEFAULT_STRETCH_LIMIT,)
    assert stretch_limits(hemline.load("cape")) == (0.0,)
    worn = hemline.animators.together([hemline.load("trousers-light"), hemline.load("cape")])
    assert stretch_limits(worn) == (DEFAULT_STRETCH_LIMIT, 0.0)
