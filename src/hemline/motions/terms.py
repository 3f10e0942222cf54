"""Terms of recordings that hemline knows, in their owners' words."""

from collections.abc import Iterable

CMU_TERMS = (
    "data from mocap.cs.cmu.edu, created with funding from NSF EIA-0196217; its terms: "
    '"This data is free for use in research projects. You may include this data in commercially-sold products, but '
    'you may not resell this data directly, even in converted form."'
)
"""Terms of the CMU Graphics Lab Motion Capture Database, as its page states them."""

_FORMER_CMU_TERMS = "free for all uses; data from mocap.cs.cmu.edu, created with funding from NSF EIA-0196217"
"""Terms in older takes and models, which are wider than CMU allows."""


def as_stated(texts: Iterable[str]) -> tuple[str, ...]:
    """Returns terms without duplicates and empty ones, in their order, with former terms of CMU replaced.

    Args:
        texts: Terms as files hold them.
    """
    return tuple(dict.fromkeys(CMU_TERMS if text == _FORMER_CMU_TERMS else text for text in texts if text))
