"""Loops a clip of walking or running seamlessly."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from hemline.errors import BadMotion

from .motion import Motion
from .quaternions import Quaternion, angle, continuous, inverse, multiply, normalise, rotate, slerp

_UP = np.array([0.0, 1, 0])


def seamless(
    motion: Motion, *, seconds: float, fps: float, cycle_s: tuple[float, float] = (0.5, 1.4), blend_s: float = 0.15
) -> Motion:
    r"""Repeats the cycle of a clip whose ends match best, advancing by its travel and heading.

    The cycle of $p$ frames starts at the frame $a$ where poses $a + k$ and $a + p + k$ agree best over a short window.
    With $T$ the turn about the vertical and the horizontal travel of a cycle, its first frames are blended from
    $T^{-1} x_{a+p+k}$, which continue its end, into $x_{a+k}$; round $c$ is the cycle moved by $T^c$.

    Args:
        motion: A clip that is a little longer than one cycle.
        seconds: Least length of the result [s].
        fps: Rate of the result, which must divide the rate of the clip.
        cycle_s: Limits of the length of the cycle [s].
        blend_s: Length of the blend [s].

    Returns:
        A whole number of cycles: the frame after the last would be the first one, moved on.

    Raises:
        BadMotion: The clip is too short, or the rate does not divide its own.
    """
    stride = round(motion.fps / fps)
    if stride < 1 or abs(stride * fps - motion.fps) > 1e-6 * motion.fps:
        raise BadMotion(f"fps must divide the {motion.fps:g} of '{motion.name}'", fps, "resample the clip first")
    blend = round(blend_s * motion.fps)
    shortest, longest = (round(length * motion.fps) for length in cycle_s)
    if len(motion) < shortest + blend + 1:
        got = f"{motion.seconds:.2f} s"
        raise BadMotion(f"'{motion.name}' is too short for a cycle", got, "give a longer clip or a shorter cycle_s")
    start, period = _best_cycle(motion, shortest, min(longest, len(motion) - blend - 1), blend)
    rotations, translations, turn, travel = _blend_cycle(motion, start, period, blend)
    rounds = int(np.ceil(seconds * motion.fps / period))
    rounds += -rounds % (stride // np.gcd(stride, period))
    turned, moved = [rotations], [translations]
    for _ in range(rounds - 1):
        again = turned[-1].copy()
        again[:, 0] = multiply(turn, again[:, 0])
        turned.append(again)
        moved.append(rotate(turn, moved[-1]) + travel)
    note = f"{rounds} rounds of the cycle of {period / motion.fps:.3f} s from frame {start}, blended over {blend_s:g} s"
    return replace(
        motion,
        rotations=continuous(np.concatenate(turned))[::stride],
        translations=np.concatenate(moved)[::stride],
        fps=fps,
        notes=(*motion.notes, note),
    )


def _heading(rotation: Quaternion) -> Quaternion:
    """Returns the turn about the vertical in a rotation."""
    return normalise(rotation * np.array([1.0, 0, 1, 0]))


def _best_cycle(motion: Motion, shortest: int, longest: int, window: int) -> tuple[int, int]:
    rotations = motion.rotations.astype(np.float64)
    rotations[:, 0] = multiply(inverse(_heading(rotations[:, 0])), rotations[:, 0])
    best, found = np.inf, (0, shortest)
    for period in range(shortest, longest + 1):
        apart = angle(multiply(inverse(rotations[:-period]), rotations[period:])) ** 2
        risen = motion.translations[period:, 1] - motion.translations[:-period, 1]
        cost = apart.mean(axis=1) + (risen.astype(np.float64) / motion.leg_length) ** 2
        sums = np.convolve(cost, np.ones(window + 1), mode="valid")
        if sums.min() < best:
            best, found = sums.min(), (int(sums.argmin()), period)
    return found


def _blend_cycle(
    motion: Motion, start: int, period: int, blend: int
) -> tuple[Float[np.ndarray, "frames joints 4"], Float[np.ndarray, "frames 3"], Quaternion, Float[np.ndarray, "3"]]:
    head = slice(start, start + blend + 1)
    tail = slice(start + period, start + period + blend + 1)
    rotations, translations = motion.rotations.astype(np.float64), motion.translations.astype(np.float64)
    turns = multiply(_heading(rotations[tail, 0]), inverse(_heading(rotations[head, 0])))
    turn = normalise(continuous(turns).mean(axis=0))
    travel = (translations[tail] - rotate(turn, translations[head])).mean(axis=0) * (1 - _UP)
    back = rotations[tail].copy()
    back[:, 0] = multiply(inverse(turn), back[:, 0])
    returned = rotate(inverse(turn), translations[tail] - travel)
    fraction = np.linspace(0, 1, blend + 1)
    fraction = fraction**3 * (10 + fraction * (6 * fraction - 15))  # no jump in acceleration
    cycle = slice(start, start + period)
    rotations, translations = rotations[cycle].copy(), translations[cycle].copy()
    rotations[: blend + 1] = slerp(back, rotations[: blend + 1], fraction[:, None])
    translations[: blend + 1] = returned + fraction[:, None] * (translations[: blend + 1] - returned)
    return rotations, translations, turn, travel
