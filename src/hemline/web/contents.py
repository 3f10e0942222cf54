"""The contents of a page as arrays and metadata: a body, models and clips."""

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
"""Frames per second of the clips of a page."""


@dataclass(frozen=True)
class PageContents:
    """Contents of a page.

    Attributes:
        arrays: Arrays by name.
        metadata: All other data, as JSON values.
    """

    arrays: Mapping[str, np.ndarray]
    metadata: Mapping[str, Any]


def page_contents(
    models: Mapping[str, Animator | Wearable], clips: Mapping[str, Motion], body: ShapedBody
) -> PageContents:
    """Collects the contents of a page of models, without data that only a fit or the simulator needs.

    Args:
        models: Rope chains and close-fitting garments, by the names that the page shows.
        clips: Motions, by the names that the page shows; they are resampled to 30 frames per second.
        body: The body that wears the garments. Close-fitting garments follow other shapes of it, rope chains do not.

    Raises:
        BadInput: There is no model or no clip, or a page cannot play a model.
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
    clip_entries = []
    for index, (name, clip) in enumerate(clips.items()):
        clip = clip.resample(CLIP_FPS)
        arrays |= {f"clips.{index}.rotations": clip.rotations, f"clips.{index}.translations": clip.translations}
        clip_entries.append({"name": name, "fps": clip.fps, "leg_length": clip.leg_length})
    metadata = {
        "kind": "page",
        "models": [{"name": name, **part.metadata} for name, part in zip(models, parts, strict=True)],
        "clips": clip_entries,
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
    """Returns the licences of body, models and motions, each once."""
    texts: Sequence[str] = [body.body.licence]
    texts += [text for model in models for text in model.licences]
    texts += [": ".join(filter(None, (clip.source, clip.licence))) for clip in clips]
    return list(dict.fromkeys(text for text in texts if text))
