"""Wind for the animators that support it."""

from hemline.animators import Animator, Windy


def takes_wind(animator: Animator) -> bool:
    """Whether wind moves the garment of an animator."""
    return isinstance(animator, Windy)


def with_wind(animator: Animator, wind: tuple[float, float, float]) -> Animator:
    """Returns an animator in another wind; its states remain valid. An animator without wind is returned unchanged.

    Args:
        animator: Any animator.
        wind: Velocity of the air in the world [m/s].
    """
    return animator.in_wind(wind) if isinstance(animator, Windy) else animator
