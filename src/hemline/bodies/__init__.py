"""Body models, which turn shape and pose into joints, skin and mesh."""

import difflib
import functools
from dataclasses import replace
from pathlib import Path

from hemline.errors import BadBody

from .accessories.accessories import Accessory as Accessory
from .accessories.accessories import attach as attach
from .body import Body as Body
from .body import PosedBody as PosedBody
from .body import ShapedBody as ShapedBody
from .body_file import read_body, write_body
from .character.character import CHARACTERS as CHARACTERS
from .character.character import Character as Character
from .character.character import read_character as read_character
from .character.character import read_skeleton as read_skeleton
from .coarser import coarser_body as coarser_body
from .limb_bones import LIMBS as LIMBS
from .limb_bones import limb_bones as limb_bones
from .own_size import own_size as own_size
from .place import Placement as Placement
from .place import placement as placement
from .skinning import skin_points as skin_points
from .smpl.smpl import read_smpl
from .untangling.overlap import overlapping as overlapping
from .untangling.untangling import MotionUntangling as MotionUntangling
from .untangling.untangling import Untangling as Untangling
from .untangling.untangling import untangle as untangle
from .untangling.untangling import untangle_motion as untangle_motion

_ENDINGS = (".safetensors", ".npz", ".pkl", *CHARACTERS)
_SHIPPED = {"anny24": Path(__file__).parents[1] / "models" / "anny24.safetensors"}


def names() -> tuple[str, ...]:
    """Returns the names of the bodies that ship."""
    return tuple(_SHIPPED)


@functools.cache
def load(name: str = "anny24") -> Body:
    """Returns a body that ships, or one from a file. Each is read once and cached.

    The name of a body from a file is the path as given, so that garments and models made on it find it again from the
    same folder.

    Args:
        name: One of `names()`, or the path of a file that `read` reads.

    Raises:
        BadBody: There is no such body, or its file cannot be read.
    """
    if Path(name).suffix.lower() in _ENDINGS:
        return replace(read(name), name=str(name))
    if name not in _SHIPPED:
        near = difflib.get_close_matches(name, _SHIPPED, n=1, cutoff=0.0)
        raise BadBody(
            "no body of that name ships",
            repr(name),
            f"the nearest name is '{near[0]}'; or name a file that ends in {', '.join(_ENDINGS)}",
        )
    return read_body(_SHIPPED[name])


def read(path: str | Path) -> Body:
    """Reads a body file: hemline's own `.safetensors`, a rigged character, or SMPL, SMPL-H, SMPL-X as `.pkl` or `.npz`.

    `smpl.read_smpl` documents what is kept of SMPL files, and how pickles are read without being executed.
    `read_character` documents how a `.glb`, `.vrm` or `.gltf` becomes a body, and also returns what was found in it.

    Args:
        path: The file.

    Raises:
        BadBody: The file is missing, truncated, of another kind or a future version, its content contradicts itself,
            or a pickle asks for anything but arrays.
    """
    ending = Path(path).suffix.lower()
    if ending in CHARACTERS:
        return read_character(path)[0]
    return read_smpl(path) if ending in (".npz", ".pkl") else read_body(path)


def write(path: str | Path, body: Body) -> None:
    """Writes a body file, whole or not at all.

    Args:
        path: The file, `.safetensors`.
        body: The body.

    Raises:
        BadOutput: The path cannot be written.
    """
    write_body(path, body)


__all__ = [
    "CHARACTERS",
    "LIMBS",
    "Accessory",
    "Body",
    "Character",
    "MotionUntangling",
    "Placement",
    "PosedBody",
    "ShapedBody",
    "Untangling",
    "attach",
    "coarser_body",
    "limb_bones",
    "load",
    "names",
    "overlapping",
    "own_size",
    "placement",
    "read",
    "read_character",
    "read_skeleton",
    "skin_points",
    "untangle",
    "untangle_motion",
    "write",
]
