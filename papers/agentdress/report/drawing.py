"""Pictures of garments in which vertices far from the simulation are green, as in Figs. 7, 8 and 10 of AgentDress."""

from collections.abc import Sequence

import numpy as np

from hemline import pictures
from hemline.bodies import PosedBody
from papers.agentdress.settled.pairs import mean_distance_mm

FAR, MARK = 0.010, (0.10, 0.62, 0.20)
"""Distance to the simulation from which a vertex is marked [m], and the colour of the mark."""


def draw_errors(
    posed: PosedBody,
    faces: np.ndarray,
    truth: np.ndarray,
    garments: Sequence[tuple[str, np.ndarray]],
    size: tuple[int, int],
) -> np.ndarray:
    """Draws the simulated garment and predictions of it side by side, with captions that end with the mean error.

    Args:
        posed: The body.
        faces: Triangles of the garment.
        truth: The simulated garment [m].
        garments: Captions and predictions [m].
        size: Width and height of each picture [pixels].
    """
    body = pictures.ShadedSurface(posed.vertices, posed.faces, pictures.BODY, sheen=0.0)
    camera = pictures.frame_points(truth, "three_quarter", size=size)
    surfaces = [pictures.ShadedSurface(truth.astype(np.float32), faces, pictures.TRUTH)]
    captions = ["simulation"]
    for caption, vertices in garments:
        far = np.linalg.norm(vertices - truth, axis=1) > FAR
        colours = np.where(far[:, None], MARK, pictures.CLOTH).astype(np.float32)
        surfaces.append(pictures.ShadedSurface(vertices.astype(np.float32), faces, colours=colours))
        captions.append(f"{caption} {mean_distance_mm(vertices, truth):.1f} mm".strip())
    views = [pictures.render([body, surface], camera, size, ground=None) for surface in surfaces]
    return pictures.side_by_side(views, captions)
