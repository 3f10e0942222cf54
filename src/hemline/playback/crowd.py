"""Many garments on many bodies in one call."""

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
    """The next frame of each player; each thread that kernels may use steps one player at a time.

    Compiled code runs without Python's lock, so that two players take two cores. Each frame has the bits that
    `Player.step` alone gives. Within a step kernels use one thread, so that this works on every machine, whichever
    pool of threads numba has there.

    Args:
        players: Garments on bodies, all alike or all different.
        states: A state of each.
        poses: A pose of each.
        dt: Time since the states [s].

    Returns:
        The states after, and the frames, in the order of the players.

    Raises:
        BadInput: Another number of states or poses than of players; or as `Player.step`.
    """
    if not len(players) == len(states) == len(poses):
        raise BadInput(
            "a crowd needs a state and a pose for each player",
            f"{len(players)} players, {len(states)} states, {len(poses)} poses",
            "give one of each",
        )

    def stepped(player: Player, state: PlayerState, pose: Pose) -> tuple[PlayerState, Frame]:
        with at_most(1):
            return player.step(state, pose, dt)

    done = list(_pool(threads()).map(stepped, players, states, poses))
    return [state for state, _ in done], [frame for _, frame in done]


@cache
def _pool(count: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count, thread_name_prefix="hemline-crowd")
