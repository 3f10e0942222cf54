"""What a model file holds, read piece by piece."""

import numpy as np
import pytest

from hemline.errors import BadGarment, BadModel
from hemline.files.contents import AGAIN, array_of, damage_as_bad_model, entry, part

ARRAYS = {"net.bias": np.zeros(3, np.float32), "net.weight.rows": np.ones((3, 2), np.int8), "network": np.zeros(1)}


def test_a_part_is_what_begins_with_its_name_and_a_dot():
    assert set(part(ARRAYS, "net")) == {"bias", "weight.rows"}
    assert part(ARRAYS, "net")["bias"] is ARRAYS["net.bias"]


def test_an_array_is_given_as_it_is():
    assert array_of(ARRAYS, "net.weight.rows", "int8", (3, None)) is ARRAYS["net.weight.rows"]


@pytest.mark.parametrize(
    ("name", "dtype", "shape", "message"),
    [
        ("bias", "float32", (3,), "the model lacks array 'bias'; got 3 others; copy the file again"),
        ("net.bias", "float64", (3,), r"'net.bias' of the model must be float64 \(3,\); got float32 \(3,\)"),
        ("net.bias", "float32", (4,), r"must be float32 \(4,\)"),
        ("net.bias", "float32", (None, 3), r"must be float32 \(any, 3\)"),
    ],
)
def test_an_array_that_is_missing_or_another_is_refused(name, dtype, shape, message):
    with pytest.raises(BadModel, match=message):
        array_of(ARRAYS, name, dtype, shape)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_refused(bad):
    with pytest.raises(BadModel, match="array 'a' of the model must be finite"):
        array_of({"a": np.array([0.0, bad])}, "a", "float64", (2,))


def test_metadata_of_the_type_asked_for():
    assert entry({"name": "cape"}, "name", str) == "cape"
    with pytest.raises(BadModel, match="the model lacks metadata 'name'; got a, b"):
        entry({"b": 1, "a": 2}, "name", str)
    with pytest.raises(BadModel, match="metadata 'name' of the model must be str; got int"):
        entry({"name": 1}, "name", str)


def test_what_damage_raises_becomes_one_error():
    message = f"the skirt is damaged; got KeyError: 'x'; {AGAIN}"
    with pytest.raises(BadModel, match=message), damage_as_bad_model("the skirt"):
        _ = {}["x"]
    with pytest.raises(BadModel, match="the skirt is damaged; got no hem"), damage_as_bad_model("the skirt"):
        raise BadGarment("no hem", "none", "give one")
    with pytest.raises(BadModel, match="^as it was; "), damage_as_bad_model("the skirt"):
        raise BadModel("as it was", "it", "nothing")
    with pytest.raises(ZeroDivisionError), damage_as_bad_model("the skirt"):
        _ = 1 / 0
