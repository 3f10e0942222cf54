"""Reads clips of any supported format."""

from pathlib import Path

from hemline.errors import BadMotion
from hemline.files.gltf import SCENES
from hemline.motions.rigs.gltf_clip import read_gltf_motion, split_name
from hemline.motions.rigs.retarget import Retargeted, retarget_beside

from .amass import read_amass
from .bvh import read_bvh
from .motion import Motion
from .shipped import load
from .soma import is_soma, read_soma
from .store import read_stored
from .subjects import cmu_number
from .terms import CMU_TERMS

_CURES = {
    ".pkl": "pickles can run code and are not read: save its arrays with numpy.savez, and name the .npz",
    ".pt": "pickles can run code and are not read: save its arrays with numpy.savez, and name the .npz",
    ".npy": "save poses, trans and mocap_framerate by name with numpy.savez, and name the .npz",
    ".c3d": "these are markers, without a skeleton: solve them to a .bvh first",
    ".vmd": "import it in Blender onto its model, and export it as .glb",
}
"""What to do with files of other formats."""


def read(path: str | Path, *, unit: str | None = None, up: str | None = None) -> Motion:
    """Reads a clip: BVH of a humanoid rig, npz of the SMPL family, an animation of a GLB, or a motion of hemline.

    The result is on the 24 joints, in metres, with y up, at its own rate. `Motion.notes` says what was guessed, ignored
    or dropped.

    Args:
        path: The file, whose ending tells the format. `FILE:NAME` is one of several animations of a GLB, VRM or glTF.
        unit: Unit of a BVH: `m`, `cm`, `mm`, `inch` or `cmu`; None: guessed from the size.
        up: The axis that is up in the file: `x`, `y`, `z`, `-x`, `-y` or `-z`; None: found from the body.

    Raises:
        BadMotion: The file cannot be read, a joint is missing, the unit contradicts the size, or the skeleton was not
            understood.

    Warns:
        HemlineWarning: The body lies in nearly all frames, or a bone points elsewhere than in the file.
    """
    path = Path(path)
    ending = split_name(path)[0].suffix.lower()
    if ending == ".npz":
        _refuse_unit(path, unit)
        if not is_soma(path):
            return read_amass(path, up=up)
    if ending == ".safetensors":
        _refuse_unit(path, unit)
        if up not in (None, "y"):
            raise BadMotion(f"{path} has y up by its format", f"up '{up}'", "leave it out")
        return read_stored(path)
    return read_beside(path, unit=unit, up=up).motion


def has_skeleton(path: str | Path) -> bool:
    """Whether a file is a clip that comes with a skeleton of its own."""
    return split_name(path)[0].suffix.lower() in (".bvh", *SCENES) or (Path(path).is_file() and is_soma(path))


def read_beside(path: str | Path, *, unit: str | None = None, up: str | None = None) -> Retargeted:
    """Reads a clip that has a skeleton of its own, and keeps that beside it; see `read`.

    Args:
        path: A BVH, an npz of Kimodo, or `FILE` or `FILE:NAME` of a GLB, VRM, glTF or FBX.
        unit: Unit of a BVH; None: guessed.
        up: The axis that is up; None: found.

    Raises:
        BadMotion: See `read`.
    """
    path = Path(path)
    ending = split_name(path)[0].suffix.lower()
    if ending == ".bvh":
        number = cmu_number(path.stem)
        source = f"CMU {number}, {path.name}" if number else path.name
        licence = CMU_TERMS if number else ""
        return retarget_beside(
            read_bvh(path), unit=unit, up=up, name=path.stem, source=source, licence=licence, file=path.name
        )
    _refuse_unit(path, unit)
    if ending == ".npz":
        return retarget_beside(read_soma(path), up=up, name=path.stem, source=path.name, file=path.name)
    if ending in SCENES:
        return read_gltf_motion(path, up=up)
    if ending in _CURES:
        raise BadMotion(f"clips in {ending} files are not read", path, _CURES[ending])
    cure = "name a .bvh, .npz, .glb, .fbx or .safetensors file"
    raise BadMotion(f"{path} has no known ending", f"'{ending}'", cure)


def _refuse_unit(path: Path, unit: str | None) -> None:
    if unit is not None:
        raise BadMotion(f"{path} has its unit by its format", f"unit '{unit}'", "name a unit for BVH files only")


def open_motion(path_or_name: str | Path, *, up: str | None = None) -> Motion:
    """Loads a shipped clip by name, or reads a file, or `FILE:NAME` of a GLB.

    Args:
        path_or_name: The file or the name.
        up: The axis that is up in a file; None: found.
    """
    if split_name(path_or_name)[0].suffix or Path(path_or_name).is_file():
        return read(path_or_name, up=up)
    return load(str(path_or_name))
