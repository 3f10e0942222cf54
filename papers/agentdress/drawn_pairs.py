"""Figs. 8 and 10 of AgentDress, redrawn: the simulation, and what the method and its parts make of the same pair."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hemline import pictures
from hemline.animators.agentdress.model import AnimatorAgentDress
from papers.agentdress.compared import ways_of
from papers.agentdress.pairs import Pair
from papers.agentdress.pose_models import PoseModel

SIZE, FAR, MARK = (270, 360), 0.010, (0.10, 0.62, 0.20)
"""Size of each picture [pixels]; distance to the simulation from which a vertex is green [m], and that green."""
SHOWN = (
    "simulation as pose model",
    "AgentDress",
    "rigging as pose model",
    "simulation of the mean shape, no shape",
    "pose model, no shape",
    "skinning",
)
"""What is drawn of what was judged, in this order. The last but one is the paper's ablation (section 4.6)."""


def draw_pairs(
    path: Path, model: AnimatorAgentDress, pairs: Sequence[Pair], models: Mapping[str, PoseModel]
) -> list[str]:
    """Write a row of pictures for each pair; returns what is drawn, in order.

    Args:
        path: The PNG.
        model: The model.
        pairs: Which pairs.
        models: Other pose models.
    """
    rows, names = [], ["simulation"]
    for pair in pairs:
        ways = ways_of(model, pair, models)
        names = ["simulation", *(name for name in SHOWN if name in ways)]
        posed = ways["AgentDress"][1].posed(pair.pose)
        body = pictures.ShadedSurface(posed.vertices, posed.faces, pictures.BODY, sheen=0.0)
        camera = pictures.frame_points(pair.worn, "three_quarter", size=SIZE)
        views = [_drawn(body, pair.worn, pair.worn, model.garment.faces, camera, True)]
        captions = ["simulation"]
        for name in names[1:]:
            worn = ways[name][0].settled(posed)
            views.append(_drawn(body, worn, pair.worn, model.garment.faces, camera, False))
            captions.append(f"{1e3 * np.linalg.norm(worn - pair.worn, axis=1).mean():.1f} mm")
        rows.append(pictures.side_by_side(views, captions))
    pictures.write_png(path, np.concatenate(rows, axis=0))
    return names


def _drawn(body, worn: np.ndarray, truth: np.ndarray, faces: np.ndarray, camera, is_truth: bool) -> np.ndarray:
    off = np.linalg.norm(worn - truth, axis=1) > FAR
    colours = np.where(off[:, None], MARK, pictures.TRUTH if is_truth else pictures.CLOTH).astype(np.float32)
    cloth = pictures.ShadedSurface(worn.astype(np.float32), faces, colours=colours)
    return pictures.render([body, cloth], camera, SIZE, ground=None)
