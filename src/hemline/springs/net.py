"""The cloth between chains as a coarse mesh, and the skin that is in front of it."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Bool, Float, Int
from hemline.meshes import ClosestTree, boundary_loops

from .spring_bones import SpringChains

LEAST_SHOWING = 0.005
"""Least distance in front of the net of skin that shows [m]: covered skin is drawn in by more (`playback.draw_in`)."""


@dataclass(frozen=True, eq=False)
class Net:
    """A mesh whose vertices are the bones of chains.

    Attributes:
        faces: Two triangles between each two bones and those beside them.
        rim: Whether each bone is on the rim of the mesh.
    """

    faces: Int[np.ndarray, "faces 3"]
    rim: Bool[np.ndarray, " bones"]

    @classmethod
    def of(cls, chains: SpringChains, pairs: Int[np.ndarray, "pairs 2"]) -> "Net | None":
        """Makes the net of chains; None if no chain is beside another.

        Args:
            chains: The chains.
            pairs: Bones of neighbouring chains, side by side.
        """
        beside = {tuple(pair) for pair in pairs.tolist()}
        last = set((chains.offsets[1:] - 1).tolist())
        quads = [
            (one, other) for one, other in sorted(beside) if not {one, other} & last and (one + 1, other + 1) in beside
        ]
        if not quads:
            return None
        faces = np.array([each for a, b in quads for each in ((a, a + 1, b), (a + 1, b + 1, b))], np.int32)
        corners = chains.bones[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        chain = np.searchsorted(chains.offsets, faces[:, 0], side="right") - 1
        inwards = np.einsum("fx,fx->f", normals, chains.outward[chain]) < 0
        faces[inwards] = faces[inwards][:, ::-1]
        rim = np.zeros(len(chains.bones), bool)
        for loop in boundary_loops(faces):
            rim[loop] = True
        return cls(faces, rim)

    def behind(
        self, bones: Float[np.ndarray, "bones 3"], skin: Float[np.ndarray, "points 6"]
    ) -> tuple[Bool[np.ndarray, " points"], Bool[np.ndarray, " points"]]:
        """Returns which points of the skin are behind the net, and which are in front of it by `LEAST_SHOWING`.

        Points that are closest to the rim are neither.

        Args:
            bones: The bones [m].
            skin: Points of the skin [m] with their normals.
        """
        tree = ClosestTree(np.asarray(bones, np.float64), self.faces)
        points, normals = skin[:, :3], skin[:, 3:]
        closest = tree.closest(points)
        outward = tree.outward(closest)
        side = np.sign(np.einsum("px,px->p", points - closest.positions, outward)) * closest.distances
        used = closest.weights > 1e-6
        inside = (self.rim[self.faces[closest.faces]] & used).sum(axis=1) < used.sum(axis=1)
        facing = np.einsum("px,px->p", outward, normals) > 0
        return (side < 0) & inside, (side > LEAST_SHOWING) & inside & facing
