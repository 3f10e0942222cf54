"""Arrays and metadata of rope chains in a page, for one shape of the body."""

import numpy as np

from hemline.animators.ropes import AnimatorRopes
from hemline.bodies import ShapedBody

from .parts import PagePart, basis_arrays, nearest_skin, short_numbers

_CHAINS = ("offsets", "lengths", "rest_spans", "rest_directions", "chain_joints", "pairs", "pair_spans", "balance")
_DERIVED = ("rest_tensions", "rest_loads", "inverse_masses", "margins", "across", "kinematic", "parents")


def ropes_part(model: AnimatorRopes, body: ShapedBody) -> PagePart:
    """Returns chains, networks and bases, with rest drape, roots and colliders as `start` places them on this body.

    Args:
        model: The model.
        body: The body that wears the garment.

    Raises:
        BadInput: The body is not that of the fit.
    """
    posed, ropes = body.posed(body.rest_pose), model.ropes
    state = model.start(posed)
    moving, cones = state.bones.ropes, ropes.primitives
    shift = body.joints[ropes.key_index] - ropes.primitives.pivots[ropes.key_index]
    chains = {name: getattr(ropes.chains, name) for name in (*_CHAINS, *_DERIVED)} | {
        "gentle_substep": np.array([min(ropes.chains.gentle_substep, 1e30)]),
        "carriage_weights": ropes.carriage.weights,
        "carriage_rest": moving.kinematic_rest,
        "rest": ropes.rest + shift,
        "rest_bones": state.rest_bones,
        "pivots": moving.pivots,
        "cone_joints": cones.joints,
        "cone_shapes": moving.shapes,
    }
    arrays = {f"ropes.{name}": array for name, array in chains.items()}
    for name in ("skinning", "shape", "correction"):
        arrays |= {f"{name}.{key}": array for key, array in getattr(model, name).arrays().items()}
    arrays |= basis_arrays(model.skinning_basis, "skinning_basis") | basis_arrays(model.shape_basis, "shape_basis")
    metadata = {"animator": "ropes", "key": ropes.key_index, "constants": ropes.constants.as_dict()}
    arrays |= {
        "rest": state.rest,
        "faces": short_numbers(model.garment.faces, len(state.rest)),
        "nearest": nearest_skin(state.rest, body.vertices),
    }
    return PagePart(arrays, metadata)
