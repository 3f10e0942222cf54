"""How much a garment has grown or shrunk."""

import numpy as np

from hemline.arrays import Faces, Float, FramesOfVertices


def area_change_percent(
    vertices: FramesOfVertices, faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"]
) -> dict[str, float]:
    """Change of the garment's whole area from its flat rest shape.

    Args:
        vertices: The garment [m].
        faces: Its triangles.
        rest_edges: Columns: the two edges of each flat rest triangle [m].

    Returns:
        `mean` over the frames, and `worst_frame`: that of the frame farthest from the rest area, with its sign
        [percent].
    """
    rest = 0.5 * np.abs(np.linalg.det(rest_edges)).sum()
    change = np.array([100 * (_area(frame, faces) / rest - 1) for frame in vertices])
    return {"mean": float(change.mean()), "worst_frame": float(change[np.argmax(np.abs(change))])}


def _area(vertices: np.ndarray, faces: np.ndarray) -> float:
    corners = np.asarray(vertices, np.float64)[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(0.5 * np.linalg.norm(across, axis=1).sum())
