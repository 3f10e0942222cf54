"""Which garments lie close to the body."""

import pytest

from hemline import garments
from hemline.bodies import load


@pytest.mark.parametrize(
    ("name", "close"),
    [
        ("tshirt-light", True),
        ("longsleeve-light", True),
        ("trousers-light", True),
        ("dress-light", False),
        ("skirt-light", False),
        ("cape-light", False),
    ],
)
def test_shirts_and_trousers_lie_close_and_what_hangs_does_not(name, close):
    assert garments.lies_close(garments.load(name), load("anny24").shaped()) == close
