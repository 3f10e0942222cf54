"""The model that a command plays, with the garment that it wears."""

from hemline.animators import Animator, Wearable, load
from hemline.bodies import ShapedBody
from hemline.errors import BadInput


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
    name: str, garment: str | None, body: str | None, betas: tuple[float, ...]
) -> tuple[Animator, ShapedBody]:
    """A model from a file or by name, and the body to play it on.

    Args:
        name: A model file, or the name of a shipped model.
        garment: The garment that a model of many garments is to wear; None for a model that has its own.
        body: As for `body_of`.
        betas: As for `body_of`.

    Raises:
        BadModel: As `animators.load`.
        BadInput: A model of many garments without one, or a garment for a model that has its own.
    """
    from hemline import garments

    model = load(name)
    shaped = body_of(model, body, betas)
    if isinstance(model, Wearable):
        if garment is None:
            raise BadInput(f"model '{name}' needs a garment to wear", "none", "name one with --garment")
        return model.worn_by(garments.open_garment(garment, shaped), shaped), shaped
    if garment is not None:
        cure = "leave --garment out, or fit an animator to that garment"
        raise BadInput(f"model '{name}' has its own garment, {model.garment.name}", garment, cure)
    return model, shaped
