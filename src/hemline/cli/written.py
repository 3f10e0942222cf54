"""A clip in the file that a command was asked for, and what is said of it."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from hemline.errors import BadInput, BadOutput
from hemline.files import check_writable

from .progress import note

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody
    from hemline.export import Clip, OwnMesh


def check_paths(*each: tuple[Path | None, str]) -> None:
    """Refuse files that do not have the ending they must have, or cannot be written, before anything is done.

    Args:
        each: A file, or None where it is not asked for, and its ending.

    Raises:
        BadOutput: It is called otherwise, or cannot be written.
    """
    for path, ending in each:
        if path is None:
            continue
        if path.suffix != ending:
            raise BadOutput(f"{path} must end in {ending}", path.suffix or "no ending", f"name it {path.stem}{ending}")
        check_writable(path)


@dataclass(frozen=True)
class Output:
    """Where to and how.

    Args:
        path: The file; its ending chooses the format.
        skinned: The garment as a skinned mesh.
        bones: Its bones; None: as many as `hemline.export.BONES`.
        quantized: Fewer bytes a number.
        character: The file of the character that the body was made of, to be shown in its place; None: the body.

    Raises:
        BadInput: The format is not known or cannot hold this, or bones are asked for without a skin.
    """

    path: Path
    skinned: bool
    bones: int | None
    quantized: bool
    character: Path | None = None

    def __post_init__(self) -> None:
        from hemline import export

        if self.bones is not None and not self.skinned:
            raise BadInput("bones are those of a skinned garment", f"--bones {self.bones} alone", "add --skinned")
        if self.bones is not None:
            export.check_bones(self.bones)
        export.check_format(self.path, skinned=self.skinned, quantized=self.quantized)
        if self.character is not None and self.path.suffix.lower() != ".glb":
            raise BadInput("a character's own mesh is written as .glb", self.path.name, f"name it {self.path.stem}.glb")

    def own_mesh(self, body: "ShapedBody") -> "OwnMesh | None":
        """The character's own mesh, if it is asked for; refused before anything is played where it is another's."""
        from hemline.playback import own_mesh

        return None if self.character is None else own_mesh(self.character, body)

    def write(self, clip: "Clip", *, as_json: bool, own: "OwnMesh | None" = None) -> None:
        """Write the clip, with a character's own mesh if any; print the names of the files, or one JSON object."""
        from hemline import export

        if self.skinned:
            clip = export.skinned(clip, export.BONES if self.bones is None else self.bones)
        if own is None:
            paths = export.write(self.path, clip, quantized=self.quantized)
        else:
            paths = export.write_dressed(self.path, clip, own, quantized=self.quantized)
        if as_json:
            print(json.dumps(_said(clip, paths)))
            return
        if clip.skin is not None:
            errors = f"{clip.skin.mean_error_mm:.1f} mm in the mean, {clip.skin.max_error_mm:.1f} mm at most"
            note(f"{clip.skin.bone_count} bones move the garment within {errors}")
        for path in paths:
            print(path)


def _said(clip: "Clip", paths: Sequence[Path]) -> dict:
    skin = clip.skin and {
        "bones": clip.skin.bone_count,
        "mean_error_mm": clip.skin.mean_error_mm,
        "max_error_mm": clip.skin.max_error_mm,
    }
    return {
        "files": [str(path) for path in paths],
        "bytes": sum(path.stat().st_size for path in paths),
        "vertices": clip.vertices.shape[1],
        "frames": clip.frame_count,
        "fps": clip.fps,
        "skin": skin,
    }
