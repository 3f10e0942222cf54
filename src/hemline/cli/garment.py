"""The garment of a command that fills a dataset."""

from pathlib import Path
from typing import TYPE_CHECKING

from .progress import bars, note

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.garments import Garment


def open_garment(
    name_or_path: str,
    shaped: "ShapedBody",
    dataset: Path,
    *,
    tryon: bool,
    dressed: bool = False,
    material: str | None = None,
) -> "Garment":
    """A garment by name or from a file; a mesh that does not sit on the body is tried on, and kept in the dataset.

    Args:
        name_or_path: As `garments.open_garment`.
        shaped: The body.
        dataset: The folder of the dataset, there or not.
        tryon: Whether such a mesh is tried on; otherwise it is refused.
        dressed: As `garments.open_garment`.
        material: Name of what it is made of; None: its own.

    Raises:
        BadGarment: No such garment, or no such material.
    """
    from hemline.garments import Material

    made_of = None if material is None else Material.of(material)  # refused before a mesh is tried on
    garment = _opened(name_or_path, shaped, dataset, tryon=tryon, dressed=dressed)
    return garment if made_of is None else garment.in_material(made_of)


def _opened(name_or_path: str, shaped: "ShapedBody", dataset: Path, *, tryon: bool, dressed: bool) -> "Garment":
    from hemline import garments
    from hemline.tryon import open_worn

    if not tryon:
        return garments.open_garment(name_or_path, shaped, dressed=dressed)
    with bars() as display:
        task = display.add_task("try on", total=None, visible=False)
        return open_worn(
            name_or_path,
            shaped,
            dataset,
            dressed=dressed,
            say=note,
            progress=lambda done, total: display.update(task, completed=done, total=total, visible=True),
        )
