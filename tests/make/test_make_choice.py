"""The rule that chooses a method."""

from dataclasses import replace

import pytest

from hemline.make.choice import choose, excess, faults
from hemline.make.trial import Trial

TRUTH = Trial("truth", stretch_p99=10.0, stretch_worst=20.0, limbs_through=1.0)
GOOD = Trial("ropes", error_mm=20.0, stretch_p99=12.0, stretch_worst=25.0, limbs_through=1.0, frame_ms=3.0)

WRONG = {
    "inside": (0.01, "inside the body"),
    "stretch_p99": (18.5, "stretched by 18 %|stretched by 19 %"),
    "stretch_worst": (51.0, "worst frame by 51 %"),
    "skin_seen": (0.2, "0.20 % of the covered skin"),
    "limbs_through": (1.6, "limbs go through"),
}


def test_the_smallest_error_wins_among_sound_and_fast_methods():
    lag = replace(GOOD, method="lag", error_mm=30.0)
    live = replace(GOOD, method="live", error_mm=10.0, frame_ms=40.0)
    assert choose([lag, GOOD, live], TRUTH, 10.0) is GOOD
    assert choose([lag, GOOD, live], TRUTH, 50.0) is live


def test_of_errors_that_are_alike_the_fastest_wins():
    quick = replace(GOOD, method="lag", error_mm=20.9, frame_ms=1.0)
    assert choose([GOOD, quick], TRUTH, 10.0) is quick
    assert choose([GOOD, replace(quick, error_mm=21.1)], TRUTH, 10.0) is GOOD


@pytest.mark.parametrize("name", WRONG)
def test_each_limit_makes_a_method_unsound(name):
    value, phrase = WRONG[name]
    bad = replace(GOOD, error_mm=1.0, **{name: value})
    (fault,) = faults(bad, TRUTH)
    assert any(part in fault for part in phrase.split("|"))
    assert excess(bad, TRUTH) > 1 == excess(GOOD, TRUTH)
    assert choose([bad, GOOD], TRUTH, 10.0) is GOOD


def test_a_sound_method_is_chosen_even_if_it_is_slow():
    torn = replace(GOOD, method="lag", error_mm=5.0, stretch_worst=300.0)
    live = replace(GOOD, method="live", frame_ms=40.0)
    assert choose([torn, live], TRUTH, 10.0) is live


def test_of_unsound_methods_the_one_nearest_to_the_limits_wins():
    torn = replace(GOOD, method="lag", error_mm=18.0, stretch_worst=500.0)
    nearly = replace(GOOD, method="ropes", error_mm=20.0, stretch_worst=55.0)
    assert choose([torn, nearly], TRUTH, 10.0) is nearly


def test_methods_that_failed_are_never_chosen():
    failed = Trial("agentdress", failed="no pose came to rest")
    assert faults(failed, TRUTH) == ["no pose came to rest"]
    assert choose([failed, replace(GOOD, error_mm=500.0)], TRUTH, 10.0).method == "ropes"
    assert choose([failed], TRUTH, 10.0) is None
