"""Garments, which consist of cloth, pins and a material: made or read from files, and worn alone or in layers."""

from pathlib import Path

from .closeness import lies_close as lies_close
from .cut.cape import CapeCut as CapeCut
from .cut.cape import make_cape as make_cape
from .cut.skirt import SkirtCut as SkirtCut
from .cut.skirt import make_skirt as make_skirt
from .garment import Garment as Garment
from .material import MATERIALS as MATERIALS
from .material import Material as Material
from .pieces import Piece as Piece
from .pins import Pins as Pins
from .proxy.coarser import coarser_garment as coarser_garment
from .reading.garment_toml import GarmentFile as GarmentFile
from .reading.read import read as read
from .shipped import explain as explain
from .shipped import load as load
from .shipped import names as names
from .wear_together import split_pieces as split_pieces
from .wear_together import wear_together as wear_together


def write(path: str | Path, garment: Garment) -> None:
    """Writes a garment to a hemline file (safetensors), which `read` reads back.

    Raises:
        BadOutput: The path cannot be written.
    """
    garment.save(path)


__all__ = [
    "MATERIALS",
    "CapeCut",
    "Garment",
    "GarmentFile",
    "Material",
    "Piece",
    "Pins",
    "SkirtCut",
    "coarser_garment",
    "explain",
    "lies_close",
    "load",
    "make_cape",
    "make_skirt",
    "names",
    "read",
    "split_pieces",
    "wear_together",
    "write",
]
