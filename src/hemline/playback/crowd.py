"""Many garments on many bodies in one call."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache

from hemline.compiled import threads
from hemline.errors import BadInput
from hemline.motions.motion import Pose

from .frame import Frame
from .player import Player, PlayerState


def crowd(
    players: Sequence[Player], states: Sequence[PlayerState], poses: Sequence[Pose], dt: float
) -> tuple[list[PlayerState], list[Frame]]:
    """The next frame of each player; players share the threads that kernels may use.

    Compiled code runs without Python's lock, so that two players take two cores. Each frame has the bits that
    `Player.step` alone gives.

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
    moments = zip(players, states, poses, strict=True)
    done = list(_pool(threads()).map(lambda moment: moment[0].step(moment[1], moment[2], dt), moments))
    return [state for state, _ in done], [frame for _, frame in done]


@cache
def _pool(count: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count, thread_name_prefix="hemline-crowd")
