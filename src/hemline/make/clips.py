"""The clips that a garment is simulated on while a model is made."""

from collections.abc import Sequence

from hemline import motions
from hemline.errors import BadInput
from hemline.motions import Motion
from hemline.sim import ClipRequest

from .plan import SPEEDS

CHECK_CLIP = "dance"
"""Clip on which methods are compared; no method is fitted to it."""
FPS = 30.0
"""Frame rate of simulated clips [frames/s]."""
ALL_FRAMES = 10**9
"""More frames than all clips have at all speeds."""
LEAST_SECONDS = 1.0
"""Shortest part of a clip that is simulated [s]."""


def open_clips(names: Sequence[str], up: str | None = None) -> list[Motion]:
    """Returns the longest part without jumps of each clip.

    If none is named, they are all shipped ones but `CHECK_CLIP`, and sections of recordings of many people.

    Args:
        names: The clips.
        up: Axis of the clips that points up, as for `motions.open_motion`; None to find it.

    Raises:
        BadMotion: A clip cannot be read.
        BadInput: A clip is named twice, or is the one that methods are compared on.
    """
    if not names:
        shipped = [motions.load(name) for name in motions.names() if name != CHECK_CLIP]
        return [clean_part(motion) for motion in (*shipped, *motions.varied_clips())]
    chosen = list(names)
    for name in chosen:
        if name == CHECK_CLIP or chosen.count(name) > 1:
            cure = f"name each clip once, and not '{CHECK_CLIP}', on which methods are compared"
            raise BadInput("clips must differ", name, cure)
    return [clean_part(motions.open_motion(name, up=up)) for name in chosen]


def clean_part(motion: Motion) -> Motion:
    """Returns the longest part of a motion without jumps, at the rate of simulated clips."""
    first, end = motions.longest_clean(motion)
    return motion[first:end].resample(FPS)


def posed_clips(clips: Sequence[Motion]) -> list[Motion]:
    """Returns the clips from which poses are taken: those that are simulated, and varied poses of many people."""
    return [*clips, motions.varied_poses()]


def requests(clips: Sequence[Motion], frames: int) -> list[ClipRequest]:
    """Returns parts of clips that have about this number of frames together.

    Each clip gives a part of the same length, from its start. If all frames of all clips are not enough, the clips are
    used again at other speeds (`SPEEDS`).

    Args:
        clips: The clips.
        frames: Number of frames wanted.
    """
    found: list[ClipRequest] = []
    for speed in SPEEDS:
        left = frames - sum(len(request.motion) for request in found)
        if left < LEAST_SECONDS * FPS:
            break
        versions = [clip.at_speed(speed) for clip in clips]
        found += [
            ClipRequest(version[: max(2, count)], motions.subject_of(clip))
            for clip, version, count in zip(clips, versions, _share_out([len(v) for v in versions], left), strict=True)
        ]
    return found


def _share_out(lengths: Sequence[int], total: int) -> list[int]:
    """Returns how many of each length are taken, so that shorter ones are taken whole and the others are cut alike."""
    limit, left, count = 0, total, len(lengths)
    for length in sorted(lengths):
        limit = left // count
        if length > limit:
            break
        left, count, limit = left - length, count - 1, length
    return [min(length, max(limit, 0)) for length in lengths]
