"""The shipped cape, played by its own animator: in whole clips no vertex is inside by another library."""

from pathlib import Path

import pytest

import hemline
from hemline import bodies, motions
from tests.collide.projection_samples import inside_count

FOLDER = Path(__file__).resolve().parents[2] / "../shared/data/motion"
CLIPS = sorted(path.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("*.bvh"))
SOME = ("02_05.bvh", "05_11.bvh", "16_31.bvh", "49_02.bvh", "90_30.bvh", "id_unverified/backflip.bvh")
needs_clips = [pytest.mark.data, pytest.mark.skipif(not CLIPS, reason=f"no clips in {FOLDER}")]


@pytest.fixture(scope="module")
def cape():
    return hemline.load("cape")


def count_inside(cape, motion, every=1):
    """Vertices inside in every so many frames of a motion, and how many were moved in all frames."""
    after = moved = 0
    for index, frame in enumerate(hemline.play(cape, bodies.load(cape.body_name).shaped(), motion, pre_roll=0.2)):
        moved += frame.report.moved
        if index % every == 0:
            after += inside_count(frame.body, frame.vertices, frame.report.pinched)
    return after, moved


def recorded(clip, most):
    """The middle of a recording, at 30 frames a second."""
    motion = motions.read(FOLDER / clip).resample(30)
    first = max(0, (len(motion) - most) // 2)
    return motion[first : first + most]


@pytest.mark.slow
@pytest.mark.parametrize("name", motions.names())
def test_no_vertex_is_inside_in_any_frame_of_the_excerpts(cape, name):
    after, moved = count_inside(cape, motions.load(name))
    assert after == 0
    assert moved > 1000


@pytest.mark.parametrize("clip", [pytest.param(clip, marks=needs_clips) for clip in SOME])
def test_no_vertex_is_inside_in_recordings(cape, clip):
    after, moved = count_inside(cape, recorded(clip, most=16), every=2)
    assert after == 0
    assert moved > 1000


@pytest.mark.slow
@pytest.mark.parametrize("clip", [pytest.param(clip, marks=needs_clips) for clip in CLIPS])
def test_no_vertex_is_inside_in_any_recording(cape, clip):
    after, moved = count_inside(cape, recorded(clip, most=90), every=10)
    assert after == 0
    assert moved > 1000
