"""AgentDress with parts of it left out or exchanged, judged on pairs of a pose and a body."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bodies.body import ShapedBody
from papers.agentdress.pairs import Pair
from papers.agentdress.pose_models import Offsets, PoseModel

Errors = Mapping[str, list[float]]
"""Mean distance of the vertices in each pair, by what was judged [mm]."""


def told_by(model: AnimatorAgentDress, offsets: Offsets) -> AnimatorAgentDress:
    """The model with what some pose model says in one pose in the place of its own."""
    still = replace(model.tables, pose_weights=np.zeros_like(model.tables.pose_weights))
    return replace(model, tables=replace(still, offset=np.float32(offsets)))


def without_shapes(model: AnimatorAgentDress) -> AnimatorAgentDress:
    """The model without the shape models of its anchors: the ablation of the paper's section 4.6."""
    tables = model.tables
    shapes = replace(tables.shapes, weights=np.zeros_like(tables.shapes.weights))
    return replace(model, tables=replace(tables, shapes=shapes, rest_effects=np.zeros_like(tables.rest_effects)))


def following_skin(model: AnimatorAgentDress, shaped: ShapedBody) -> AnimatorAgentDress:
    """Every vertex of the garment goes where the shape takes the vertex of the body under it."""
    plain, tables = without_shapes(model), model.tables
    moved = (shaped.vertices - shaped.body.shaped().vertices)[tables.nearest]
    return replace(plain, tables=replace(plain.tables, rest=np.float32(tables.rest + moved)))


def ways_of(
    model: AnimatorAgentDress, pair: Pair, models: Mapping[str, PoseModel]
) -> dict[str, tuple[AnimatorAgentDress, ShapedBody]]:
    """By name, what guesses the garment of a pair: AgentDress, other pose models in it, and what is left without parts.

    Args:
        model: The model.
        pair: A pose and a random body.
        models: Other pose models.
    """
    body, binding = bodies.load(model.body_name), binding_of(model)
    shaped, plain = body.shaped(pair.betas), body.shaped().posed(pair.pose)
    nominal = binding.offsets(plain.transforms, model.tables.rest, pair.mean)
    still = told_by(model, model.tables.offset)
    ways = {
        "simulation as pose model": told_by(model, nominal),
        "AgentDress": model,
        **{f"{name} as pose model": told_by(model, each(pair.pose)) for name, each in models.items()},
        "pose model, no shape": without_shapes(model),
        "simulation of the mean shape, no shape": without_shapes(told_by(model, nominal)),
        "the skin's own way": following_skin(model, shaped),
        "skinning": without_shapes(still),
    }
    return {name: (way, shaped) for name, way in ways.items()}


def on_random_bodies(model: AnimatorAgentDress, pairs: Iterable[Pair], models: Mapping[str, PoseModel]) -> Errors:
    """AgentDress, the simulation and other pose models in it, and what is left without its parts."""
    found: dict[str, list[float]] = {}
    for pair in pairs:
        for name, (way, shaped) in ways_of(model, pair, models).items():
            found.setdefault(name, []).append(_apart_mm(way.settled(shaped.posed(pair.pose)), pair.worn))
    return found


def played_mm(model: AnimatorAgentDress, pairs: Iterable[Pair]) -> list[float]:
    """A model on the random bodies, as it plays."""
    body = bodies.load(model.body_name)
    return [_apart_mm(model.settled(body.shaped(pair.betas).posed(pair.pose)), pair.worn) for pair in pairs]


def on_the_mean_body(model: AnimatorAgentDress, pairs: Iterable[Pair], models: Mapping[str, PoseModel]) -> Errors:
    """Pose models alone, on the mean shape."""
    found: dict[str, list[float]] = {}
    mean, binding = bodies.load(model.body_name).shaped(), binding_of(model)
    for pair in pairs:
        posed = mean.posed(pair.pose)
        found.setdefault("kernel regression", []).append(_apart_mm(model.settled(posed), pair.mean))
        for name, each in models.items():
            told = binding.skin(posed.transforms, model.tables.rest, each(pair.pose))
            found.setdefault(name, []).append(_apart_mm(told, pair.mean))
        skinned = without_shapes(told_by(model, model.tables.offset)).settled(posed)
        found.setdefault("skinning", []).append(_apart_mm(skinned, pair.mean))
    return found


def binding_of(model: AnimatorAgentDress) -> Binding:
    """How the garment hangs on the bones."""
    tables = model.tables
    return Binding(tables.indices, tables.weights, tables.nearest)


def _apart_mm(one: np.ndarray, other: np.ndarray) -> float:
    return 1e3 * float(np.linalg.norm(one - other, axis=1).mean())
