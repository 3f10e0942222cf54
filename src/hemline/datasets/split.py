"""Cut takes into training, validation and test, by the person who was captured."""

import hashlib
from collections.abc import Sequence
from typing import Any


def split_by_subject(rows: Sequence[Any], fractions: tuple[float, float, float]) -> dict[str, list[Any]]:
    """Split rows so that a subject is on one side only.

    Subjects are taken in the order of a hash of their name, and each goes to the side that is furthest behind its
    share of the frames. With fewer than three subjects their clips are split in the same way; a single clip trains.

    Args:
        rows: Rows with `subject`, `clip` and `clip_frames`.
        fractions: Shares of the frames for `train`, `val`, `test`.

    Returns:
        The rows of `train`, `val`, `test`, in the order given.
    """
    by_subject = len({row.subject for row in rows}) >= 3
    frames: dict[str, int] = {}
    for row in rows:
        group = row.subject if by_subject else row.clip
        frames[group] = frames.get(group, 0) + row.clip_frames
    side = _sides(frames, fractions)
    parts: dict[str, list[Any]] = {"train": [], "val": [], "test": []}
    for row in rows:
        parts[side[row.subject if by_subject else row.clip]].append(row)
    return parts


def _sides(frames: dict[str, int], fractions: tuple[float, float, float]) -> dict[str, str]:
    names = ("train", "val", "test")
    have = dict.fromkeys(names, 0)
    side: dict[str, str] = {}
    # large groups first, so that the small shares are not overrun; equal ones by hash
    order = sorted(frames, key=lambda group: (-frames[group], hashlib.sha256(group.encode()).hexdigest()))
    total = sum(frames.values()) or 1
    for group in order:
        behind = [fractions[i] - (have[n] + frames[group]) / total for i, n in enumerate(names)]
        chosen = names[max(range(3), key=lambda i: behind[i])]
        side[group] = chosen
        have[chosen] += frames[group]
    for wanted in ("test", "val"):
        if len(order) >= 3 and wanted not in side.values():
            last = next(group for group in reversed(order) if side[group] == "train")
            side[last] = wanted
    return side
