"""The estimator of dynamic deformation for training: encoders, coarse mesh and corrective displacement."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from hemline.animators.coarse.features.descriptor import COMPRESSION
from hemline.animators.swingar.estimator_config import (
    CHANGE_FACTOR,
    CORRECTIVE_WIDTH,
    JOINTS,
    MESHES,
    POSE_WIDTH,
    VERTEX_WIDTH,
    EstimatorConfig,
    weight_shapes,
)
from hemline.animators.swingar.graph import Graph
from hemline.learning.fit.device import full_precision

from .layers import GatLn, condense_heads

START_SCALE = 0.01
"""Initial scale of the blend shape [m]."""
LOGIT_SCALE = 0.1
"""Initial scale of the terms that are added to the logits of the skin weights."""


@dataclass(frozen=True, eq=False)
class GarmentCode:
    """A garment as the estimator encodes it once for all frames."""

    graph: Graph
    """Graph of the garment."""
    positions: Tensor
    """Vertices at rest (verts, 3) [m]."""
    features: Tensor
    """Graph features (1, joints, verts, motion)."""
    shape: Tensor
    """Shape features (joints,)."""
    logits: Tensor
    """Logits of the skin weights (verts, joints)."""


class Estimator(nn.Module):
    """SwinGar's estimator W. It predicts a moving garment from the garment at rest, the poses of a body and its shape.

    All coordinates are those of the pelvis in the present frame, with its heading removed (Section III-C).

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Sections III-C and IV, Eq. 6.
    Differs: heads of a layer stay separate up to the 24 joints; the last layers of the fully connected encoders are
        linear; logits of the dynamic weights start at those of skinning; features of vertices, if there are any, reach
        the state encoder, the blend shape and a displacement of each vertex of the coarse mesh, which begins at zero;
        the blend shape and the corrective displacement are scaled by small learned factors, that of the corrective one
        beginning at zero; the corrective predictor is given earlier coarse meshes by their enlarged change, see
        `CHANGE_FACTOR`; the inverse hyperbolic sine of the descriptor is encoded.
    """

    def __init__(self, config: EstimatorConfig | None = None):
        super().__init__()
        self.config = c = config or EstimatorConfig()
        alpha = c.scale
        self.graph_first = GatLn(VERTEX_WIDTH, c.graph, JOINTS, alpha=alpha)
        self.graph_second = GatLn(c.graph, c.motion, JOINTS, alpha=alpha)
        if c.global_shape == "spectral":
            self.shape = _dense_layers(c.descriptor, 256, 128, JOINTS)
        elif c.global_shape == "pooled":
            self.shape = nn.Linear(c.motion, JOINTS)
        self.motion = nn.LSTM(POSE_WIDTH, c.motion, batch_first=True)
        self.body = _dense_layers(c.body, 256, 128, c.corrective)
        self.state = GatLn(c.motion, c.state, JOINTS, alpha=alpha, extra=c.state_told)
        self.weight = nn.Linear(c.state, 1, bias=False)
        self.blend_first = GatLn(c.state, c.blend, 3, alpha=alpha, extra=c.told)
        self.blend_second = GatLn(c.blend, c.blend_last, 3, alpha=alpha)
        self.blend_motion = nn.Linear(c.motion, c.blend_last) if c.motion != c.blend_last else nn.Identity()
        self.blend_scale = nn.Parameter(torch.full((1,), START_SCALE))
        self.told_mean = nn.Buffer(torch.zeros(c.told))
        self.told_spread = nn.Buffer(torch.ones(c.told))
        if c.displacement:
            shapes, names = weight_shapes(c), ("displace_first", "displace_second", "displace")
            sizes = [shapes[f"{name}.weight"] for name in names]
            self.displace_first, self.displace_second, self.displace = (nn.Linear(size[1], size[0]) for size in sizes)
        heads = 4 * c.corrective_heads
        self.mesh_gates = GatLn(CORRECTIVE_WIDTH, c.corrective, heads, groups=4, alpha=alpha)
        self.hidden_gates = GatLn(c.corrective, c.corrective, heads, groups=4, alpha=alpha)
        self.peepholes = nn.Parameter(torch.zeros(3, c.corrective))
        self.corrective_first = GatLn(c.corrective, c.corrective, 1, alpha=alpha)
        self.corrective_second = GatLn(c.corrective, 3, 1, alpha=alpha)
        self.corrective_scale = nn.Parameter(torch.zeros(1))
        with torch.no_grad():
            self.weight.weight.mul_(LOGIT_SCALE)
            if c.displacement:
                self.displace.weight.zero_()
                self.displace.bias.zero_()

    def coarse_parameters(self) -> list[nn.Parameter]:
        """Returns the parameters of the encoders of garment, shape and motion, and of the coarse predictor."""
        corrective = {id(each) for each in self.corrective_parameters()}
        return [each for each in self.parameters() if id(each) not in corrective]

    def corrective_parameters(self) -> list[nn.Parameter]:
        """Returns the parameters of the body encoder and of the corrective predictor."""
        layers = self.body, self.mesh_gates, self.hidden_gates, self.corrective_first, self.corrective_second
        return [self.peepholes, self.corrective_scale, *(each for layer in layers for each in layer.parameters())]

    def garment(self, graph: Graph, features: Tensor, descriptor: Tensor, skin_logits: Tensor) -> GarmentCode:
        """Encodes a garment at rest.

        Args:
            graph: Graph of the garment.
            features: Normal, position [m] and distance to the body [m] of each vertex (verts, 7).
            descriptor: Spectral descriptor of the garment (descriptor,).
            skin_logits: Logits of the skin weights (verts, joints), see `graph_inputs.skin_logits`.
        """
        encoded = self.graph_second(graph, self.graph_first(graph, features[None, None]))
        if self.config.global_shape == "spectral":
            shape = self.shape(torch.asinh(COMPRESSION * descriptor))
        elif self.config.global_shape == "pooled":
            shape = self.shape(encoded[0].mean(0)).amax(0)
        else:
            shape = features.new_ones(JOINTS)
        return GarmentCode(graph, features[:, 3:6], encoded, shape, skin_logits)

    def coarse(
        self,
        garment: GarmentCode,
        motion: Tensor,
        transforms: Tensor,
        features: Tensor | None = None,
        turns: Tensor | None = None,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Predicts the coarse meshes of some independent frames.

        Args:
            garment: The garment.
            motion: The last poses (frames, poses, 75), see `POSE_WIDTH`.
            transforms: Skinning transforms of the joints (frames, joints, 3, 4).
            features: Features of the vertices (frames, verts, features); None if the estimator has none.
            turns: Rotation of each vertex by skinning, wxyz (frames, verts, 4); None if no vertices are displaced.

        Returns:
            Vertices (frames, verts, 3) [m], dynamic weights (frames, verts, joints), blend shape at rest
            (frames, verts, 3) [m].
        """
        c, extra, first = self.config, None, None
        if c.told:
            assert features is not None
            extra = (features - self.told_mean) / self.told_spread
            first = extra[..., : c.state_told].contiguous() if c.state_told else None
        moved = self.motion(motion)[1][0][0]
        state = self.state(garment.graph, garment.features, scale=moved, extra=first)
        mean, scores = condense_heads(state, self.weight.weight[0])
        weights = (scores * garment.shape + garment.logits).softmax(-1)
        blend = self.blend_first(garment.graph, mean[:, None], extra=extra)
        around = self.blend_second(garment.graph, blend)
        blend = self.blend_scale * torch.einsum("tcvd,td->tvc", around, self.blend_motion(moved))
        vertices = blend_skin(weights, transforms, garment.positions + blend)
        if c.displacement:
            assert turns is not None
            vertices = vertices + rotate(turns, self._displacements(mean, around, extra))
        return vertices, weights, blend

    def _displacements(self, state: Tensor, around: Tensor, features: Tensor | None) -> Tensor:
        """Predicts the displacement of each vertex in its frame as rotated by skinning (frames, verts, 3) [m].

        Args:
            state: Mean of the heads of the state (frames, verts, state).
            around: Features of the blend shape (frames, 3, verts, blend_last).
            features: Features of the vertices (frames, verts, features); None if the estimator has none.
        """
        context = [around.transpose(1, 2).flatten(2)] if self.config.context else []
        own = [] if features is None else [features]
        hidden = torch.relu(self.displace_first(torch.cat([state, *own, *context], dim=-1)))
        if not self.config.context:
            return self.displace(torch.relu(self.displace_second(hidden)))
        of_vertex, of_all = self.displace_second.weight.split(hidden.shape[-1], dim=1)
        mean = nn.functional.linear(hidden.mean(1, keepdim=True), of_all, self.displace_second.bias)
        return self.displace(torch.relu(nn.functional.linear(hidden, of_vertex) + mean))

    def corrective(self, garment: GarmentCode, meshes: Tensor, joints: Tensor, body: Tensor) -> Tensor:
        """Predicts the corrective displacements of some frames.

        Args:
            garment: The garment.
            meshes: The last three coarse meshes (frames, 3, verts, 3), the present one last [m].
            joints: Positions of the joints at the same times (frames, 3, joints, 3) [m].
            body: Betas and axis-angles of the present pose (frames, body).

        Returns:
            Displacements of the vertices (frames, verts, 3) [m].
        """
        graph = garment.graph
        meshes = meshes[:, -1:] + CHANGE_FACTOR * (meshes - meshes[:, -1:])
        hidden = cell = meshes.new_zeros(())
        for step in range(MESHES):
            mesh = meshes[:, step]
            features = torch.cat([mesh, _distances(mesh, joints[:, step])], dim=-1)
            gates = self.mesh_gates(graph, features[:, None])
            if step:
                gates = gates + self.hidden_gates(graph, hidden[:, None])
            opened = torch.sigmoid(gates[:, :3] + (self.peepholes[:, None] * cell[:, None] if step else 0.0))
            cell = opened[:, 0] * torch.tanh(gates[:, 3] + (opened[:, 1] * cell if step else 0.0))
            hidden = opened[:, 2] * torch.tanh(cell)
        out = self.corrective_first(graph, hidden[:, None], scale=self.body(body))
        return self.corrective_scale * self.corrective_second(graph, out)[:, 0]


def blend_skin(weights: Tensor, transforms: Tensor, points: Tensor) -> Tensor:
    """Applies linear blend skinning; returns vertices (frames, verts, 3) [m].

    Args:
        weights: Skin weights of each vertex (frames, verts, joints).
        transforms: Skinning transforms of the joints (frames, joints, 3, 4) [m].
        points: Vertices at rest (verts, 3), or those of each frame (frames, verts, 3) [m].
    """
    with full_precision():
        blended = (weights @ transforms.flatten(2)).unflatten(2, (3, 4))
        return (blended[..., :3] @ points[..., None])[..., 0] + blended[..., 3]


def _distances(points: Tensor, others: Tensor) -> Tensor:
    """Returns the distances of points (frames, verts, 3) to others (frames, joints, 3), not by way of products."""
    return torch.cdist(points, others, compute_mode="donot_use_mm_for_euclid_dist")


def rotate(turns: Tensor, vectors: Tensor) -> Tensor:
    """Rotates vectors (..., 3) by unit quaternions, wxyz (..., 4)."""
    scalar, axis = turns[..., :1], turns[..., 1:]
    cross = 2 * torch.linalg.cross(axis, vectors)
    return vectors + scalar * cross + torch.linalg.cross(axis, cross)


def cost(config: EstimatorConfig, vertex_count: int, *, ring: float = 7.0) -> dict[str, tuple[int, int]]:
    """Counts the weights of each part and its operations in one frame.

    Args:
        config: The sizes.
        vertex_count: Number of vertices.
        ring: Mean number of vertices in a ring.

    Returns:
        Numbers of weights and of floating point operations by part; a multiplication with an addition counts as two.
        The parts that encode a garment come first; a frame does not need them.
    """
    estimator, per_frame = Estimator(config), {"hidden_gates": MESHES - 1, "mesh_gates": MESHES}

    def weights_of(module: nn.Module) -> int:
        return sum(each.numel() for each in module.parameters())

    def work_of(name: str, module: nn.Module) -> int:
        if isinstance(module, GatLn):
            heads, inputs, outputs = module.weights.shape
            each = 2 * (inputs + module.extra_weights.shape[1]) * outputs + 6 * outputs + 2 * int(ring) * outputs
            return vertex_count * heads * each * per_frame.get(name, 1)
        if isinstance(module, nn.LSTM):
            return 2 * 65 * weights_of(module)
        times = vertex_count * JOINTS if name == "weight" else vertex_count if name.startswith("displace") else 1
        return 2 * weights_of(module) * times

    counts = {name: (weights_of(part), work_of(name, part)) for name, part in estimator.named_children()}
    return {name: each for name, each in counts.items() if each[0]}


def _dense_layers(inputs: int, *sizes: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    for size in sizes:
        layers += [nn.Linear(inputs, size), nn.ReLU()]
        inputs = size
    return nn.Sequential(*layers[:-1])
