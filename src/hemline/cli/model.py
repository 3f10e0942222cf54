"""Opens the model that a command plays, dressed in its garment."""

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hemline.animators import Animator, Bounded, MaterialAware, Related, Wearable, load, together
from hemline.bodies import ShapedBody
from hemline.errors import BadInput, BadModel, HemlineWarning

from .progress import note, try_on_progress
from .wind import CALM, Wind, in_wind

if TYPE_CHECKING:
    from hemline.garments import Garment

UNFAMILIAR = 4.0
"""Distance from the nearest garment of the fit above which a warning is given, in units of their mutual spacing."""


def body_of(model: Animator | Wearable, body: str | None, betas: tuple[float, ...]) -> ShapedBody:
    """Returns the body to play on: the given one, or the one that the model was fitted on.

    Args:
        model: The model.
        body: Name or file of a body; None for the model's own, which is `anny24` if the model plays any garment.
        betas: Shape coefficients of the body.

    Raises:
        BadBody: There is no such body, or there are too many betas.
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
    wind: Wind = CALM,
    clamp: bool = False,
) -> tuple[Animator, ShapedBody]:
    """Opens a model from a file or by name, and the body to play it on.

    Args:
        name: A model file, or the name of a shipped model.
        garment: Garment for a model that plays any garment, tried on if it does not sit on the body; None for a model
            that has its own.
        body: Name or file of a body, as for `body_of`.
        betas: Shape coefficients, as for `body_of`.
        over: Layers over the garment, from the inside out: garments for a model that plays any garment, otherwise
            models with garments of their own.
        material: Material of the garment, but not of the layers over it; None for the one of the model or the garment.
        wind: Wind of the world, which blows on all layers [m/s].
        clamp: Whether betas are clamped to the range that the model was fitted on.

    Raises:
        BadModel: The model cannot be loaded, see `animators.load`.
        BadBody: There is no such body, or there are too many betas.
        BadInput: A model that plays any garment got none, or a model with its own garment got one; a garment is
            layered over itself; or a model has no range of betas, no other materials, or takes no wind.
        BadGarment: There is no such material.
    """
    from hemline.garments import wear_together

    model = in_wind(_in_material(load(name), material), wind)
    shaped = body_of(model, body, betas)
    if clamp:
        shaped = _clamp_betas(model, shaped)
    if isinstance(model, Wearable):
        if garment is None:
            raise BadInput(f"model '{name}' needs a garment to wear", "none", "name one with --garment")
        _check_each_once((garment, *over))
        layers = [_open_on_body(layer, shaped) for layer in (garment, *over)]
        return model.animator_for(wear_together(layers) if over else layers[0], shaped), shaped
    if garment is not None:
        cure = "leave --garment out, or fit an animator to that garment"
        raise BadInput(f"model '{name}' has its own garment, {model.garment.name}", garment, cure)
    _check_each_once((name, *over))
    if not over:
        return model, shaped
    return together([model, *(_load_layer(layer, wind) for layer in over)]), shaped


def _in_material(model: Animator | Wearable, material: str | None) -> Animator | Wearable:
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


def _load_layer(name: str, wind: Wind) -> Animator:
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
    return in_wind(model, wind)


def _open_on_body(garment: str, shaped: ShapedBody) -> "Garment":
    """Opens a garment on a body, and tries it on if it does not sit there."""
    from hemline.tryon import open_garment

    with try_on_progress() as progress:
        return open_garment(garment, shaped, say=note, progress=progress)


def _clamp_betas(model: Animator | Wearable, shaped: ShapedBody) -> ShapedBody:
    if not isinstance(model, Bounded):
        raise BadInput("--clamp-betas needs a model that knows its range of betas", model.name, "leave it out")
    return shaped.body.shaped(np.clip(shaped.betas, *model.beta_range))


def report_relatives(animator: Animator) -> None:
    """Prints which garments of the fit are most similar to this one, and warns if none is.

    Args:
        animator: The animator that will play.
    """
    if not isinstance(animator, Related) or not animator.relatives:
        return
    listed = ", ".join(f"{name} ({distance:.1f})" for name, distance in animator.relatives)
    note(f"garments of the fit most like '{animator.garment.name}': {listed}; 1 is the usual distance between them")
    name, distance = animator.relatives[0]
    if distance > UNFAMILIAR:
        cure = f"look at it closely, or play it with 'live'; or fit {animator.name} to more garments"
        what = f"'{animator.garment.name}' is unlike all garments that {animator.name} was fitted to"
        warnings.warn(
            HemlineWarning(what, f"{distance:.1f} times the usual distance from the nearest, {name}", cure),
            stacklevel=2,
        )


def warn_new_poses(animator: Animator, novelties: Sequence[float | None]) -> None:
    """Warns of frames whose poses are unlike all poses that an animator was fitted to.

    Args:
        animator: The animator that played.
        novelties: Novelty of each frame, None where the animator gives none.
    """
    if not isinstance(animator, Bounded):
        return
    values = np.array(novelties, np.float64)
    beyond = int((values > animator.novelty_limit).sum())
    if beyond:
        warnings.warn(
            HemlineWarning(
                f"{beyond} of {len(values)} frames are in poses unlike all that '{animator.garment.name}' was fitted to"
                f" (novelty above {animator.novelty_limit:g})",
                f"{values.max():.2f} in frame {int(values.argmax())}",
                "expect errors several times as large there, or fit it to anchors from such clips, too",
            ),
            stacklevel=2,
        )
