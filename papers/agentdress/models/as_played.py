"""Errors of AgentDress as it is played: in the pose itself, arms where they are, up to what the player shows."""

from collections.abc import Iterable

import numpy as np

import hemline
from hemline import bodies
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Vertices
from hemline.bodies.body import ShapedBody
from papers.agentdress.settled.pairs import Worn, mean_distance_mm

from .ablations import Errors, follow_skin, with_offsets, without_shapes
from .paper_system import PaperSystem

FRAME_SECONDS = 1 / 30


def errors_as_played(
    models: dict[str, AnimatorAgentDress], system: PaperSystem | None, settled: Iterable[Worn]
) -> Errors:
    """Returns the mean distance of what is shown from the settled garments, by what shows it [mm].

    Args:
        models: Models of ours by name; skinning is measured with the first.
        system: The system of the paper, or None.
        settled: The settled garments.
    """
    errors: dict[str, list[float]] = {}
    players = _Players()
    first = next(iter(models.values()))
    for worn in settled:
        shaped = bodies.load(first.body_name).shaped(worn.betas)
        posed = shaped.posed(worn.pose)
        garments: dict[str, np.ndarray] = {}
        for name, model in models.items():
            garments[f"{name}, as shown"] = players.show(name, model, shaped, worn)
            garments[f"{name}, before the player's corrections"] = pose_garment(model, worn, shaped)
        if system is not None:
            garments["the paper's system"] = system.drape(posed)
            garments["nearest drape"] = system.nearest(posed)
        fitted_skin = follow_skin(with_offsets(first, first.tables.offset), shaped)
        garments["skinning, dressed on the body"] = pose_garment(fitted_skin, worn, shaped)
        garments["skinning, as made"] = pose_garment(
            without_shapes(with_offsets(first, first.tables.offset)), worn, shaped
        )
        for name, vertices in garments.items():
            errors.setdefault(name, []).append(mean_distance_mm(vertices, worn.vertices))
    return errors


def pose_garment(model: AnimatorAgentDress, worn: Worn, shaped: ShapedBody) -> Vertices:
    """Returns the garment of a model in a pose of a clip, without history [m]."""
    posed = shaped.posed(worn.pose)
    return model.step(model.start(posed), posed, FRAME_SECONDS)[1]


class _Players:
    """Players of models on bodies, each prepared once; the bodies come one after the other."""

    def __init__(self) -> None:
        self._betas: tuple[float, ...] | None = None
        self._players: dict[str, hemline.Player] = {}

    def show(self, name: str, model: AnimatorAgentDress, shaped: ShapedBody, worn: Worn) -> Vertices:
        """Returns the garment that a player shows after the body has moved into a pose [m]."""
        if worn.betas != self._betas:
            self._betas, self._players = worn.betas, {}
        if name not in self._players:
            self._players[name] = hemline.Player.prepare(model, shaped)
        player = self._players[name]
        return player.step(player.start(worn.pose), worn.pose, FRAME_SECONDS)[1].vertices
