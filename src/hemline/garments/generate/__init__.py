"""Garments generated from measures: tops, dresses, skirts, trousers, jumpsuits."""

from .design import KINDS as KINDS
from .design import LIMITS as LIMITS
from .design import Design as Design
from .design import Measures as Measures
from .generate_garment import generate_garment as generate_garment
from .random_design import plain_design as plain_design
from .random_design import random_design as random_design
from .spec import garment_of_spec as garment_of_spec
from .spec import is_spec as is_spec
from .write_with_toml import write_with_toml as write_with_toml

__all__ = [
    "KINDS",
    "LIMITS",
    "Design",
    "Measures",
    "garment_of_spec",
    "generate_garment",
    "is_spec",
    "plain_design",
    "random_design",
    "write_with_toml",
]
