"""Figures: plain arrays in, numbers out, one file each, the unit in the name."""

from hemline.meshes import self_crossings as self_crossings

from .area_change_percent import area_change_percent as area_change_percent
from .deepest_mm import deepest_mm as deepest_mm
from .edge_strain import edge_strain as edge_strain
from .edge_strain import edge_strains as edge_strains
from .frame_ms import frame_ms as frame_ms
from .inside_percent import inside_percent as inside_percent
from .jerk_m_s3 import jerk_m_s3 as jerk_m_s3
from .memory_mb import memory_mb as memory_mb
from .model_mb import model_mb as model_mb
from .nearest_inside_percent import nearest_inside_percent as nearest_inside_percent
from .normal_error_deg import normal_error_deg as normal_error_deg
from .vertex_error_mm import vertex_error_mm as vertex_error_mm

__all__ = [
    "area_change_percent",
    "deepest_mm",
    "edge_strain",
    "edge_strains",
    "frame_ms",
    "inside_percent",
    "jerk_m_s3",
    "memory_mb",
    "model_mb",
    "nearest_inside_percent",
    "normal_error_deg",
    "self_crossings",
    "vertex_error_mm",
]
