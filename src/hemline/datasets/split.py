"""Splits takes into training, validation and test, with each subject on one side only."""

import hashlib
from collections.abc import Sequence
from typing import Any

Fractions = tuple[float, float, float]
"""Fractions of the frames for training, validation and test."""

FRACTIONS: Fractions = (0.8, 0.1, 0.1)
SIDES = ("train", "val", "test")


def split_by_subject(rows: Sequence[Any], fractions: Fractions) -> dict[str, list[Any]]:
    """Splits rows so that each captured person is on one side only.

    With fewer than three subjects, clips are split in the same way; a single clip is used for training.

    Args:
        rows: Rows with `subject`, `clip` and `clip_frames`.
        fractions: Fractions of the frames for `train`, `val`, `test`.

    Returns:
        The rows of `train`, `val`, `test`, in the order given.
    """
    by_subject = len({row.subject for row in rows}) >= 3
    groups = [row.subject if by_subject else row.clip for row in rows]
    return split_by(rows, groups, [row.clip_frames for row in rows], fractions)


def split_by(
    rows: Sequence[Any], groups: Sequence[str], frames: Sequence[int], fractions: Fractions
) -> dict[str, list[Any]]:
    """Splits rows so that each group is on one side only.

    Groups are taken by size, equal ones in the order of a hash of their name, and each goes to the side that is
    furthest behind its fraction of the frames.

    Args:
        rows: Rows.
        groups: Group of each row.
        frames: Number of frames of each row.
        fractions: Fractions of the frames for `train`, `val`, `test`.

    Returns:
        The rows of `train`, `val`, `test`, in the order given.
    """
    total: dict[str, int] = {}
    for group, count in zip(groups, frames, strict=True):
        total[group] = total.get(group, 0) + count
    side = _sides(total, fractions)
    parts: dict[str, list[Any]] = {name: [] for name in SIDES}
    for row, group in zip(rows, groups, strict=True):
        parts[side[group]].append(row)
    return parts


def _sides(frames: dict[str, int], fractions: Fractions) -> dict[str, str]:
    have = dict.fromkeys(SIDES, 0)
    side: dict[str, str] = {}
    # large groups first, so that small sides are not overfilled; equal ones by hash
    order = sorted(frames, key=lambda group: (-frames[group], hashlib.sha256(group.encode()).hexdigest()))
    total = sum(frames.values()) or 1
    for group in order:
        behind = [fractions[i] - (have[n] + frames[group]) / total for i, n in enumerate(SIDES)]
        chosen = SIDES[max(range(3), key=lambda i: behind[i])]
        side[group] = chosen
        have[chosen] += frames[group]
    for wanted in ("test", "val"):
        if len(order) >= 3 and wanted not in side.values():
            last = next(group for group in reversed(order) if side[group] == "train")
            side[last] = wanted
    return side
