"""The terms of recordings that hemline knows, in their owners' words."""

from collections.abc import Iterable

CMU_TERMS = (
    "data from mocap.cs.cmu.edu, created with funding from NSF EIA-0196217; its terms: "
    '"This data is free for use in research projects. You may include this data in commercially-sold products, but '
    'you may not resell this data directly, even in converted form."'
)
"""Of the CMU Graphics Lab Motion Capture Database, as its page states them."""

_AS_IT_WAS_PUT = "free for all uses; data from mocap.cs.cmu.edu, created with funding from NSF EIA-0196217"
"""What takes and models of before hold in its place, which is more than CMU allows."""


def as_stated(texts: Iterable[str]) -> tuple[str, ...]:
    """Terms, each once, in their order, none of them empty; what files of before say of CMU in CMU's own words.

    Args:
        texts: Terms as files hold them.
    """
    return tuple(dict.fromkeys(CMU_TERMS if text == _AS_IT_WAS_PUT else text for text in texts if text))
