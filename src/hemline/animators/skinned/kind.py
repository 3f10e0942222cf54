"""The registry entry of `skinned`."""

from typing import Any, NoReturn

from hemline.animators.lazy_kind import LazyKind
from hemline.errors import BadInput

from .config import SkinnedConfig


def refuse_fit(data: Any, config: SkinnedConfig | None = None, **options: Any) -> NoReturn:
    """Refuses to fit an animator that learns nothing.

    Raises:
        BadInput: Always.
    """
    raise BadInput("animator 'skinned' learns nothing", "a fit", "play it: hemline animate skinned --garment GARMENT")


KIND = LazyKind("skinned", SkinnedConfig, fit=refuse_fit, of="hemline.animators.skinned.wearable:read_skinned")
