"""The page of a garment that was watched: what is inside, what looks out, what is stretched, by clip and by body."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

PAGE = """\
# AgentDress watched: {garment}

Written by `python -m papers.agentdress.watched {garment} CLIP... --shapes {count} --seconds {seconds:g}` at
commit {commit}, on {machine}: {clips} clips on {count} bodies, {frames} frames, limbs lifted out of each other first
(`untangle`). Body 0 is the mean one; the others have four random betas.

| what | asked | mean | worst clip and body |
|---|---|---|---|
| vertices inside after the projection, not pinched, worst frame, % | 0 | {inside_after} |
| covered skin in front of the cloth that can be seen, % | 0.1 | {through} |
| the same, worst frame, % | | {through_worst} |
| covered skin that another part of the body hides, in front of the cloth, % | | {through_buried} |
| vertices inside before the projection, % | | {inside_before} |
| pinched vertices, % | | {pinched} |
| stretch of edges, p99, % | | {stretch_p99} |
| edges more than 30 % too long, % | | {long} |
| edges that go through the cloth, % | | {crossing} |

![The worst frames](watched-{garment}.png)

The frames whose edges are stretched most, from both sides.

## By clip
| clip | inside before, % | pinched, % | skin seen, % | stretch p99, % | long, % | novelty, worst |
|---|---|---|---|---|---|---|
{by_clip}

## By body
| betas | inside before, % | pinched, % | skin seen, % | stretch p99, % | long, % |
|---|---|---|---|---|---|
{by_shape}
"""

NAMES = (
    "inside_after", "through", "through_worst", "through_buried", "inside_before", "pinched", "stretch_p99", "long",
    "crossing",
)  # fmt: skip
OF_A_CLIP = ("inside_before", "pinched", "through", "stretch_p99", "long")


def write_page(row: dict[str, Any], folder: Path) -> str:
    """Write the page; returns the text."""
    rows, shapes = row["rows"], row["shapes"]
    clips = list(dict.fromkeys(each["clip"] for each in rows))
    text = PAGE.format(
        **{key: row[key] for key in ("garment", "commit", "machine", "seconds")},
        **{name: _mean_and_worst(rows, name) for name in NAMES},
        clips=len(clips),
        count=len(shapes),
        frames=sum(each["frames"] for each in rows),
        by_clip="\n".join(_of_clip(clip, [each for each in rows if each["clip"] == clip]) for clip in clips),
        by_shape="\n".join(
            _line(", ".join(f"{beta:g}" for beta in betas), [each for each in rows if each["shape"] == number])
            for number, betas in enumerate(shapes)
        ),
    )
    (folder / f"watched-{row['garment']}.md").write_text(text)
    return text


def _mean_and_worst(rows: Sequence[dict[str, Any]], name: str) -> str:
    worst = max(rows, key=lambda each: each[name])
    mean = float(np.mean([each[name] for each in rows]))
    return f"{mean:.3g} | {worst[name]:.3g} ({worst['clip']}, body {worst['shape']})"


def _line(title: str, rows: Sequence[dict[str, Any]]) -> str:
    return f"| {title} | " + " | ".join(f"{np.mean([each[name] for each in rows]):.2g}" for name in OF_A_CLIP) + " |"


def _of_clip(clip: str, rows: Sequence[dict[str, Any]]) -> str:
    return f"{_line(clip, rows)} {max(each['novelty_worst'] for each in rows):.2f} |"
