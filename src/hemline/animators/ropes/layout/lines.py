"""Where chains run on a garment: lines down from its rim, and how deep the bones of each lie."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, FramesOfVertices, Int, Vertices
from hemline.meshes import rigid_bones

from .chart import Chart, Place
from .rim import Rim

_SAMPLES = 2500
"""Vertices that a decomposition looks at."""
_LEAST = 0.5
"""Bones of a line that are nearer than this share of the mean distance become one."""


class Lines(NamedTuple):
    """Lines of constant share of the rim, in order around it."""

    shares: Float[np.ndarray, " chains"]
    between: Float[np.ndarray, " unattached"]
    """Shares of the rim between them, where unattached bones lie."""
    depths: tuple[Float[np.ndarray, " bones"], ...]
    """Distances of the bones of each from the rim, the root's 0 first [m]."""

    @property
    def places(self) -> list[Place]:
        """All bones: unattached ones, then line by line."""
        above = [(float(share), 0.0) for share in self.between]
        return above + [
            (float(share), float(deep)) for share, line in zip(self.shares, self.depths, strict=True) for deep in line
        ]

    @property
    def offsets(self) -> Int[np.ndarray, " chains_and_one"]:
        """The first bone of each line, and one past the last."""
        counts = [len(line) for line in self.depths]
        return (len(self.between) + np.concatenate([[0], np.cumsum(counts)])).astype(np.int32)


def even_lines(chart: Chart, chain_count: int, bone_counts: tuple[int, int]) -> Lines:
    """Lines at even distances on the rim, bones at even distances down to the hem.

    Raises:
        BadGarment: No cloth hangs from a part of the rim.
    """
    shares = (np.arange(chain_count) + (0.0 if chart.rim.closed else 0.5)) / chain_count
    reach = np.array([chart.reach(share, 0.25 / chain_count) for share in shares])
    spacing = reach.mean() / (np.mean(bone_counts) - 1)
    counts = [max(bone_counts[0], round(far / spacing) + 1) for far in reach]
    depths = tuple(np.linspace(0.0, far, count) for far, count in zip(reach, counts, strict=True))
    return Lines(shares, _between(shares, chart.rim), depths)


def decomposed_lines(
    chart: Chart, rest: Vertices, frames: FramesOfVertices, chain_count: int, bone_counts: tuple[int, int]
) -> Lines:
    """Lines and bones where a skinning decomposition of simulated frames puts its rigid bones.

    Each rigid bone lies at the mean place of the vertices that follow it. Those at about the same share of the rim
    become one line, from a root on the rim to the hem, where the swing is widest.

    Args:
        chart: The garment, unrolled.
        rest: The settled drape [m].
        frames: Simulated frames, the motion of the key joint taken off [m].
        chain_count: Lines.
        bone_counts: Fewest and most bones of a line; together the lines get about the mean.

    Raises:
        BadInput: More bones than the garment has vertices for.
        BadGarment: No cloth hangs from a part of the rim.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 3: bones by SSDR, "interconnected vertically". How is not said there.
    """
    known = np.flatnonzero(np.isfinite(chart.distance) & np.isfinite(chart.share))
    some = known[np.linspace(0, len(known) - 1, min(_SAMPLES, len(known))).astype(int)]
    count = round(chain_count * (float(np.mean(bone_counts)) - 1))
    weights = rigid_bones(rest[some], frames[:, some], count).weights
    weights = weights[:, weights.sum(0) > 0]
    weights = weights / weights.sum(0)
    share, depth = _mean_share(chart, some, weights), chart.distance[some] @ weights
    start = even_lines(chart, chain_count, bone_counts)
    shares, owner = _grouped(start.shares, share, chart.rim)
    depths = []
    for index, place in enumerate(shares):
        even = start.depths[index]
        depths.append(_spread(np.sort(depth[owner == index]), chart.reach(float(place), 0.25 / chain_count), even[1]))
    return Lines(shares, _between(shares, chart.rim), tuple(depths))


def _between(shares: Float[np.ndarray, " chains"], rim: Rim) -> Float[np.ndarray, " unattached"]:
    """The middles between neighbours on the rim; its two ends, too, where it is open."""
    if rim.closed:
        return (shares + (np.roll(shares, -1) - shares) % 1 / 2 if len(shares) > 1 else shares + 0.5) % 1
    return np.concatenate([[0.0], (shares[:-1] + shares[1:]) / 2, [1.0]])


def _mean_share(chart: Chart, some: np.ndarray, weights: np.ndarray) -> Float[np.ndarray, " bones"]:
    """The mean share of the rim of what follows each bone, round the rim where it is closed."""
    if not chart.rim.closed:
        return chart.share[some] @ weights
    turned = np.exp(2j * np.pi * chart.share[some]) @ weights
    return np.angle(turned) / (2 * np.pi) % 1


def _grouped(
    start: Float[np.ndarray, " chains"], share: Float[np.ndarray, " bones"], rim: Rim
) -> tuple[Float[np.ndarray, " chains"], Int[np.ndarray, " bones"]]:
    """Bones in groups of about the same share: k-means along the rim; the groups in order around it."""
    middles = start
    for _ in range(50):
        away = rim.difference(share[:, None], middles)
        owner = np.abs(away).argmin(1)
        size = np.maximum(np.bincount(owner, minlength=len(middles)), 1)
        moved = np.bincount(owner, away[np.arange(len(share)), owner], len(middles)) / size
        middles = (middles + moved) % 1 if rim.closed else middles + moved
    order = np.argsort(middles)
    return middles[order], np.argsort(order)[owner]


def _spread(depths: np.ndarray, reach: float, spacing: float) -> Float[np.ndarray, " bones"]:
    """Depths from the rim to the hem, those too near to one another made one."""
    kept = [0.0]
    near: list[float] = []
    for depth in depths[(depths > _LEAST * spacing) & (depths < reach - _LEAST * spacing)]:
        if near and depth - near[0] > _LEAST * spacing:
            kept.append(float(np.mean(near)))
            near = []
        near.append(float(depth))
    if near:
        kept.append(float(np.mean(near)))
    return np.array([*kept, reach])
