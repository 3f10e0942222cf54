"""SwinGar: one network that moves garments it was never trained on."""

from .config import SwingarConfig as SwingarConfig
from .kind import KIND as KIND
from .model import AnimatorSwingar as AnimatorSwingar
from .wearable import Swingar as Swingar
