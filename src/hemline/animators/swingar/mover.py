"""What moves a proxy: either network behind one door."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hemline.animators.swingar.features.proxy_on_body import ProxyOnBody
from hemline.animators.swingar.features.trail import Trail
from hemline.animators.swingar.graph.graph_inputs import body_inputs, garment_inputs, vertex_inputs
from hemline.animators.swingar.graph.history import History, Seen
from hemline.animators.swingar.graph.runtime import PlayedEstimator
from hemline.animators.swingar.lag.lag_net import LagNet
from hemline.arrays import Float
from hemline.bodies import PosedBody
from hemline.motions.motion import Pose

Moved = tuple[History | None, Float[np.ndarray, "coarse 3"]]
"""What is remembered, and where the proxy's vertices are [m]."""


class Mover(Protocol):
    """A network with its inputs."""

    def prepared(self, proxy: ProxyOnBody) -> Any:
        """What it knows of a garment once and for all."""
        ...

    def start(self, pose: Pose) -> History | None:
        """What it remembers of a body that has always stood so, beside the Trail."""
        ...

    def moved(
        self, prepared: Any, proxy: ProxyOnBody, trail: Trail, history: History | None, posed: PosedBody
    ) -> Moved:
        """The proxy on a posed body."""
        ...

    def arrays(self) -> Mapping[str, np.ndarray]:
        """Its weights by name, as model files hold them."""
        ...


@dataclass(frozen=True, eq=False)
class LagMover:
    """The lag network; all that it remembers is the Trail."""

    net: LagNet

    def prepared(self, proxy: ProxyOnBody) -> Any:
        """The part of the first layer that does not change."""
        return self.net.static(proxy.static)

    def start(self, pose: Pose) -> None:
        """Nothing."""

    def moved(
        self, prepared: Any, proxy: ProxyOnBody, trail: Trail, history: History | None, posed: PosedBody
    ) -> Moved:
        """Skinning, displaced."""
        displacements = self.net.displacements(prepared, trail.told(proxy, posed), proxy.cells)
        return None, trail.displaced(displacements)

    def arrays(self) -> Mapping[str, np.ndarray]:
        """In half precision, which is all that they are worth; biases in single."""
        found = {f"weight.{name}": array.astype(np.float16) for name, array in self.net.weights.items()}
        return found | {f"bias.{name}": array.astype(np.float32) for name, array in self.net.biases.items()}


@dataclass(frozen=True, eq=False)
class GraphMover:
    """The paper's estimator."""

    estimator: PlayedEstimator

    def prepared(self, proxy: ProxyOnBody) -> Any:
        """The garment, encoded."""
        given = garment_inputs(proxy, self.estimator.config.descriptor)
        return self.estimator.garment(given.graph, given.features, given.descriptor, given.skin_logits)

    def start(self, pose: Pose) -> History:
        """The first pose, 65 times."""
        return History.always(pose)

    def moved(
        self, prepared: Any, proxy: ProxyOnBody, trail: Trail, history: History | None, posed: PosedBody
    ) -> Moved:
        """The coarse mesh, and its corrective displacement where one was admitted."""
        assert history is not None
        seen, told, turns = Seen.of(posed.pose), None, None
        if self.estimator.config.told:
            told, turns = vertex_inputs(trail.told(proxy, posed), proxy.static), seen.turns(trail.turns)
        given = history.times.window(), seen.transforms(posed), told, turns
        coarse, _, _ = self.estimator.coarse(prepared, *given)
        history = history.with_mesh(seen.out(coarse), posed.joints)
        if self.estimator.arrays["corrective_scale"][0] == 0:
            return history, history.meshes[-1]
        meshes, joints = (seen.into(each) for each in history.last_meshes())
        body = body_inputs(proxy.shaped, posed, seen)
        return history, seen.out(meshes[-1] + self.estimator.corrective(prepared, meshes, joints, body))

    def arrays(self) -> Mapping[str, np.ndarray]:
        """In half precision."""
        return {f"graph.{name}": array.astype(np.float16) for name, array in self.estimator.arrays.items()}
