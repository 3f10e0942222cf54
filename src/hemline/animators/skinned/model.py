"""A settled garment that is skinned with the body, on bodies of any shape."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from hemline.animators.own_body import refuse_other_body
from hemline.animators.proxy_animator import DressedProxy, ProxyAnimator, read_proxy, rest_of_proxy, settle_proxy
from hemline.animators.rigid_transform import RigidTransform
from hemline.animators.soft_weights import SoftWeights, soft_weights
from hemline.arrays import Vertices
from hemline.bodies import PosedBody, ShapedBody, skin_points
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, entry
from hemline.garments import Garment
from hemline.garments.proxy.embedding import Embedding
from hemline.garments.proxy.proxy import ProxySize
from hemline.options import options_of

from .config import SkinnedConfig

SKINNED_VERSION = 1
"""Version of what model files hold under `skinned`."""


class SkinnedOnBody(NamedTuple):
    """What a step needs on one shape of the body."""

    rest: Vertices
    """The settled garment in the rest pose of the body [m], float32."""
    skin: SoftWeights
    """Joints of each vertex, and their weights."""


@dataclass(frozen=True, eq=False)
class AnimatorSkinned(ProxyAnimator[SkinnedOnBody]):
    r"""A garment that settled once on a body and follows its joints: $x = \sum_j w_j A_j \bar x$.

    It has no memory and no dynamics. It is the baseline of what is learned, and the cheapest animator of all.

    Attributes:
        garment: The garment.
        rest: The proxy settled on the body that the garment was made for (coarse, 3) [m], float32.
        body_name: Name of that body.
        body_hash: Hash of that body.
        config: Size of the proxy.
    """

    config: SkinnedConfig

    @classmethod
    def on(cls, garment: Garment, body: ShapedBody, config: SkinnedConfig) -> Self:
        """Dresses a body in a garment and settles it, which takes a few seconds.

        Raises:
            BadGarment: The garment was made for another body.
        """
        return cls(*settle_proxy(garment, body, config.size), config)

    @property
    def name(self) -> str:
        """Name of the kind of animator."""
        return "skinned"

    @property
    def size(self) -> ProxySize:
        """Size of the proxy."""
        return self.config.size

    @property
    def figures(self) -> Mapping[str, float]:
        """No figures, since nothing was fitted."""
        return {}

    def start(self, posed: PosedBody) -> None:
        """Prepares the garment on a body of any shape, on a new one by settling it. There is no State.

        Raises:
            BadInput: The body is another one than that of the garment.
        """
        refuse_other_body(self, posed.shaped)
        self._on(posed.shaped)

    def step(self, state: None, posed: PosedBody, dt: float) -> tuple[None, Vertices]:
        """Returns None, as there is no State, and the skinned garment in the world (verts, 3) [m].

        Args:
            state: None.
            posed: The body now.
            dt: Time since the last step, which does not matter [s].
        """
        on_body = self._on(posed.shaped)
        return None, skin_points(posed.transforms, on_body.skin.joints, on_body.skin.weights, on_body.rest)

    def relocate(self, state: None, shaped: ShapedBody, transform: RigidTransform) -> None:
        """Does nothing, as there is no State that could hold a place in the world."""

    def _prepare(self, dressed: DressedProxy, shaped: ShapedBody) -> SkinnedOnBody:
        coarse = rest_of_proxy(dressed.coarse, shaped) if dressed.rest is None else dressed.rest
        embedding = Embedding.of(dressed.fine, dressed.coarse, dressed.vertex_ids)
        rest = embedding.fine_vertices(coarse.astype(np.float64)).astype(np.float32)
        return SkinnedOnBody(rest, soft_weights(rest, shaped.body, shaped.vertices))

    def save(self, path: str | Path) -> None:
        """Writes a model file, whole or not at all: the garment, its settled proxy and the options.

        Raises:
            BadOutput: The path cannot be written.
        """
        extra = {"skinned": {"version": SKINNED_VERSION}}
        self._save(path, {}, config=asdict(self.config), figures=self.figures, licences=[], extra=extra)

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Reads the animator from the contents of a model file.

        Raises:
            BadModel: The file is of another version, a key is missing or of another type, or an array does not have the
                dtype or the shape that the garment needs.
        """
        version = entry(metadata, "skinned", dict).get("version")
        if version != SKINNED_VERSION:
            what = f"this hemline reads version {SKINNED_VERSION} of skinned garments"
            raise BadModel(what, f"version {version}", AGAIN)
        config = options_of(SkinnedConfig, entry(metadata, "config", dict), error=BadModel)
        return cls(*read_proxy(arrays, metadata, config.size), config)
