"""The delay of a sequence, and the time constant that the residual chooses."""

import numpy as np
import pytest

from papers.agentdress.damping import delay, longest_low

FPS = 30.0


def sequence(seconds: float) -> np.ndarray:
    """Returns two vertices that swing with a delay [s]."""
    times = np.arange(90) / FPS - seconds
    swing = np.stack([np.sin(4 * times), 0.3 * np.cos(7 * times), 0 * times], axis=1)
    return np.stack([swing, -0.5 * swing], axis=1)


@pytest.mark.parametrize("seconds", [0.0, 0.05, 0.11])
def test_a_delay_is_measured(seconds):
    assert delay(sequence(seconds), sequence(0.0), FPS) == pytest.approx(seconds, abs=2e-3)


def test_a_first_order_filter_is_delayed_by_its_time_constant():
    seconds, plain = 0.06, sequence(0.0)
    kept, damped = np.exp(-1 / FPS / seconds), [plain[0]]
    for frame in plain[1:]:
        damped.append(kept * damped[-1] + (1 - kept) * frame)
    # in frames the filter is one frame ahead of its continuous self by half a frame
    assert delay(np.array(damped), plain, FPS) == pytest.approx(seconds - 0.5 / FPS, abs=0.01)


def test_the_longest_time_constant_with_a_low_residual_is_chosen():
    assert longest_low({0.0: 10.0, 0.1: 9.0, 0.2: 9.05, 0.5: 12.0, 1.0: 15.0}) == 0.2
    assert longest_low({0.0: 9.0, 0.1: 10.0}) == 0.0
