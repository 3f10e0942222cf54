"""Writes the clip of a command to its output file, and reports what was written."""

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


def check_paths(*files: tuple[Path | None, str]) -> None:
    """Checks the names of output files before any work is done.

    Args:
        files: Pairs of a file, or None for an option that was not given, and the ending that it must have.

    Raises:
        BadOutput: A file has another ending, or cannot be written.
    """
    for path, ending in files:
        if path is None:
            continue
        if path.suffix != ending:
            raise BadOutput(f"{path} must end in {ending}", path.suffix or "no ending", f"name it {path.stem}{ending}")
        check_writable(path)


@dataclass(frozen=True)
class Output:
    """Output file of a command and its options, checked when it is made.

    Args:
        path: The file; its ending selects the format.
        skinned: Whether the garment is written as a skinned mesh.
        bones: Number of bones of the skinned mesh; None for `hemline.export.DEFAULT_BONES`.
        quantized: Whether numbers are stored with fewer bytes.
        character: File of the character that the body was made from, shown instead of the body; None for the body.

    Raises:
        BadInput: The format is unknown or does not support these options, or bones are given without a skin.
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
        """Returns the character's own mesh, or None if no character was given.

        Raises:
            BadInput: The character is not the one that the body was made from.
        """
        from hemline.playback import own_mesh

        return None if self.character is None else own_mesh(self.character, body)

    def write(self, clip: "Clip", *, as_json: bool, own: "OwnMesh | None" = None) -> None:
        """Writes the clip, and prints the names of the files or one JSON object.

        Args:
            clip: The clip.
            as_json: Whether a JSON object is printed.
            own: The character's own mesh, written instead of the body; None for the body.
        """
        from hemline import export

        if self.skinned:
            clip = export.skin_clip(clip, export.DEFAULT_BONES if self.bones is None else self.bones)
        if own is None:
            paths = export.write(self.path, clip, quantized=self.quantized)
        else:
            paths = export.write_dressed(self.path, clip, own, quantized=self.quantized)
        if as_json:
            print(json.dumps(_summary(clip, paths)))
            return
        if clip.skin is not None:
            errors = f"{clip.skin.mean_error_mm:.1f} mm in the mean, {clip.skin.max_error_mm:.1f} mm at most"
            note(f"{clip.skin.bone_count} bones move the garment within {errors}")
        for path in paths:
            print(path)


def _summary(clip: "Clip", paths: Sequence[Path]) -> dict:
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
