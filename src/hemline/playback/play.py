"""Playback of a fitted garment on a moving body, from the first frame of a motion to the last."""

import math
from collections.abc import Iterator

from hemline.animators.base import Animator
from hemline.arrays import FramesOfVertices
from hemline.bodies.body import ShapedBody
from hemline.collide import Guarantee
from hemline.errors import BadInput
from hemline.motions.motion import Motion
from hemline.playback.player.frame import Frame
from hemline.playback.player.layers import THICKNESS_MM
from hemline.playback.player.player import Player
from hemline.playback.player.time_step import LONGEST_STEP


def play(
    animator: Animator,
    body: ShapedBody,
    motion: Motion,
    *,
    fps: float | None = 30.0,
    pre_roll: float = 1.0,
    guarantee: Guarantee = "exact",
    measure: bool = False,
    untangle: bool = False,
    placed: bool = False,
    truth: FramesOfVertices | None = None,
    whole: bool = True,
    detail: float = 1.0,
    thickness_mm: float = THICKNESS_MM,
) -> Iterator[Frame]:
    """Plays a motion, frame by frame.

    The garment is settled in the first frame: the animator runs for `pre_roll` seconds before it.

    Args:
        animator: A fitted animator.
        body: A body, of any shape, of the same kind as the one that the animator was fitted on.
        motion: A motion of any frame rate and leg length.
        fps: Frames per second; None for the rate of the motion. Below four the garment takes steps of at most 0.25 s
            between frames.
        pre_roll: Time in the first pose before the first frame [s].
        guarantee: See `Player.prepare`.
        measure: See `Player.prepare`.
        untangle: Whether limbs are lifted out of each other first.
        placed: Whether the motion is already adapted to this body (`ShapedBody.placed`).
        truth: Simulated vertices (frames, verts, 3) [m], which drive the animator instead of its own dynamics; one row
            per frame of the motion as it is played.
        whole: See `Player.prepare`.
        detail: See `Player.prepare`.
        thickness_mm: See `Player.prepare` [mm].

    Yields:
        One `Frame` per frame.

    Raises:
        BadModel: The animator was fitted on another kind of body.
        BadInput: `fps`, `detail` or `thickness_mm` is out of its range, or the ground truth has another length.
    """
    _check_rate(fps)
    options = {"guarantee": guarantee, "measure": measure, "whole": whole, "detail": detail}
    player = Player.prepare(animator, body, placed=True, thickness_mm=thickness_mm, **options)
    motion = motion if placed else body.placed(motion)
    yield from play_on(player, motion, fps=fps, pre_roll=pre_roll, untangle=untangle, truth=truth)


def play_on(
    player: Player,
    motion: Motion,
    *,
    fps: float | None = 30.0,
    pre_roll: float = 1.0,
    untangle: bool = False,
    truth: FramesOfVertices | None = None,
) -> Iterator[Frame]:
    """Plays a motion with a player that was prepared before, frame by frame.

    Args:
        player: A player for motions that are placed (`Player.prepare(..., placed=True)`).
        motion: A motion that is placed on the body of the player.
        fps: As for `play`.
        pre_roll: As for `play` [s].
        untangle: As for `play`.
        truth: As for `play` (frames, verts, 3) [m].

    Yields:
        One `Frame` per frame.

    Raises:
        BadInput: `fps` is out of its range, or the ground truth has another length.
    """
    _check_rate(fps)
    rate = motion.fps if fps is None else fps
    steps = 1 if truth is not None else math.ceil(1 / (rate * LONGEST_STEP))
    motion = motion if steps * rate == motion.fps else motion.resample(steps * rate)
    motion = player.body.untangle_motion(motion) if untangle else motion
    if truth is not None and len(truth) != len(motion):
        raise BadInput(
            "the ground truth must have one row a frame",
            f"{len(truth)} for {len(motion)} frames",
            "use the take's motion",
        )
    dt = 1.0 / motion.fps
    state = player.start(motion[0], pre_roll=pre_roll if truth is None else 0.0, dt=dt)
    for index in range(len(motion)):
        if truth is None:
            state, frame = player.step(state, motion[index], dt)
        else:
            state, frame = player.follow(state, motion[index], dt, truth[index])
        if index % steps == 0:
            yield frame


def _check_rate(fps: float | None) -> None:
    if fps is not None and not 0 < fps <= 1000:
        raise BadInput("fps must lie between 0 and 1000", fps, "leave it out for 30")
