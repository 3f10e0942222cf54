"""Materials: what ships is physical, what is wrong is refused."""

import math
import re
from pathlib import Path

import pytest

from hemline.errors import BadGarment
from hemline.garments import MATERIALS, Material


def test_paper_is_that_of_agentdress():
    paper = MATERIALS["paper"]
    assert (paper.density, paper.young, paper.bending, paper.friction) == (0.1, 30.0, 1e-5, 0.3)


def test_the_page_says_what_the_code_has():
    page = (Path(__file__).parents[2] / "docs" / "materials.md").read_text()
    header, *rows = re.findall(r"^\| (?:name|" + "|".join(MATERIALS) + r") \|.*$", page, re.MULTILINE)
    names = [cell.split()[0] for cell in header.strip("| ").split(" | ")]
    said = {}
    for row in rows:
        name, *cells = row.strip("| ").split(" | ")
        said[name] = {key: float(cell.split()[0]) for key, cell in zip(names[1:], cells, strict=True)}
        assert all(cell.split()[1] in "mcp" for cell in cells)
    assert said == {name: {k: v for k, v in m.as_dict().items() if k != "name"} for name, m in MATERIALS.items()}


@pytest.mark.parametrize("name", sorted(MATERIALS))
def test_a_hanging_metre_stretches_by_a_few_percent_and_drapes_over_centimetres(name):
    material = MATERIALS[name]
    assert material.name == name
    assert 0.005 < material.density * 9.81 * 1.0 / material.young < 0.04
    # bending length: how far a strip reaches out before it hangs
    assert 0.01 < (material.bending / (material.density * 9.81)) ** (1 / 3) < 0.03


def test_a_table_starts_from_its_base():
    own = Material.of({"base": "cotton", "density": 0.2})
    assert own.density == 0.2 and own.young == MATERIALS["cotton"].young and own.name == "cotton (changed)"
    assert Material.of(own.as_dict()) == own
    assert Material.of({"density": 1, "young": 2, "poisson": 0, "bending": 0}).name == "own"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("coton", "unknown material; got 'coton'; did you mean 'cotton'"),
        (3, "must be a name or a table"),
        ({"base": "silk", "denisty": 0.1}, "no constant 'denisty'; got 0.1; did you mean 'density'"),
        ({"density": 0.1}, "lacks a constant; got young, poisson, bending"),
        ({"base": "silk", "young": "stiff"}, "young must be a finite number"),
        ({"base": "silk", "young": math.nan}, "young must be a finite number"),
        ({"base": "silk", "young": True}, "young must be a finite number"),
        ({"base": "silk", "density": 0}, "density must be positive"),
        ({"base": "silk", "bending": -1}, "bending must not be negative"),
        ({"base": "silk", "poisson": 1.0}, "poisson must lie between"),
        ({"base": "silk", "density": 70}, r"density must be at most 20 kg/m\^2; got 70.0; give it in SI units"),
        ({"base": "silk", "young": 5e9}, "young must be at most 1e\\+06 N/m; got 5000000000.0"),
        ({"base": "silk", "bending": 20}, "bending must be at most 1 N m; got 20.0"),
        ({"base": "silk", "damping": 3}, "damping must be at most 1 s; got 3.0"),
        ({"base": "silk", "friction": 40}, "friction must be at most 10; got 40.0"),
    ],
)
def test_refuses(content, message):
    with pytest.raises(BadGarment, match=message):
        Material.of(content)
