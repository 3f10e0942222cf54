"""Fig. 8: the first components of both bases, added to the rest drape."""

from pathlib import Path

import numpy as np

from hemline import pictures
from papers.rope_chains.drawing.figure import FigureEntry

SHOWN, REACH = 5, (0.35, 0.12)
"""Number of components of each basis, and largest displacement of a vertex [m]."""
SIZE = (330, 440)


def roughness(model, mode: np.ndarray) -> float:
    """Returns the mean difference of neighbouring vertices over the mean displacement of a component."""
    moved, faces = mode.reshape(-1, 3), model.garment.faces
    apart = np.linalg.norm(moved[faces[:, 0]] - moved[faces[:, 1]], axis=1).mean()
    return float(apart / np.linalg.norm(moved, axis=1).mean())


def draw(folder: Path, model) -> FigureEntry:
    """Draws the figure."""
    rows, rough = [], []
    for basis, reach in zip((model.skinning_basis, model.shape_basis), REACH, strict=True):
        modes = basis.unpack()[:SHOWN]
        rough.append([roughness(model, mode) for mode in modes])
        views = []
        for mode in modes:
            moved = mode.reshape(-1, 3)
            vertices = model.rest + moved * reach / np.linalg.norm(moved, axis=1).max()
            views.append(pictures.picture_of([(vertices, model.garment.faces, "cloth")], "three_quarter", size=SIZE))
        rows.append(pictures.side_by_side(views))
    pictures.write_png(folder / "fig08.png", np.concatenate(rows))
    first, second = (float(np.mean(each)) for each in rough)
    return FigureEntry(
        "8", "Principal components",
        "The model for skinning tends to capture low-frequency deformations, that for shape higher frequencies.",
        f"Difference of neighbouring vertices over motion, mean of the first {SHOWN}: skinning {first:.3f}, "
        f"shape {second:.3f}.",
        "Holds." if second > first else "Does not hold.",
        "fig08.png",
    )  # fmt: skip
