"""The paper's network with its inputs, as `coarse.network.Network` asks."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from hemline.animators.coarse.features.seen import PelvisFrame, body_inputs
from hemline.animators.coarse.features.trail import Trail
from hemline.animators.coarse.network import Prediction
from hemline.animators.coarse.proxy_on_body import ProxyOnBody
from hemline.bodies import PosedBody
from hemline.motions.motion import Pose

from .graph_inputs import garment_inputs, vertex_inputs
from .history import History
from .runtime import RuntimeEstimator


@dataclass(frozen=True, eq=False)
class GraphNetwork:
    """The estimator."""

    estimator: RuntimeEstimator

    def prepare(self, proxy: ProxyOnBody) -> Any:
        """The garment, encoded."""
        given = garment_inputs(proxy, self.estimator.config.descriptor)
        return self.estimator.garment(given.graph, given.features, given.descriptor, given.skin_logits)

    def start(self, pose: Pose) -> History:
        """The first pose, 65 times."""
        return History.standing(pose)

    def predict(self, prepared: Any, proxy: ProxyOnBody, trail: Trail, history: History, posed: PosedBody) -> Prediction:
        """The coarse mesh, and its corrective displacement where one was admitted."""
        seen, told, turns = PelvisFrame.of(posed.pose), None, None
        if self.estimator.config.features:
            told, turns = vertex_inputs(trail.features(proxy, posed), proxy.static), seen.turns(trail.turns)
        given = history.times.window(), seen.transforms(posed), told, turns
        coarse, _, _ = self.estimator.coarse(prepared, *given)
        history = history.with_mesh(seen.to_world(coarse), posed.joints)
        if self.estimator.arrays["corrective_scale"][0] == 0:
            return history, history.meshes[-1]
        meshes, joints = (seen.to_local(each) for each in history.last_meshes())
        body = body_inputs(proxy.shaped, posed, seen)
        return history, seen.to_world(meshes[-1] + self.estimator.corrective(prepared, meshes, joints, body))

    def arrays(self) -> Mapping[str, np.ndarray]:
        """Weights in half precision, by name."""
        return {f"graph.{name}": array.astype(np.float16) for name, array in self.estimator.arrays.items()}

    def extra(self) -> Mapping[str, Any]:
        """Sizes of the estimator, which model files say."""
        return {"estimator": asdict(self.estimator.config)}
