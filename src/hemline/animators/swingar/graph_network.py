"""The paper's network with its inputs, as `coarse.network.Network` asks."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from hemline.animators.coarse.features.pelvis_frame import PelvisFrame, body_inputs
from hemline.animators.coarse.features.trail import Trail
from hemline.animators.coarse.network import Prediction
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.bodies import PosedBody
from hemline.errors import BadModel
from hemline.files.contents import entry, part
from hemline.motions.motion import Pose
from hemline.options import options_of

from .config import SwingarConfig
from .estimator_config import EstimatorConfig
from .graph_inputs import garment_inputs, vertex_inputs
from .history import History
from .runtime import EncodedGarment, RuntimeEstimator


@dataclass(frozen=True, eq=False)
class GraphNetwork:
    """The estimator with its inputs."""

    estimator: RuntimeEstimator

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], config: SwingarConfig, own: Mapping[str, Any]) -> Self:
        """Reads the network from a model file, see `coarse.weights.NetworkReader`; raises BadModel."""
        sizes = options_of(EstimatorConfig, entry(own, "estimator", dict), error=BadModel)
        return cls(RuntimeEstimator.of(sizes, part(arrays, "graph")))

    def prepare(self, proxy: ProxyOnBody) -> EncodedGarment:
        """Encodes the garment."""
        inputs = garment_inputs(proxy, self.estimator.config.descriptor)
        return self.estimator.garment(inputs.graph, inputs.features, inputs.descriptor, inputs.skin_logits)

    def start(self, pose: Pose) -> History:
        """Returns the history of a body that has always stood in one pose."""
        return History.standing(pose)

    def predict(
        self, prepared: EncodedGarment, proxy: ProxyOnBody, trail: Trail, history: History, posed: PosedBody
    ) -> Prediction:
        """Predicts the coarse mesh, with its corrective displacement if the fit admitted one."""
        local, features, turns = PelvisFrame.of(posed.pose), None, None
        if self.estimator.config.told:
            features = vertex_inputs(trail.features(proxy, posed), proxy.static)
            turns = local.local_turns(trail.turns)
        inputs = history.poses.window(), local.local_transforms(posed), features, turns
        coarse, _, _ = self.estimator.coarse(prepared, *inputs)
        history = history.with_mesh(local.to_world(coarse), posed.joints)
        if self.estimator.arrays["corrective_scale"][0] == 0:
            return history, history.meshes[-1]
        meshes, joints = (local.to_local(each) for each in history.last_meshes())
        body = body_inputs(proxy.shaped, posed, local)
        return history, local.to_world(meshes[-1] + self.estimator.corrective(prepared, meshes, joints, body))

    def arrays(self) -> Mapping[str, np.ndarray]:
        """Returns the weights in half precision by their names in model files."""
        return {f"graph.{name}": array.astype(np.float16) for name, array in self.estimator.arrays.items()}

    def extra(self) -> Mapping[str, Any]:
        """Returns the sizes of the estimator, which model files store."""
        return {"estimator": asdict(self.estimator.config)}
