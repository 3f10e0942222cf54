"""The body that an animator was fitted on."""

from hemline import bodies
from hemline.bodies import Body, ShapedBody
from hemline.errors import BadInput

from .base import Animator


def own_body(animator: Animator) -> Body:
    """Returns the body that an animator was fitted on. It is read once.

    Args:
        animator: The animator.

    Raises:
        BadBody: No body of that name ships, or its file cannot be read.
    """
    return bodies.load(animator.body_name)


def refuse_other_body(animator: Animator, shaped: ShapedBody) -> None:
    """Refuses a body that an animator was not fitted on. Any shape of its own body is accepted.

    Args:
        animator: The animator.
        shaped: The body that is to wear its garment.

    Raises:
        BadInput: The body is another one.
    """
    if shaped.body.hash != animator.body_hash:
        raise BadInput(
            f"the model of '{animator.garment.name}' was fitted on body {animator.body_name} ({animator.body_hash})",
            f"{shaped.body.name} ({shaped.body.hash})",
            "use that body, or fit the garment again",
        )
