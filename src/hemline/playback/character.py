"""A dressed character at rest, for engines that swing its garment of rope chains themselves."""

import numpy as np

from hemline.animators import Animator, Wearable
from hemline.animators.ropes import AnimatorRopes
from hemline.animators.ropes.springs import chain_weights, spring_chains, t_pose
from hemline.animators.terms import terms_of
from hemline.arrays import AnyFaces, AnyVertices, Float, Int, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.errors import BadInput
from hemline.export import BoundMesh, DressedCharacter
from hemline.motions.motion import JOINT_NAMES
from hemline.motions.terms import as_stated
from hemline.playback.draw_in import draw_in
from hemline.playback.player.player import Player

CLOTH, SKIN = (0.72, 0.23, 0.17), (0.70, 0.68, 0.66)
_SETTLING_SECONDS = 4.0
"""Time in which the garment settles in the T-pose [s]."""
INFLUENCES = 4
"""Largest number of bones that move a vertex."""
Weights = tuple[Int[np.ndarray, "_verts 4"], Float[np.ndarray, "_verts 4"]]
"""Bones of each vertex, and their weights."""


def character(animator: Animator | Wearable, body: ShapedBody, *, influences: int = INFLUENCES) -> DressedCharacter:
    """Returns a body in the T-pose with its garment settled, and the chains of the model as spring bones.

    Args:
        animator: A model of rope chains.
        body: A body of the kind of the fit, of any shape. Its skin below the garment is drawn in (`draw_in`).
        influences: Largest number of bones that move a vertex, 1 to 4; phones often allow 2.

    Raises:
        BadInput: The model has no chains, the number of influences is another; or see `Player.prepare`.
    """
    if influences not in range(1, INFLUENCES + 1):
        what = "a vertex of a character follows one to four bones"
        raise BadInput(what, f"influences = {influences}", "give a number from 1 to 4")
    if not isinstance(animator, AnimatorRopes):
        cure = "name one of kind 'ropes', such as cape or skirt"
        raise BadInput("spring bones are made of rope chains", f"a model of kind '{animator.name}'", cure)
    posed = t_pose(body)
    vertices = _settle(animator, posed)
    ropes = animator.ropes
    chains, capsules = spring_chains(ropes, ropes.positions_on(vertices), posed, animator.springs)
    garment = animator.garment
    carried = posed.transforms[np.repeat(chains.joints, np.diff(chains.offsets))]
    transforms, places = np.concatenate([posed.transforms, carried]), np.concatenate([posed.joints, chains.bones])
    cloth_weights = _largest_weights(*chain_weights(ropes, garment.vertices), influences)
    skin = _largest_weights(body.body.weight_indices, body.body.weights, influences)
    flesh_vertices = draw_in(posed, vertices, garment.faces)
    cloth = _bind_mesh(garment.name, vertices, garment.faces, CLOTH, cloth_weights, transforms, places)
    flesh = _bind_mesh("body", flesh_vertices, posed.faces, SKIN, skin, np.asarray(posed.transforms), posed.joints)
    licence = body.body.licence
    notices = as_stated((licence, *terms_of(animator)))
    return DressedCharacter(
        name=garment.name,
        joint_names=JOINT_NAMES,
        joints=posed.joints,
        parents=body.body.parents,
        meshes=(cloth, flesh),
        chains=chains,
        capsules=capsules,
        notices=notices,
    )


def _settle(animator: Animator, posed: PosedBody) -> Vertices:
    player = Player.prepare(animator, posed.shaped)
    _, frame = player.step(player.start(posed.pose, pre_roll=_SETTLING_SECONDS), posed.pose, 1 / 30)
    return frame.vertices


def _largest_weights(bones: np.ndarray, weights: np.ndarray, count: int) -> Weights:
    """Returns the largest weights of each vertex, normalised, and their bones; weights past `count` are 0."""
    order = np.argsort(-weights, axis=1, kind="stable")[:, :INFLUENCES]
    bones, weights = (np.take_along_axis(each, order, axis=1) for each in (bones, weights))
    weights = np.where(np.arange(INFLUENCES) < count, weights, 0)
    return bones, weights / weights.sum(axis=1, keepdims=True)


def _bind_mesh(
    name: str,
    vertices: AnyVertices,
    faces: AnyFaces,
    colour: tuple[float, float, float],
    weights_of: Weights,
    transforms: Float[np.ndarray, "bones 3 4"],
    places: Float[np.ndarray, "bones 3"],
) -> BoundMesh:
    r"""Returns a mesh that its bones deform as hemline skins it.

    With transforms $A_j$ from the rest pose of the body to the T-pose (a chain has that of the joint that carries it)
    and bones at $x_j$, the bind matrix is $A_j$ translated by $-x_j$. The mesh is stored at
    $(\sum_j w_{ij} A_j)^{-1} v_i$, so that in the T-pose its vertices are at $v_i$.
    """
    bones, weights = weights_of
    transforms = np.asarray(transforms, np.float64)
    blended = np.einsum("vi,virc->vrc", weights, transforms[bones])
    rest = np.linalg.solve(blended[..., :3], (vertices - blended[..., 3])[..., None])[..., 0]
    binds = transforms.copy()
    binds[..., 3] -= places
    return BoundMesh(name, rest, faces, colour, bones, weights, binds)
