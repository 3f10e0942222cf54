"""Lines of chains on a garment, down from its rim, and the depths of the bones on each line."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, FramesOfVertices, Int, Vertices
from hemline.meshes import rigid_bones

from .rim import PinnedRim
from .unroll import Place, UnrolledGarment

SSDR_VERTICES = 2500
"""Number of vertices that a skinning decomposition uses."""
_SMALLEST_SPACING = 0.5
"""Bones of a line that are nearer to each other than this fraction of the even spacing are merged."""


class ChainLines(NamedTuple):
    """Lines of constant fraction of the rim, in order around it."""

    fractions: Float[np.ndarray, " chains"]
    """Fraction of the rim at each line."""
    between: Float[np.ndarray, " unattached"]
    """Fractions of the rim between the lines, where unattached bones lie."""
    depths: tuple[Float[np.ndarray, " bones"], ...]
    """Distances of the bones of each line from the rim, starting with 0 for the root [m]."""

    @property
    def places(self) -> list[Place]:
        """Places of all bones: unattached ones, then line by line."""
        above = [(float(fraction), 0.0) for fraction in self.between]
        return above + [
            (float(fraction), float(deep))
            for fraction, line in zip(self.fractions, self.depths, strict=True)
            for deep in line
        ]

    @property
    def offsets(self) -> Int[np.ndarray, " chains_and_one"]:
        """Index of the first bone of each line, and the number of bones."""
        counts = [len(line) for line in self.depths]
        return (len(self.between) + np.concatenate([[0], np.cumsum(counts)])).astype(np.int32)


def even_lines(unrolled: UnrolledGarment, chain_count: int, bone_counts: tuple[int, int]) -> ChainLines:
    """Returns lines at even distances on the rim, with bones at even distances down to the hem.

    Raises:
        BadGarment: No cloth hangs from a part of the rim.
    """
    fractions = (np.arange(chain_count) + (0.0 if unrolled.rim.closed else 0.5)) / chain_count
    reach = np.array([unrolled.reach(fraction, 0.25 / chain_count) for fraction in fractions])
    spacing = reach.mean() / (np.mean(bone_counts) - 1)
    counts = [max(bone_counts[0], round(far / spacing) + 1) for far in reach]
    depths = tuple(np.linspace(0.0, far, count) for far, count in zip(reach, counts, strict=True))
    return ChainLines(fractions, _between(fractions, unrolled.rim), depths)


def ssdr_lines(
    unrolled: UnrolledGarment, rest: Vertices, frames: FramesOfVertices, chain_count: int, bone_counts: tuple[int, int]
) -> ChainLines:
    """Returns lines and bones where a skinning decomposition of simulated frames puts its rigid bones.

    Each rigid bone lies at the mean place of the vertices that follow it. Bones at about the same fraction of the rim
    become one line, from a root on the rim to the hem, where the swing is widest.

    Args:
        unrolled: The garment, unrolled.
        rest: The settled drape [m].
        frames: Simulated vertices, frame by frame, relative to the key joint [m].
        chain_count: Number of lines.
        bone_counts: Usual numbers of bones of a line; on average the lines get about the mean of both.

    Raises:
        BadInput: The garment has too few vertices for that many bones.
        BadGarment: No cloth hangs from a part of the rim.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 3: bones by SSDR, "interconnected vertically". The paper does not say how.
    """
    known = np.flatnonzero(np.isfinite(unrolled.distance) & np.isfinite(unrolled.fraction))
    some = known[np.linspace(0, len(known) - 1, min(SSDR_VERTICES, len(known))).astype(int)]
    count = round(chain_count * (float(np.mean(bone_counts)) - 1))
    weights = rigid_bones(rest[some], frames[:, some], count).weights
    weights = weights[:, weights.sum(0) > 0]
    weights = weights / weights.sum(0)
    fraction, depth = _mean_fraction(unrolled, some, weights), unrolled.distance[some] @ weights
    start = even_lines(unrolled, chain_count, bone_counts)
    fractions, owner = _group_bones(start.fractions, fraction, unrolled.rim)
    depths = []
    for index, place in enumerate(fractions):
        even = start.depths[index]
        depths.append(
            _bone_depths(np.sort(depth[owner == index]), unrolled.reach(float(place), 0.25 / chain_count), even[1])
        )
    return ChainLines(fractions, _between(fractions, unrolled.rim), tuple(depths))


def _between(fractions: Float[np.ndarray, " chains"], rim: PinnedRim) -> Float[np.ndarray, " unattached"]:
    """Returns the fractions midway between neighbouring lines, and those of the two ends of an open rim."""
    if rim.closed:
        return (fractions + (np.roll(fractions, -1) - fractions) % 1 / 2 if len(fractions) > 1 else fractions + 0.5) % 1
    return np.concatenate([[0.0], (fractions[:-1] + fractions[1:]) / 2, [1.0]])


def _mean_fraction(unrolled: UnrolledGarment, some: np.ndarray, weights: np.ndarray) -> Float[np.ndarray, " bones"]:
    """Returns the mean fraction of the rim of the vertices of each bone, circular where the rim is closed."""
    if not unrolled.rim.closed:
        return unrolled.fraction[some] @ weights
    turned = np.exp(2j * np.pi * unrolled.fraction[some]) @ weights
    return np.angle(turned) / (2 * np.pi) % 1


def _group_bones(
    start: Float[np.ndarray, " chains"], fraction: Float[np.ndarray, " bones"], rim: PinnedRim
) -> tuple[Float[np.ndarray, " chains"], Int[np.ndarray, " bones"]]:
    """Groups bones of about the same fraction by k-means along the rim; the groups are in order around it."""
    middles = start
    for _ in range(50):
        away = rim.difference(fraction[:, None], middles)
        owner = np.abs(away).argmin(1)
        size = np.maximum(np.bincount(owner, minlength=len(middles)), 1)
        moved = np.bincount(owner, away[np.arange(len(fraction)), owner], len(middles)) / size
        middles = (middles + moved) % 1 if rim.closed else middles + moved
    order = np.argsort(middles)
    return middles[order], np.argsort(order)[owner]


def _bone_depths(depths: np.ndarray, reach: float, spacing: float) -> Float[np.ndarray, " bones"]:
    """Returns depths from the rim to the hem; depths too near to one another are averaged."""
    result = [0.0]
    near: list[float] = []
    for depth in depths[(depths > _SMALLEST_SPACING * spacing) & (depths < reach - _SMALLEST_SPACING * spacing)]:
        if near and depth - near[0] > _SMALLEST_SPACING * spacing:
            result.append(float(np.mean(near)))
            near = []
        near.append(float(depth))
    if near:
        result.append(float(np.mean(near)))
    return np.array([*result, reach])
