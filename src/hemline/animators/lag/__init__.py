"""Animates garments that it was never trained on, by a small network on how skinning trails behind the motion."""

from .config import LagConfig as LagConfig
from .kind import KIND as KIND
