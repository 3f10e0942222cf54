"""Runs for the fits of loose garments: as fast as people run, without a jump where a cycle begins anew."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hemline import motions
from hemline.models.make.runs import FPS, RUNS, SECONDS, Run, make_runs
from hemline.motions import longest_clean, write

FOLDER = Path(__file__).resolve().parents[2] / "../shared/data/motion"


def speed_m_s(motion):
    way = np.linalg.norm(np.diff(motion.translations[:, [0, 2]], axis=0), axis=1)
    return float(way.mean() * motion.fps)


def test_a_run_has_the_speeds_asked_for_and_keeps_its_subject(tmp_path):
    """The recording is the run that ships, twice as long: here its speed is known."""
    recorded = replace(motions.load("run"), name="running_7", source="")
    write(tmp_path / "running_7.safetensors", recorded)
    slow, same = make_runs(Run("running_7.safetensors", (0.8, 1.0)), tmp_path)
    assert same.seconds + 1 / FPS >= SECONDS
    assert speed_m_s(same) == pytest.approx(speed_m_s(recorded), rel=0.02)
    assert speed_m_s(slow) == pytest.approx(0.8 * speed_m_s(same), rel=0.01)
    assert slow.name != same.name
    assert motions.subject_of(slow) == motions.subject_of(same) == motions.subject_of(recorded) == "running"


@pytest.mark.skipif(not FOLDER.is_dir(), reason=f"needs the recordings in {FOLDER}")
def test_all_runs_are_fast_and_have_no_jumps():
    for run in RUNS:
        for motion in make_runs(run, FOLDER):
            assert 2.0 < speed_m_s(motion) < 3.5, motion.name
            assert longest_clean(motion) == (0, len(motion)), motion.name
