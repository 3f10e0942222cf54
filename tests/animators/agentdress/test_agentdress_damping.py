"""How late a course is, and which time constant the residual chooses."""

import numpy as np
import pytest

from papers.agentdress.damping import lateness, longest_low

FPS = 30.0


def course(late: float) -> np.ndarray:
    """Two vertices that swing, so many seconds late."""
    times = np.arange(90) / FPS - late
    swing = np.stack([np.sin(4 * times), 0.3 * np.cos(7 * times), 0 * times], axis=1)
    return np.stack([swing, -0.5 * swing], axis=1)


@pytest.mark.parametrize("late", [0.0, 0.05, 0.11])
def test_a_course_that_is_late_is_found_so(late):
    assert lateness(course(late), course(0.0), FPS) == pytest.approx(late, abs=2e-3)


def test_a_first_order_filter_is_late_by_its_time_constant():
    seconds, plain = 0.06, course(0.0)
    kept, damped = np.exp(-1 / FPS / seconds), [plain[0]]
    for frame in plain[1:]:
        damped.append(kept * damped[-1] + (1 - kept) * frame)
    # in frames the filter is one frame ahead of its continuous self by half a frame
    assert lateness(np.array(damped), plain, FPS) == pytest.approx(seconds - 0.5 / FPS, abs=0.01)


def test_the_longest_time_constant_with_a_low_residual_is_chosen():
    assert longest_low({0.0: 10.0, 0.1: 9.0, 0.2: 9.05, 0.5: 12.0, 1.0: 15.0}) == 0.2
    assert longest_low({0.0: 9.0, 0.1: 10.0}) == 0.0
