"""Options of a dataclass: what is refused, and how it is said."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import pytest

from hemline.errors import BadGarment, BadInput
from hemline.options import check_options, fraction, not_negative, options_of, positive


@dataclass(frozen=True)
class Options:
    epochs: int = positive(3)
    columns: int = not_negative(0)
    step: float = positive(0.5)
    weight: float = not_negative(1.0)
    part: float = fraction(0.25)
    shift: float = 0.0
    mirror: bool = True
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    way: Literal["up", "down"] = "up"

    def __post_init__(self) -> None:
        check_options(self)


def test_defaults_and_what_lies_just_within_are_taken():
    assert Options() == Options(3, 0, 0.5, 1.0, 0.25, 0.0, True, (0.0, 0.0, 0.0), "up")
    edge = Options(epochs=1, columns=0, step=5e-324, weight=0.0, part=np.nextafter(1, 0), shift=-1e308, way="down")
    assert edge.part < 1
    # whole numbers are numbers, numpy's too
    assert Options(step=2, weight=np.float32(3), epochs=np.int64(4), wind=(1, 2, 3)).epochs == 4
    assert Options(epochs=10**400).epochs == 10**400


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"epochs": 0}, "option 'epochs' must be positive; got 0; give a whole number above 0"),
        ({"epochs": 1.0}, "option 'epochs' must be a whole number; got 1.0; give a whole number above 0"),
        ({"epochs": True}, "option 'epochs' must be a whole number; got True"),
        ({"columns": -1}, "option 'columns' must not be negative; got -1; give a whole number of at least 0"),
        ({"step": 0.0}, "option 'step' must be positive; got 0.0; give a finite number above 0"),
        ({"step": float("inf")}, "option 'step' must be positive; got inf"),
        ({"weight": float("nan")}, "option 'weight' must not be negative; got nan"),
        ({"weight": "1"}, "option 'weight' must be a finite number; got '1'"),
        ({"weight": True}, "option 'weight' must be a finite number; got True"),
        ({"part": 0.0}, "option 'part' must be a fraction; got 0.0; give a finite number between 0 and 1"),
        ({"part": 1.0}, "option 'part' must be a fraction; got 1.0"),
        ({"shift": float("-inf")}, "option 'shift' must be a finite number; got -inf; give a finite number"),
        ({"mirror": 1}, "option 'mirror' must be a switch; got 1; use true or false"),
        ({"wind": (0.0, 1.0)}, r"option 'wind' must be a vector; got \(0.0, 1.0\); give 3 finite numbers"),
        ({"wind": (0.0, 1.0, float("nan"))}, "option 'wind' must be a vector"),
        ({"wind": 1.0}, "option 'wind' must be a vector"),
        ({"way": "left"}, "option 'way' must be one of a few; got 'left'; use one of up, down"),
        ({"way": ["up"]}, "option 'way' must be one of a few"),
    ],
)
def test_what_is_out_of_type_or_range_is_refused(change, message):
    with pytest.raises(BadInput, match=message):
        replace(Options(), **change)
    with pytest.raises(BadGarment, match=message):
        options_of(Options, change, error=BadGarment)


def test_values_of_a_file_become_options():
    found = options_of(Options, {"epochs": 7, "wind": [1.0, 2.0, 3.0]})
    assert found == Options(epochs=7, wind=(1.0, 2.0, 3.0))
    assert isinstance(found.wind, tuple)


def test_an_unknown_name_is_refused_with_the_nearest():
    with pytest.raises(BadInput, match=r"unknown option 'epoch'; got 2; did you mean 'epochs'\?"):
        options_of(Options, {"epoch": 2})
    with pytest.raises(BadGarment, match="unknown constant 'zzz'; got 2; known: epochs, columns, step"):
        options_of(Options, {"zzz": 2}, "constant", error=BadGarment)


def test_an_error_calls_a_field_what_it_is_told():
    @dataclass(frozen=True)
    class Constants:
        drag: float = not_negative(1.0)

        def __post_init__(self) -> None:
            check_options(self, "rope constant", error=BadGarment)

    with pytest.raises(BadGarment, match="rope constant 'drag' must not be negative"):
        Constants(-1.0)
