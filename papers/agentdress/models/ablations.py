"""AgentDress with parts removed or exchanged, and baseline pose models, evaluated on pairs of a pose and a body."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.rigged_anchors import anchor_blend
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Float
from hemline.bodies.body import ShapedBody
from hemline.motions.motion import Pose
from hemline.motions.quaternions import to_matrix
from papers.agentdress.settled.pairs import Pair, mean_distance_mm
from papers.agentdress.synthesis import Points

from .paper_system import PaperSystem

Offsets = Float[np.ndarray, "verts 3"]
PoseModel = Callable[[Pose], Offsets]
"""Function from a pose, arms lifted as in anchors, to the offsets from the skinned garment on the mean shape [m]."""

PENALTIES = (1e-2, 1e-1, 1.0, 10.0, 100.0)


def blend_nearest(model: AnimatorAgentDress, anchors: AnchorSet) -> PoseModel:
    """Returns the blend of the nearest anchors, skinned."""
    offsets = anchors.offsets[:, 0].astype(np.float64)
    return lambda pose: np.einsum("va,avi->vi", anchor_blend(model, anchors.rotations, pose), offsets)


def nearest_anchor(model: AnimatorAgentDress, anchors: AnchorSet) -> PoseModel:
    """Returns the nearest anchor alone, skinned."""
    offsets = anchors.offsets[:, 0].astype(np.float64)
    return lambda pose: offsets[anchor_blend(model, anchors.rotations, pose).mean(axis=0).argmax()]


def ridge_regression(anchors: AnchorSet) -> PoseModel:
    """Fits a ridge regression from joint rotations, with the penalty of least leave-one-out error."""
    rotations = np.concatenate([anchors.rotations, anchors.single_rotations])
    outputs = np.concatenate([anchors.offsets[:, 0], anchors.single_offsets]).reshape(len(rotations), -1)
    inputs = _matrix_entries(rotations)
    centre, mean = inputs.mean(axis=0), outputs.mean(axis=0)
    gram = (inputs - centre) @ (inputs - centre).T
    duals = []
    for penalty in PENALTIES:
        inverse = np.linalg.inv(gram + penalty * np.eye(len(gram)))
        dual = inverse @ (outputs - mean)
        duals.append((float(np.square(dual / np.diag(inverse)[:, None]).mean()), dual))
    weights = (inputs - centre).T @ min(duals, key=lambda each: each[0])[1]
    return lambda pose: (mean + (_matrix_entries(pose.rotations[None])[0] - centre) @ weights).reshape(-1, 3)


def _matrix_entries(rotations: Float[np.ndarray, "poses joints 4"]) -> Float[np.ndarray, "poses entries"]:
    return to_matrix(rotations.astype(np.float64)).reshape(len(rotations), -1)


Errors = Mapping[str, list[float]]
"""Mean distance of the vertices in each pair, by what was evaluated [mm]."""


def with_offsets(model: AnimatorAgentDress, offsets: Offsets) -> AnimatorAgentDress:
    """Replaces the pose model by given offsets in one pose."""
    tables = replace(model.tables, pose_weights=np.zeros_like(model.tables.pose_weights))
    return replace(model, tables=replace(tables, offset=np.float32(offsets)))


def without_shapes(model: AnimatorAgentDress) -> AnimatorAgentDress:
    """Removes the effect of body shapes: the ablation of section 4.6 of the paper."""
    tables = model.tables
    shapes = replace(tables.shapes, weights=np.zeros_like(tables.shapes.weights))
    return replace(model, tables=replace(tables, shapes=shapes, rest_effects=np.zeros_like(tables.rest_effects)))


def follow_skin(model: AnimatorAgentDress, shaped: ShapedBody) -> AnimatorAgentDress:
    """Replaces the effect of body shapes by the displacement of the body vertex under each garment vertex."""
    plain, tables = without_shapes(model), model.tables
    displacement = (shaped.vertices - shaped.body.shaped().vertices)[tables.nearest]
    return replace(plain, tables=replace(plain.tables, rest=np.float32(tables.rest + displacement)))


def variants_of(
    model: AnimatorAgentDress, pair: Pair, models: Mapping[str, PoseModel]
) -> dict[str, tuple[AnimatorAgentDress, ShapedBody]]:
    """Returns AgentDress, variants with other pose models, and variants without parts, by name.

    Args:
        model: The model.
        pair: A pose and a random body.
        models: Other pose models.
    """
    body, binding = bodies.load(model.body_name), binding_of(model)
    shaped, plain = body.shaped(pair.betas), body.shaped().posed(pair.pose)
    nominal = binding.offsets(plain.transforms, model.tables.rest, pair.mean)
    variants = {
        "simulation as pose model": with_offsets(model, nominal),
        "AgentDress": model,
        **{f"{name} as pose model": with_offsets(model, each(pair.pose)) for name, each in models.items()},
        "pose model, no shape": without_shapes(model),
        "simulation of the mean shape, no shape": without_shapes(with_offsets(model, nominal)),
        "skinning, dressed on the body": follow_skin(model, shaped),
        "skinning": without_shapes(with_offsets(model, model.tables.offset)),
    }
    return {name: (variant, shaped) for name, variant in variants.items()}


def errors_on_random_bodies(
    model: AnimatorAgentDress,
    pairs: Iterable[Pair],
    models: Mapping[str, PoseModel],
    system: PaperSystem | None = None,
) -> Errors:
    """Returns the errors of all variants on the random bodies, see `variants_of`, and of the system of the paper."""
    errors: dict[str, list[float]] = {}
    for pair in pairs:
        for name, vertices in _garments_of_paper(system, pair).items():
            errors.setdefault(name, []).append(mean_distance_mm(vertices, pair.worn))
        for name, (variant, shaped) in variants_of(model, pair, models).items():
            error = mean_distance_mm(variant.drape(shaped.posed(pair.pose)), pair.worn)
            errors.setdefault(name, []).append(error)
    return errors


def _garments_of_paper(system: PaperSystem | None, pair: Pair) -> dict[str, Points]:
    """Returns what the system of the paper and its ablation show in a pair, by name [m]."""
    if system is None:
        return {}
    posed = system.body.shaped(pair.betas).posed(pair.pose)
    return {
        "the paper's system": system.drape(posed),
        "the paper's system, simulation as pose model": system.drape(posed, pair.mean.astype(np.float64)),
        "the paper's system without its first-order module": system.without_first_order(posed),
    }


def model_errors_mm(model: AnimatorAgentDress, pairs: Iterable[Pair]) -> list[float]:
    """Returns the errors of a model on the random bodies, as it plays [mm]."""
    body = bodies.load(model.body_name)
    return [mean_distance_mm(model.drape(body.shaped(pair.betas).posed(pair.pose)), pair.worn) for pair in pairs]


def errors_on_mean_body(model: AnimatorAgentDress, pairs: Iterable[Pair], models: Mapping[str, PoseModel]) -> Errors:
    """Returns the errors of pose models alone, on the mean shape."""
    errors: dict[str, list[float]] = {}
    mean, binding = bodies.load(model.body_name).shaped(), binding_of(model)
    for pair in pairs:
        posed = mean.posed(pair.pose)
        garments = {"kernel regression": model.drape(posed)}
        for name, each in models.items():
            garments[name] = binding.skin(posed.transforms, model.tables.rest, each(pair.pose))
        garments["skinning"] = without_shapes(with_offsets(model, model.tables.offset)).drape(posed)
        for name, vertices in garments.items():
            errors.setdefault(name, []).append(mean_distance_mm(vertices, pair.mean))
    return errors


def binding_of(model: AnimatorAgentDress) -> Binding:
    """Returns the skin weights of a model's garment."""
    tables = model.tables
    return Binding(tables.indices, tables.weights, tables.nearest)
