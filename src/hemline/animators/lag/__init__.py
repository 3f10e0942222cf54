"""A small network on how skinning trails, which moves garments that it was never trained on."""

from .config import LagConfig as LagConfig
from .kind import KIND as KIND
