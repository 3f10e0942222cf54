"""Metrics: functions from plain arrays to numbers, one file each, with the unit in the name.

A metric of one frame takes the arrays of that frame; a summary of a clip takes the values of its frames. So no metric
needs all frames at once.
"""

from hemline.meshes import edge_strains as edge_strains
from hemline.meshes import self_crossings as self_crossings
from hemline.meshes import worst_edge_ratio as worst_edge_ratio

from .area_change_percent import area_change_percent as area_change_percent
from .behind_nearest_percent import behind_nearest_percent as behind_nearest_percent
from .deepest_mm import deepest_mm as deepest_mm
from .edge_strain import edge_strain as edge_strain
from .frame_ms import frame_ms as frame_ms
from .inside_percent import inside_figures as inside_figures
from .inside_percent import inside_percent as inside_percent
from .inside_percent import pinched_percent as pinched_percent
from .jerk_m_s3 import JERK_FRAMES as JERK_FRAMES
from .jerk_m_s3 import jerk_figures as jerk_figures
from .jerk_m_s3 import jerk_m_s3 as jerk_m_s3
from .laplacian_deviation import laplacian_deviation as laplacian_deviation
from .limbs_through_percent import limbs_through as limbs_through
from .limbs_through_percent import limbs_through_figures as limbs_through_figures
from .mean_and_worst import mean_and_worst as mean_and_worst
from .memory_mb import memory_mb as memory_mb
from .model_mb import model_mb as model_mb
from .normal_error_deg import normal_error_deg as normal_error_deg
from .normal_error_deg import normal_errors_deg as normal_errors_deg
from .resolved_percent import resolved_percent as resolved_percent
from .ripple_deg import neighbouring_faces as neighbouring_faces
from .ripple_deg import ripple_deg as ripple_deg
from .ripple_deg import ripple_figures as ripple_figures
from .skin_through_percent import skin_through_percent as skin_through_percent
from .skin_through_percent import skin_under_cloth as skin_under_cloth
from .stretch_percent import stretch_figures as stretch_figures
from .stretch_percent import stretch_percent as stretch_percent
from .vertex_error_mm import vertex_error_mm as vertex_error_mm
from .vertex_error_mm import vertex_errors_mm as vertex_errors_mm

__all__ = [
    "JERK_FRAMES",
    "area_change_percent",
    "behind_nearest_percent",
    "deepest_mm",
    "edge_strain",
    "edge_strains",
    "frame_ms",
    "inside_figures",
    "inside_percent",
    "jerk_figures",
    "jerk_m_s3",
    "laplacian_deviation",
    "limbs_through",
    "limbs_through_figures",
    "mean_and_worst",
    "memory_mb",
    "model_mb",
    "neighbouring_faces",
    "normal_error_deg",
    "normal_errors_deg",
    "pinched_percent",
    "resolved_percent",
    "ripple_deg",
    "ripple_figures",
    "self_crossings",
    "skin_through_percent",
    "skin_under_cloth",
    "stretch_figures",
    "stretch_percent",
    "vertex_error_mm",
    "vertex_errors_mm",
    "worst_edge_ratio",
]
