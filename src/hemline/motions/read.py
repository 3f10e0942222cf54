"""Read clips, whatever their format."""

from pathlib import Path

from hemline.errors import BadMotion

from .amass import read_amass
from .bvh import read_bvh
from .motion import Motion
from .retarget import retarget
from .shipped import load
from .store import read_stored
from .subjects import cmu_number

_CMU_LICENCE = "free for all uses; data from mocap.cs.cmu.edu, created with funding from NSF EIA-0196217"


def read(path: str | Path, *, unit: str | None = None) -> Motion:
    """Read a clip: BVH of a humanoid rig, AMASS npz, or a motion that hemline wrote (safetensors).

    It comes on the 24 joints, in metres, y up, at its own rate. `Motion.notes` says what was guessed, ignored, dropped.

    Args:
        path: The file; its ending chooses the format.
        unit: Unit of a BVH: `m`, `cm`, `mm`, `inch` or `cmu`; None to guess it from the size.

    Raises:
        BadMotion: The file cannot be read, a joint is missing, or the unit contradicts the size.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if unit is not None and ending != ".bvh":
        raise BadMotion(f"{path} has its unit by its format", f"unit '{unit}'", "name a unit for BVH files only")
    if ending == ".bvh":
        number = cmu_number(path.stem)
        source = f"CMU {number}, {path.name}" if number else path.name
        licence = _CMU_LICENCE if number else ""
        return retarget(read_bvh(path), unit=unit, name=path.stem, source=source, licence=licence)
    if ending == ".npz":
        return read_amass(path)
    if ending == ".safetensors":
        return read_stored(path)
    raise BadMotion(f"{path} has no known ending", f"'{ending}'", "name a .bvh, .npz or .safetensors file")


def open_motion(path_or_name: str | Path) -> Motion:
    """Load a shipped clip by its name, or read a file."""
    if Path(path_or_name).suffix or Path(path_or_name).is_file():
        return read(path_or_name)
    return load(str(path_or_name))
