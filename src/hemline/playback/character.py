"""A body in a garment of rope chains, at rest, for engines that swing it themselves."""

import numpy as np

from hemline.animators import Animator
from hemline.animators.ropes import AnimatorRopes
from hemline.arrays import Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.errors import BadInput
from hemline.export import BoundMesh, Character, bound
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES, Pose

from .player import Player
from .springs import capsules_of, chain_weights, spring_chains

CLOTH, SKIN = (0.72, 0.23, 0.17), (0.70, 0.68, 0.66)
_SETTLING = 4.0
"""Time that the garment gets to settle in the T-pose [s]."""
_INFLUENCES = 4


def character(animator: Animator, body: ShapedBody) -> Character:
    """A body that stands in the T-pose, its garment settled, with the chains of the model as spring bones.

    Args:
        animator: A model of rope chains.
        body: A body of the kind that it was fitted on, of any shape.

    Raises:
        BadInput: The model has no chains; or as `Player.prepare`.
    """
    if not isinstance(animator, AnimatorRopes):
        what = f"spring bones are made of rope chains, which '{animator.garment.name}' does not have"
        raise BadInput(what, f"a model of kind '{animator.name}'", "name one of kind 'ropes', such as cape or skirt")
    posed = _standing(body)
    vertices = _settled(animator, posed)
    ropes, capsules = animator.ropes, capsules_of(posed)
    chains, capsules = spring_chains(ropes, ropes.embedded(vertices), capsules)
    bones, weights = chain_weights(ropes, animator.garment.vertices)
    binds = bound(np.concatenate([posed.joints, chains.bones]))
    cloth = BoundMesh(animator.garment.name, vertices, animator.garment.faces, CLOTH, bones, weights, binds)
    licence = body.body.licence
    notices = tuple(dict.fromkeys(text for text in (licence, *animator.licences) if text))
    return Character(
        name=animator.garment.name,
        joint_names=JOINT_NAMES,
        joints=posed.joints,
        parents=body.body.parents,
        meshes=(cloth, _skin(posed)),
        chains=chains,
        capsules=capsules,
        notices=notices,
    )


def _standing(body: ShapedBody) -> PosedBody:
    still = np.zeros((JOINT_COUNT, 4), np.float32)
    still[:, 0] = 1.0
    floor = body.posed(Pose(still, np.zeros(3, np.float32))).vertices[:, 1].min()
    return body.posed(Pose(still, np.array([0.0, -floor, 0.0], np.float32)))


def _settled(animator: Animator, posed: PosedBody) -> Vertices:
    player = Player.prepare(animator, posed.shaped)
    _, frame = player.step(player.start(posed.pose, pre_roll=_SETTLING), posed.pose, 1 / 30)
    return frame.vertices


def _skin(posed: PosedBody) -> BoundMesh:
    r"""The skin on its largest four weights, at rest where all six put it.

    With skin transforms $A_j$ and joints $x_j$ of the T-pose the bind is $A_j$ moved by $-x_j$, so that a turned joint
    blends what it blends in ours; vertices are $(\sum_j w_{ij} A_j)^{-1}$ of where they are in the T-pose.
    """
    body, transforms = posed.shaped.body, np.asarray(posed.transforms, np.float64)
    order = np.argsort(-body.weights, axis=1, kind="stable")[:, :_INFLUENCES]
    bones, weights = (np.take_along_axis(each, order, axis=1) for each in (body.weight_indices, body.weights))
    weights = weights / weights.sum(axis=1, keepdims=True)
    blended = np.einsum("vi,virc->vrc", weights, transforms[bones])
    rest = np.linalg.solve(blended[..., :3], (posed.vertices - blended[..., 3])[..., None])[..., 0]
    binds = transforms.copy()
    binds[..., 3] -= posed.joints
    return BoundMesh("body", rest, body.faces, SKIN, bones, weights, binds)
