"""The model that a command plays, with the garment that it wears."""

import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline.animators import Animator, Bounded, MaterialAware, Related, Wearable, load, together
from hemline.bodies import ShapedBody
from hemline.errors import BadInput, BadModel, HemlineWarning

from .garment import open_garment
from .progress import note

if TYPE_CHECKING:
    from hemline.garments import Garment

STRANGE = 4.0
"""How far from the nearest garment of the fit another one is strange, in their own spacing."""


def body_of(model: Animator | Wearable, body: str | None, betas: tuple[float, ...]) -> ShapedBody:
    """The body to play on: the one named, else the one that the model was fitted on.

    Args:
        model: What was loaded.
        body: Name or file of a body; None: the model's own, `anny24` where it was fitted on many garments.
        betas: Its shape.

    Raises:
        BadBody: No such body, or too many betas.
    """
    from hemline import bodies

    own = model.body_name if isinstance(model, Animator) else "anny24"
    return bodies.load(body or own).shaped(betas)


def open_model(
    name: str,
    garment: str | None,
    body: str | None,
    betas: tuple[float, ...],
    *,
    over: tuple[str, ...] = (),
    material: str | None = None,
    clamp: bool = False,
) -> tuple[Animator, ShapedBody]:
    """A model from a file or by name, and the body to play it on.

    Args:
        name: A model file, or the name of a shipped model.
        garment: The garment that a model of many garments is to wear, tried on where it does not sit on the body; None
            for a model that has its own.
        body: As for `body_of`.
        betas: As for `body_of`.
        over: What is worn over it, from the skin outwards: garments, for a model of many; else models, each of one.
        material: What the garment, not those over it, is made of; None: what the model or the garment says.
        clamp: Move betas into the range in which the model is believed.

    Raises:
        BadModel: As `animators.load`.
        BadBody: As `body_of`.
        BadInput: A model of many garments without one, or a garment for a model that has its own; a garment over
            itself; or a model that has no such range, or that knows no other materials.
        BadGarment: No such material.
    """
    from hemline.garments import worn_together

    model = _made_of(load(name), material)
    shaped = body_of(model, body, betas)
    if clamp:
        shaped = _clamped(model, shaped)
    if isinstance(model, Wearable):
        if garment is None:
            raise BadInput(f"model '{name}' needs a garment to wear", "none", "name one with --garment")
        _check_each_once((garment, *over))
        each = [_worn(one, shaped) for one in (garment, *over)]
        return model.worn_by(worn_together(each) if over else each[0], shaped), shaped
    if garment is not None:
        cure = "leave --garment out, or fit an animator to that garment"
        raise BadInput(f"model '{name}' has its own garment, {model.garment.name}", garment, cure)
    _check_each_once((name, *over))
    worn: Animator = together([model, *map(_with_its_own, over)]) if over else model
    return worn, shaped


def _made_of(model: Animator | Wearable, material: str | None) -> Animator | Wearable:
    if material is None:
        return model
    if not isinstance(model, MaterialAware):
        cure = "leave --material out; play the garment by 'live', or fit to takes of that material"
        what = f"{model.name} plays garments of the material that it learned"
        raise BadInput(what, f"--material {material}", cure)
    return model.in_material(material)


def _check_each_once(names: Sequence[str]) -> None:
    for at, name in enumerate(names):
        if name in names[:at]:
            raise BadInput("a garment cannot be worn over itself", f"'{name}' twice", "name another one with --over")


def _with_its_own(name: str) -> Animator:
    from hemline import garments

    try:
        model = load(name)
    except BadModel:
        if name not in garments.names():
            raise
        cure = "fit an animator to that garment, or play both by live: --garment INNER --over OUTER"
        what = "over a model with a garment of its own other models are worn"
        raise BadInput(what, f"garment {name}", cure) from None
    if isinstance(model, Wearable):
        cure = f"name models with a garment of their own, or play them all by '{name}': --garment INNER --over OUTER"
        raise BadInput("a model that takes any garment is not worn over another model", f"--over {name}", cure)
    return model


def _worn(garment: str, shaped: ShapedBody) -> "Garment":
    """A garment on a body; a mesh that does not sit on it is tried on, for this time."""
    with tempfile.TemporaryDirectory() as folder:
        return open_garment(garment, shaped, Path(folder), tryon=True, dressed=True)


def _clamped(model: Animator | Wearable, shaped: ShapedBody) -> ShapedBody:
    if not isinstance(model, Bounded):
        raise BadInput("--clamp-betas needs a model that knows its range of betas", model.name, "leave it out")
    return shaped.body.shaped(np.clip(shaped.betas, *model.beta_range))


def say_relatives(animator: Animator) -> None:
    """Say which garments of the fit are most like this one; warn where none is.

    Args:
        animator: What will play.
    """
    if not isinstance(animator, Related) or not animator.relatives:
        return
    told = ", ".join(f"{name} ({far:.1f})" for name, far in animator.relatives)
    note(f"garments of the fit most like '{animator.garment.name}': {told}; 1 is as near as they are to each other")
    name, far = animator.relatives[0]
    if far > STRANGE:
        cure = f"look at it closely, or play it with 'live'; or fit {animator.name} to more garments"
        what = f"'{animator.garment.name}' is unlike all garments that {animator.name} was fitted to"
        warnings.warn(HemlineWarning(what, f"{far:.1f} times as far from the nearest, {name}", cure), stacklevel=2)


def warn_new_poses(animator: Animator, novelties: Sequence[float | None]) -> None:
    """Warn of the frames whose poses are beyond all those that an animator was fitted to.

    Args:
        animator: What played.
        novelties: Of each frame.
    """
    if not isinstance(animator, Bounded):
        return
    each = np.array(novelties, np.float64)
    beyond = int((each > animator.novelty_limit).sum())
    if beyond:
        warnings.warn(
            HemlineWarning(
                f"{beyond} of {len(each)} frames are in poses unlike all that '{animator.garment.name}' was fitted to "
                f"(novelty above {animator.novelty_limit:g})",
                f"{each.max():.2f} in frame {int(each.argmax())}",
                "expect errors several times as large there, or fit it to anchors from such clips, too",
            ),
            stacklevel=2,
        )
