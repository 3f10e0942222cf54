import numpy as np
import pytest

from hemline import motions
from hemline.motions.shipped import SHIPPED


def test_six_excerpts_ship_in_less_than_a_megabyte():
    assert set(motions.names()) == {"run", "walk", "jump", "turn", "kick", "dance"}
    assert SHIPPED.stat().st_size < 1_000_000


@pytest.mark.parametrize("name", motions.names())
def test_an_excerpt_is_ready_to_play_and_says_whose_it_is(name):
    motion = motions.load(name)
    assert motion.name == name
    assert motion.fps == 30
    assert 4 <= motion.seconds <= 8
    assert motion.source.startswith("CMU ")
    assert "NSF EIA-0196217" in motion.licence
    assert motions.longest_clean(motion) == (0, len(motion))
    number = motion.source.split()[1].rstrip(",")
    notice = SHIPPED.with_name("excerpts.NOTICE.md").read_text()
    assert f"| {name} | {number} |" in notice


def test_each_excerpt_is_of_another_subject():
    assert len({motions.subject_of(name) for name in motions.names()}) == 6


def test_excerpts_move_as_their_names_say():
    def turned(motion):
        w, y = motion.rotations[:, 0, 0].astype(float), motion.rotations[:, 0, 2].astype(float)
        return np.abs(np.diff(np.unwrap(2 * np.arctan2(y, w), period=2 * np.pi))).sum()

    height = {name: motions.load(name).translations[:, 1] for name in motions.names()}
    assert np.degrees(turned(motions.load("turn"))) > 360
    assert np.degrees(turned(motions.load("walk"))) < 360
    assert np.ptp(height["jump"]) > 0.3
    assert np.ptp(height["walk"]) < 0.15
    kick = (
        motions.load("kick").rotations[:, motions.JOINT_NAMES.index("left_hip")],
        motions.load("kick").rotations[:, 2],
    )
    raised = [np.degrees(2 * np.arccos(np.abs(hip[:, 0]).clip(0, 1))).max() for hip in kick]
    assert max(raised) > 80
