"""Wind, for the animators that know it."""

from dataclasses import replace

from hemline.animators import Animator
from hemline.animators.live import AnimatorLive
from hemline.animators.ropes import AnimatorRopes


def takes_wind(animator: Animator) -> bool:
    """Whether wind moves its garment."""
    return isinstance(animator, AnimatorLive | AnimatorRopes)


def with_wind(animator: Animator, wind: tuple[float, float, float]) -> Animator:
    """The same animator in a wind; its States go on with it. Unchanged where it knows none.

    Args:
        animator: Any.
        wind: In the world [m/s].
    """
    if isinstance(animator, AnimatorLive):
        return replace(animator, config=replace(animator.config, wind=wind))
    if isinstance(animator, AnimatorRopes):
        constants = replace(animator.ropes.constants, wind=wind)
        return replace(animator, ropes=animator.ropes.with_constants(constants))
    return animator
