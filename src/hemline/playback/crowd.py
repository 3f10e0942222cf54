"""Playback of many garments on many bodies in one call."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache

from hemline.compiled import at_most, threads
from hemline.errors import BadInput
from hemline.motions.motion import Pose
from hemline.playback.player.frame import Frame
from hemline.playback.player.player import Player, PlayerState


def crowd(
    players: Sequence[Player], states: Sequence[PlayerState], poses: Sequence[Pose], dt: float
) -> tuple[list[PlayerState], list[Frame]]:
    """Plays the next frame of each player, one player per thread at a time.

    Compiled code runs without Python's global lock, so two players use two cores. Each frame equals that of
    `Player.step`, bit for bit. Within a step kernels use one thread, so this works with every thread pool of numba.

    Args:
        players: Garments on bodies, all alike or all different.
        states: The state of each player.
        poses: The pose of each body.
        dt: Time since the states [s].

    Returns:
        The next states, and the frames, in the order of the players.

    Raises:
        BadInput: The numbers of players, states and poses differ; or see `Player.step`.
    """
    if not len(players) == len(states) == len(poses):
        raise BadInput(
            "a crowd needs a state and a pose for each player",
            f"{len(players)} players, {len(states)} states, {len(poses)} poses",
            "give one of each",
        )

    def step_one(player: Player, state: PlayerState, pose: Pose) -> tuple[PlayerState, Frame]:
        with at_most(1):
            return player.step(state, pose, dt)

    done = list(_pool(threads()).map(step_one, players, states, poses))
    return [state for state, _ in done], [frame for _, frame in done]


@cache
def _pool(count: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count, thread_name_prefix="hemline-crowd")
