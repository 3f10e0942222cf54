"""SwinGar: animates garments that it was never trained on, by graph attention over the garment."""

from .config import SwingarConfig as SwingarConfig
from .kind import KIND as KIND
