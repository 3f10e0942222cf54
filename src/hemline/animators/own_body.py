"""Which body an animator is for."""

from hemline.bodies import ShapedBody
from hemline.errors import BadInput

from .base import Animator


def refuse_other_body(animator: Animator, shaped: ShapedBody) -> None:
    """Refuse a body that an animator was not fitted on; any shape of its own is welcome.

    Args:
        animator: The animator.
        shaped: The body that is to wear its garment.

    Raises:
        BadInput: Another body.
    """
    if shaped.body.hash != animator.body_hash:
        raise BadInput(
            f"the model of '{animator.garment.name}' was fitted on body {animator.body_name} ({animator.body_hash})",
            f"{shaped.body.name} ({shaped.body.hash})",
            "use that body, or fit the garment again",
        )
