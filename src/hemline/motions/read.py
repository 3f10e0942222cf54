"""Reads clips of any supported format."""

from pathlib import Path

from hemline.errors import BadMotion
from hemline.files.gltf import ENDINGS
from hemline.motions.rigs.gltf_clip import read_gltf_motion, split_name
from hemline.motions.rigs.retarget import retarget

from .amass import read_amass
from .bvh import read_bvh
from .motion import Motion
from .shipped import load
from .store import read_stored
from .subjects import cmu_number
from .terms import CMU_TERMS


def read(path: str | Path, *, unit: str | None = None) -> Motion:
    """Reads a clip: BVH of a humanoid rig, AMASS npz, an animation of a GLB, or a motion of hemline (safetensors).

    The result is on the 24 joints, in metres, with y up, at its own rate. `Motion.notes` says what was guessed, ignored
    or dropped.

    Args:
        path: The file, whose ending tells the format. `FILE:NAME` is one of several animations of a GLB, VRM or glTF.
        unit: Unit of a BVH: `m`, `cm`, `mm`, `inch` or `cmu`; None: guessed from the size.

    Raises:
        BadMotion: The file cannot be read, a joint is missing, or the unit contradicts the size.
    """
    path = Path(path)
    ending = split_name(path)[0].suffix.lower()
    if unit is not None and ending != ".bvh":
        raise BadMotion(f"{path} has its unit by its format", f"unit '{unit}'", "name a unit for BVH files only")
    if ending == ".bvh":
        number = cmu_number(path.stem)
        source = f"CMU {number}, {path.name}" if number else path.name
        licence = CMU_TERMS if number else ""
        return retarget(read_bvh(path), unit=unit, name=path.stem, source=source, licence=licence)
    if ending == ".npz":
        return read_amass(path)
    if ending == ".safetensors":
        return read_stored(path)
    if ending in ENDINGS:
        return read_gltf_motion(path)
    raise BadMotion(f"{path} has no known ending", f"'{ending}'", "name a .bvh, .npz, .glb or .safetensors file")


def open_motion(path_or_name: str | Path) -> Motion:
    """Loads a shipped clip by name, or reads a file, or `FILE:NAME` of a GLB."""
    if split_name(path_or_name)[0].suffix or Path(path_or_name).is_file():
        return read(path_or_name)
    return load(str(path_or_name))
