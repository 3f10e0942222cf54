import pytest

from hemline.errors import BadInput
from hemline.sim import SimSettings


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"substeps": 0}, "setting 'substeps' must be positive; got 0; give"),
        ({"fps": float("nan")}, "setting 'fps' must be positive; got nan"),
        ({"thickness": -0.001}, "setting 'thickness' must not be negative; got -0.001"),
        ({"solver_share": 1.5}, "setting 'solver_share' must be a fraction; got 1.5"),
        ({"wind": (0.0, 1.0)}, "setting 'wind' must be a vector"),
    ],
)
def test_settings_that_make_no_sense_are_refused(change, message):
    with pytest.raises(BadInput, match=message):
        SimSettings(**change)
