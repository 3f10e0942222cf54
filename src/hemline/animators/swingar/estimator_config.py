"""Sizes of the estimator."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

from hemline.animators.coarse.features.pose_history import POSE_WIDTH
from hemline.errors import BadInput
from hemline.motions.motion import JOINT_COUNT
from hemline.options import check_options, not_negative, positive

JOINTS = JOINT_COUNT
"""Number of joints of a body, and of heads of the layers that make skin weights."""
VERTEX_WIDTH = 7
"""Numbers of one vertex: normal, position [m], signed distance of the rest garment to the body [m]."""
MESHES = 3
"""Number of coarse meshes that the corrective predictor is given: the present one and two before it."""
CHANGE_FACTOR = 10.0
"""Factor by which earlier coarse meshes are moved away from the present one before the corrective predictor sees them.
In a frame a mesh moves by centimetres, which the predictor is slow to see beside positions of a metre."""
CORRECTIVE_WIDTH = 3 + JOINTS
"""Numbers of one vertex of a coarse mesh: its position [m] and its distance to each joint [m]."""


@dataclass(frozen=True)
class EstimatorConfig:
    """Options of the estimator. The defaults are the paper's sizes; `lean()` has smaller ones.

    Model files store the names of these fields.
    """

    descriptor: int = positive(256)
    """Number of entries of the spectral descriptor."""
    global_shape: Literal["spectral", "pooled", "none"] = "spectral"
    """Shape features of the whole garment: its descriptor, the largest value of each graph feature, or none (Table
    I)."""
    alpha: float = not_negative(2.0)
    """Scale of the attention scores."""
    lipschitz: bool = True
    """Whether scores are normalised. Without it this is ordinary graph attention (Fig. 8)."""
    told: int = not_negative(0)
    """Number of features of a vertex that change and reach the blend shape and the displacement. The paper has 0."""
    state_told: int = not_negative(0)
    """Number of these features, the first ones, that reach the state encoder as well."""
    displacement: int = not_negative(0)
    """Width of the layers that displace each vertex of the coarse mesh. With 0, as in the paper, there are none."""
    context: bool = False
    """Whether the displacement of a vertex depends on the layers of the blend shape, which reach two rings further, and
    on the mean over all vertices."""
    body: int = positive(82)
    """Number of entries of the body encoder: betas, and 72 of axis-angles."""
    graph: int = positive(64)
    """Width of the first layer of the graph encoder, per head."""
    motion: int = positive(128)
    """Width of the motion feature, and of the second layer of the graph encoder, per head."""
    state: int = positive(128)
    """Width of the state encoder, per head."""
    blend: int = positive(256)
    """Width of the first layer of the blend shape, per head."""
    blend_last: int = positive(128)
    """Width of the second layer of the blend shape, per head."""
    corrective: int = positive(64)
    """Width of the corrective predictor, and of the body feature."""
    corrective_heads: int = positive(8)
    """Number of heads of each of the eight attention maps of the corrective predictor."""

    def __post_init__(self) -> None:
        check_options(self, "option of the estimator")
        if self.state_told > self.told:
            what = "option of the estimator 'state_told' must be at most 'told'"
            raise BadInput(what, f"{self.state_told} of {self.told}", "give fewer")
        if self.body <= 3 * JOINTS:
            what = f"option of the estimator 'body' must count betas beside {3 * JOINTS} numbers of the pose"
            raise BadInput(what, self.body, f"give more than {3 * JOINTS}")

    @classmethod
    def lean(cls, **others: Any) -> "EstimatorConfig":
        """Returns sizes that learn as much as the full ones with two thirds of the weights.

        Args:
            others: Further options.
        """
        return cls(state=64, blend=128, blend_last=64, corrective_heads=4, **others)

    @property
    def scale(self) -> float | None:
        """Scale of scores as a layer expects it; None if scores are not normalised."""
        return self.alpha if self.lipschitz else None


def weight_shapes(config: EstimatorConfig) -> dict[str, tuple[int, ...]]:
    """Returns the shape of each array of weights by its name in `Estimator.state_dict()`. No shape depends on a mesh.

    Args:
        config: The sizes.
    """
    c, heads = config, 4 * config.corrective_heads
    shapes: dict[str, tuple[int, ...]] = {
        "blend_scale": (1,),
        "told_mean": (c.told,),
        "told_spread": (c.told,),
        "peepholes": (3, c.corrective),
        "corrective_scale": (1,),
        "motion.weight_ih_l0": (4 * c.motion, POSE_WIDTH),
        "motion.weight_hh_l0": (4 * c.motion, c.motion),
        "motion.bias_ih_l0": (4 * c.motion,),
        "motion.bias_hh_l0": (4 * c.motion,),
        "weight.weight": (1, c.state),
    }
    layers = {
        "graph_first": (JOINTS, VERTEX_WIDTH, 0, c.graph),
        "graph_second": (JOINTS, c.graph, 0, c.motion),
        "state": (JOINTS, c.motion, c.state_told, c.state),
        "blend_first": (3, c.state, c.told, c.blend),
        "blend_second": (3, c.blend, 0, c.blend_last),
        "mesh_gates": (heads, CORRECTIVE_WIDTH, 0, c.corrective),
        "hidden_gates": (heads, c.corrective, 0, c.corrective),
        "corrective_first": (1, c.corrective, 0, c.corrective),
        "corrective_second": (1, c.corrective, 0, 3),
    }
    for name, (count, inputs, extra, outputs) in layers.items():
        shapes[f"{name}.weights"] = (count, inputs, outputs)
        shapes[f"{name}.extra_weights"] = (count, extra, outputs)
        shapes[f"{name}.vectors"] = (count, 2, outputs)
    connected = {"body": (c.body, 256, 128, c.corrective)}
    if c.global_shape == "spectral":
        connected["shape"] = (c.descriptor, 256, 128, JOINTS)
    for name, sizes in connected.items():
        for i, (inputs, outputs) in enumerate(pairwise(sizes)):
            shapes[f"{name}.{2 * i}.weight"], shapes[f"{name}.{2 * i}.bias"] = (outputs, inputs), (outputs,)
    single = {"shape": (c.motion, JOINTS)} if c.global_shape == "pooled" else {}
    single |= {"blend_motion": (c.motion, c.blend_last)} if c.motion != c.blend_last else {}
    if c.displacement:
        wide, own = c.displacement, c.state + c.told + (3 * c.blend_last if c.context else 0)
        joined = 2 * wide if c.context else wide
        single |= {"displace_first": (own, wide), "displace_second": (joined, wide), "displace": (wide, 3)}
    for name, (inputs, outputs) in single.items():
        shapes[f"{name}.weight"], shapes[f"{name}.bias"] = (outputs, inputs), (outputs,)
    return shapes
