"""Figs. 6 and 7 of AgentDress, redrawn: components of the shape models, and their errors beside DRAPE's."""

from pathlib import Path

import numpy as np

from hemline import pictures
from hemline.arrays import Float
from papers.agentdress.shape_ways import COMPONENTS, Ways, apart_mm
from papers.rope_chains.drawing.figure import axes, keep  # pyright: ignore[reportMissingImports]

SIZE, FAR, MARK = (300, 400), 0.010, (0.10, 0.62, 0.20)
"""Size of each picture [pixels]; distance to the simulation from which a vertex is green [m], and that green."""
COLOURS = {"coordinates": "tab:blue", "gradients": "tab:orange"}


def draw_components(
    folder: Path,
    shares: dict[str, Float[np.ndarray, " components"]],
    errors: dict[str, Float[np.ndarray, " components"]],
) -> str:
    """Fig. 6 and what it does not show: the errors of predictions by as many components.

    Args:
        folder: Where the picture goes.
        shares: Share of the variance, by what the components are of and of which garments.
        errors: Mean vertex error of predictions on unseen shapes, by what the components are of [mm].
    """
    sheet, ((left, right),) = axes(1, 2, width=4.2, height=3.2)
    for name, values in shares.items():
        style = "-o" if name.endswith("fitted") else "--s"
        at = np.arange(1, len(values) + 1)
        left.plot(at, 100 * values, style, ms=3, color=COLOURS[name.split(",")[0]], label=name)
    for name, values in errors.items():
        right.plot(np.arange(1, len(values) + 1), values, "-o", ms=3, color=COLOURS[name], label=name)
    left.set(xlabel="principal components", ylabel="explained variance, %", ylim=(0, 102))
    right.set(xlabel="principal components", ylabel="vertex error on unseen shapes, mm", ylim=(0, None))
    for each in (left, right):
        each.axvline(COMPONENTS, color="0.8", zorder=0)
        each.legend(fontsize=7)
    return keep(sheet, folder, "fig06.png")


def draw_bars(folder: Path, errors: dict[str, list[float]]) -> str:
    """Fig. 7, left: the mean error of each shape model, by way [mm]."""
    sheet, ((axis,),) = axes(1, 1, width=7.0, height=2.8)
    count, width = len(next(iter(errors.values()))), 0.8 / len(errors)
    for number, (name, values) in enumerate(errors.items()):
        axis.bar(np.arange(count) + (number - 0.5 * (len(errors) - 1)) * width, values, width, label=name)
    highest = max(max(values) for values in errors.values())
    axis.set(xlabel="shape model (pose)", ylabel="mean vertex error, mm", xticks=range(count), ylim=(0, 1.25 * highest))
    axis.set_xticklabels([str(number + 1) for number in range(count)])
    axis.legend(fontsize=7, ncols=len(errors), loc="upper right")
    return keep(sheet, folder, "fig07-left.png")


def draw_predictions(folder: Path, ways: Ways, shape: int, predictions: dict[str, np.ndarray]) -> str:
    """Fig. 7, right: the simulation and predictions of one body, vertices that are far from it in green.

    Args:
        folder: Where the picture goes.
        ways: The pose.
        shape: Which of its unseen shapes.
        predictions: Garments on that body by name [m].
    """
    posed, truth = ways.posed(ways.drapes.betas[shape]), ways.drapes.unseen[shape]
    body = pictures.ShadedSurface(posed.vertices, posed.faces, pictures.BODY, sheen=0.0)
    camera = pictures.frame_points(truth, "three_quarter", size=SIZE)
    drawn = [pictures.ShadedSurface(truth.astype(np.float32), ways.faces, pictures.TRUTH)]
    captions = ["simulation"]
    for name, worn in predictions.items():
        off = np.linalg.norm(worn - truth, axis=1) > FAR
        colours = np.where(off[:, None], MARK, pictures.CLOTH).astype(np.float32)
        drawn.append(pictures.ShadedSurface(worn.astype(np.float32), ways.faces, colours=colours))
        captions.append(f"{name}: {apart_mm(worn[None], truth[None])[0]:.1f} mm")
    views = [pictures.render([body, each], camera, SIZE, ground=None) for each in drawn]
    folder.mkdir(parents=True, exist_ok=True)
    pictures.write_png(folder / "fig07-right.png", pictures.side_by_side(views, captions))
    return "fig07-right.png"
