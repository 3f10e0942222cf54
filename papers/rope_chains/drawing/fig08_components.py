"""Fig. 8: what the first components of both bases do to the rest drape."""

from pathlib import Path

import numpy as np

from hemline import pictures
from papers.rope_chains.drawing.figure import Drawn

SHOWN, REACH = 5, (0.35, 0.12)
"""Components of each basis, and how far the vertex that moves most is moved [m]."""
SIZE = (330, 440)


def roughness(model, mode: np.ndarray) -> float:
    """Mean difference of neighbouring vertices over mean motion, of one component."""
    moved, faces = mode.reshape(-1, 3), model.garment.faces
    apart = np.linalg.norm(moved[faces[:, 0]] - moved[faces[:, 1]], axis=1).mean()
    return float(apart / np.linalg.norm(moved, axis=1).mean())


def draw(folder: Path, model) -> Drawn:
    """Draw it."""
    rows, rough = [], []
    for basis, reach in zip((model.skinning_basis, model.shape_basis), REACH, strict=True):
        modes = basis.unpacked()[:SHOWN]
        rough.append([roughness(model, mode) for mode in modes])
        views = []
        for mode in modes:
            moved = mode.reshape(-1, 3)
            vertices = model.rest + moved * reach / np.linalg.norm(moved, axis=1).max()
            views.append(pictures.picture_of([(vertices, model.garment.faces, "cloth")], "three_quarter", size=SIZE))
        rows.append(pictures.side_by_side(views))
    pictures.write_png(folder / "fig08.png", np.concatenate(rows))
    first, second = (float(np.mean(each)) for each in rough)
    return Drawn(
        "8", "Principal components",
        "The model for skinning tends to capture low-frequency deformations, that for shape higher frequencies.",
        f"Difference of neighbouring vertices over motion, mean of the first {SHOWN}: skinning {first:.3f}, "
        f"shape {second:.3f}.",
        "Holds." if second > first else "Does not hold.",
        "fig08.png",
    )  # fmt: skip
