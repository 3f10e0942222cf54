"""Garments made from measures: tops, dresses, skirts, trousers, jumpsuits."""

from .design import Design as Design
from .generated import generated as generated
from .random_design import random_design as random_design
from .spec import garment_of_spec as garment_of_spec
from .spec import is_spec as is_spec

__all__ = ["Design", "garment_of_spec", "generated", "is_spec", "random_design"]
