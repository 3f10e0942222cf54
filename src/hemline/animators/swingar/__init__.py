"""SwinGar: graph attention over a garment, which moves garments that it was never trained on."""

from .config import SwingarConfig as SwingarConfig
from .kind import KIND as KIND
