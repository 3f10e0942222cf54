"""The registry entry of `live`."""

from typing import Any, NoReturn

from hemline.animators.lazy_kind import LazyKind
from hemline.errors import BadInput

from .config import LiveConfig


def refuse_fit(data: Any, config: LiveConfig | None = None, **options: Any) -> NoReturn:
    """Refuses to fit an animator that simulates.

    Raises:
        BadInput: Always.
    """
    raise BadInput("animator 'live' learns nothing", "a fit", "play it: hemline animate live --garment GARMENT")


KIND = LazyKind("live", LiveConfig, fit=refuse_fit, of="hemline.animators.live.wearable:read_live")
