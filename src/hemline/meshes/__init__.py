"""Geometry on plain arrays of vertices and triangles: one function, one file."""

from .boundary_loops import boundary_loops as boundary_loops
from .boundary_loops import open_rims as open_rims
from .closest_points import ClosestPoints as ClosestPoints
from .closest_points import ClosestTree as ClosestTree
from .closest_points import closest_points_on_mesh as closest_points_on_mesh
from .coarsening.coarsen import CoarseMesh as CoarseMesh
from .coarsening.coarsen import coarsen as coarsen
from .components import components as components
from .components import sheets as sheets
from .convex_weights import fit_convex_weights as fit_convex_weights
from .convex_weights import project_to_simplex as project_to_simplex
from .edge_strains import edge_lengths as edge_lengths
from .edge_strains import edge_strains as edge_strains
from .edge_strains import rest_lengths as rest_lengths
from .edge_strains import strains as strains
from .edge_strains import worst_edge_ratio as worst_edge_ratio
from .edges import edges as edges
from .geodesics.geodesic_distances import geodesic_distances as geodesic_distances
from .geodesics.geodesic_points import GeodesicMesh as GeodesicMesh
from .normals import face_areas as face_areas
from .normals import face_normals as face_normals
from .normals import vertex_normals as vertex_normals
from .reading.checks import check_mesh as check_mesh
from .reading.checks import consistent_winding as consistent_winding
from .reading.clean import clean as clean
from .reading.clean import close_joints as close_joints
from .reading.mesh import ReadMesh as ReadMesh
from .reading.mesh import weld as weld
from .reading.read_mesh import MESH_ENDINGS as MESH_ENDINGS
from .reading.read_mesh import read_mesh as read_mesh
from .reading.read_obj import read_obj as read_obj
from .rigid_bones import RigidBones as RigidBones
from .rigid_bones import fit_weights as fit_weights
from .rigid_bones import rigid_bones as rigid_bones
from .segment_crossings import segment_crossings as segment_crossings
from .self_crossings import crossing_edges as crossing_edges
from .self_crossings import self_crossings as self_crossings
from .shell import Shell as Shell
from .shell import shell as shell
from .subdivide import subdivide as subdivide

__all__ = [
    "MESH_ENDINGS",
    "ClosestPoints",
    "ClosestTree",
    "CoarseMesh",
    "GeodesicMesh",
    "ReadMesh",
    "RigidBones",
    "Shell",
    "boundary_loops",
    "check_mesh",
    "clean",
    "close_joints",
    "closest_points_on_mesh",
    "coarsen",
    "components",
    "consistent_winding",
    "crossing_edges",
    "edge_lengths",
    "edge_strains",
    "edges",
    "face_areas",
    "face_normals",
    "fit_convex_weights",
    "fit_weights",
    "geodesic_distances",
    "open_rims",
    "project_to_simplex",
    "read_mesh",
    "read_obj",
    "rest_lengths",
    "rigid_bones",
    "segment_crossings",
    "self_crossings",
    "sheets",
    "shell",
    "strains",
    "subdivide",
    "vertex_normals",
    "weld",
    "worst_edge_ratio",
]
