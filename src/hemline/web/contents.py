"""All that a page plays, as arrays and metadata: one body, some models, some clips."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hemline.animators import Animator, Wearable
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.ropes import AnimatorRopes
from hemline.bodies import ShapedBody
from hemline.errors import BadInput
from hemline.motions import Motion

from .agentdress_part import agentdress_part
from .body_part import body_part
from .parts import PagePart
from .ropes_part import ropes_part

CLIP_FPS = 30.0
"""Frames a second of the clips of a page."""


@dataclass(frozen=True)
class PageContents:
    """What `page_contents` gives.

    Attributes:
        arrays: By name; a page reads them as they are.
        metadata: What is no array.
    """

    arrays: Mapping[str, np.ndarray]
    metadata: Mapping[str, Any]


def page_contents(
    models: Mapping[str, Animator | Wearable], clips: Mapping[str, Motion], body: ShapedBody
) -> PageContents:
    """What a page of these models holds; what only a fit or the simulator needs is left out.

    Args:
        models: Rope chains and close-fitting garments, by the names that the page shows.
        clips: Motions, by the names that the page shows; resampled to 30 frames a second, placed by the page.
        body: Who wears them. Close-fitting garments can be shown on its other shapes, rope chains on this one.

    Raises:
        BadInput: No model or no clip, or a model that a page cannot play.
        BadModel: A model was fitted on another kind of body.
    """
    if not models or not clips:
        missing = "model" if not models else "clip"
        raise BadInput(f"a page needs at least one {missing}", "none", "name one, such as cape on walk")
    parts = [_part(name, model, body) for name, model in models.items()]
    reshaped = any("beta_range" in part.metadata for part in parts)
    arrays = {f"body.{name}": array for name, array in body_part(body, shapes=reshaped).items()}
    for index, part in enumerate(parts):
        arrays |= {f"models.{index}.{name}": array for name, array in part.arrays.items()}
    told = []
    for index, (name, clip) in enumerate(clips.items()):
        clip = clip.resampled(CLIP_FPS)
        arrays |= {f"clips.{index}.rotations": clip.rotations, f"clips.{index}.translations": clip.translations}
        told.append({"name": name, "fps": clip.fps, "leg_length": clip.leg_length})
    metadata = {
        "kind": "page",
        "models": [{"name": name, **part.metadata} for name, part in zip(models, parts, strict=True)],
        "clips": told,
        "notices": _notices(models.values(), clips.values(), body),
    }
    return PageContents(arrays, metadata)


def _part(name: str, model: Animator | Wearable, body: ShapedBody) -> PagePart:
    if isinstance(model, AnimatorRopes):
        return ropes_part(model, body)
    if isinstance(model, AnimatorAgentDress):
        return agentdress_part(model, body)
    raise BadInput(
        "a page plays rope chains and close-fitting garments",
        f"'{name}' of kind '{model.name}'",
        f"write a GLB for the web instead: hemline animate {name} -m CLIP -o FILE.glb",
    )


def _notices(models: Any, clips: Any, body: ShapedBody) -> list[str]:
    """Whose body, models and motions these are, each once."""
    texts: Sequence[str] = [body.body.licence]
    texts += [text for model in models for text in model.licences]
    texts += [": ".join(filter(None, (clip.source, clip.licence))) for clip in clips]
    return list(dict.fromkeys(text for text in texts if text))
