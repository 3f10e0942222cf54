"""Opens the garment of a command."""

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
    """Opens a garment by name or from a file; a mesh that does not sit on the body is tried on.

    Args:
        name_or_path: Name or file, as for `garments.open_garment`.
        shaped: The body.
        dataset: Folder where the result of the try-on is stored; it may be missing.
        tryon: Whether a mesh that does not sit on the body is tried on; otherwise it is refused.
        dressed: Passed to `garments.open_garment`.
        material: Name of the material; None for the garment's own.

    Raises:
        BadGarment: There is no such garment, or no such material.
    """
    from hemline.garments import Material

    cloth = None if material is None else Material.of(material)  # an unknown name fails before the slow try-on
    garment = _open(name_or_path, shaped, dataset, tryon=tryon, dressed=dressed)
    return garment if cloth is None else garment.in_material(cloth)


def _open(name_or_path: str, shaped: "ShapedBody", dataset: Path, *, tryon: bool, dressed: bool) -> "Garment":
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
