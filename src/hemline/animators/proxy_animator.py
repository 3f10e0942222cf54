"""The base class of animators whose garment is carried by a proxy, a coarse copy of it."""

import threading
import warnings
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from hemline.arrays import Float, Int
from hemline.bodies import ShapedBody
from hemline.collide.close.worn_shape import relax_torn
from hemline.compiled import real_time_threads
from hemline.errors import HemlineWarning, SimulationFailed
from hemline.files.contents import array_of, damage_as_bad_model, entry
from hemline.garments import Garment
from hemline.garments.proxy.proxy import ProxySize, proxy_of

from .model_file import garment_of, save_model
from .settle import settle_garment

Prepared = TypeVar("Prepared")
"""What an animator prepares for one shape of the body."""


class SettledProxy(NamedTuple):
    """The first fields of a `ProxyAnimator`."""

    garment: Garment
    rest: Float[np.ndarray, "coarse 3"]
    body_name: str
    body_hash: str


class DressedProxy(NamedTuple):
    """A garment and its proxy on one shape of the body."""

    fine: Garment
    """The garment that is shown."""
    coarse: Garment
    """The proxy."""
    vertex_ids: Int[np.ndarray, " coarse"]
    """Index in the garment of each vertex of the proxy."""
    rest: Float[np.ndarray, "coarse 3"] | None
    """The proxy settled in the rest pose [m], float32; None if it has not settled on this shape yet."""


@dataclass(frozen=True, eq=False)
class ProxyAnimator(ABC, Generic[Prepared]):
    """A garment that is carried by a proxy, which the subclass moves. Each body shape is prepared once.

    Attributes:
        garment: The garment.
        rest: The proxy settled on the body that the garment was made for (coarse, 3) [m], float32.
        body_name: Name of that body.
        body_hash: Hash of that body.
    """

    garment: Garment
    rest: Float[np.ndarray, "coarse 3"]
    body_name: str
    body_hash: str

    _prepared: dict[bytes, Prepared] = field(default_factory=dict, init=False, repr=False)
    """What is prepared for each shape of the body, by its betas."""
    _lock: Any = field(default_factory=threading.Lock, init=False, repr=False)

    @property
    @abstractmethod
    def name(self) -> str:
        """Name of the kind of animator."""

    @property
    @abstractmethod
    def size(self) -> ProxySize:
        """Size of the proxy."""

    @abstractmethod
    def _prepare(self, dressed: DressedProxy, shaped: ShapedBody) -> Prepared:
        """Prepares what a step needs on one shape of the body."""

    @cached_property
    def coarse(self) -> tuple[Garment, Int[np.ndarray, " coarse"]]:
        """The proxy, and the index in the garment of each of its vertices."""
        return proxy_of(self.garment, self.size)

    def _on(self, shaped: ShapedBody) -> Prepared:
        """Returns what was prepared for a shape of the body; prepares it on the first call."""
        key = np.asarray(shaped.betas, np.float32).tobytes()
        with self._lock:
            if key not in self._prepared:
                (coarse, vertex_ids), own = self.coarse, self.garment.is_on(shaped)
                fine, coarse = self.garment.dressed(shaped), coarse.dressed(shaped)
                dressed = DressedProxy(fine, coarse, vertex_ids, self.rest if own else None)
                self._prepared[key] = self._prepare(dressed, shaped)
        return self._prepared[key]

    def _save(
        self,
        path: str | Path,
        arrays: Mapping[str, np.ndarray],
        *,
        config: Mapping[str, Any],
        figures: Mapping[str, float],
        licences: Sequence[str],
        extra: Mapping[str, Any],
    ) -> None:
        """Writes a model file with the garment and its settled proxy; see `model_file.save_model`."""
        save_model(
            path,
            self.name,
            {"rest": self.rest} | dict(arrays),
            garment=self.garment,
            body={"name": self.body_name, "hash": self.body_hash},
            config=config,
            figures=figures,
            licences=licences,
            extra=extra,
        )


@real_time_threads()
def settle_proxy(garment: Garment, body: ShapedBody, size: ProxySize, *, self_contact: bool = True) -> SettledProxy:
    """Dresses a body in a garment and settles its proxy, which takes a few seconds.

    A proxy that does not come to rest begins as the garment lies on the body, and settles while it is played. A close
    garment that is torn as it lies on the body is relaxed first, see `relax_torn`.

    Args:
        garment: The garment.
        body: The body that it was made for.
        size: Size of the proxy.
        self_contact: Whether the cloth collides with itself while it settles.

    Raises:
        BadGarment: The garment was made for another body.

    Warns:
        HemlineWarning: The proxy did not come to rest.
    """
    dressed = relax_torn(garment.dressed(body), body)
    coarse, _ = proxy_of(dressed, size)
    rest = rest_of_proxy(coarse, body, self_contact=self_contact)
    return SettledProxy(dressed, rest, body.body.name, body.body.hash)


def rest_of_proxy(coarse: Garment, body: ShapedBody, *, self_contact: bool = True) -> Float[np.ndarray, "coarse 3"]:
    """Settles a proxy; returns it as it lies on the body, with a warning, if it does not come to rest.

    Args:
        coarse: The proxy, dressed on the body.
        body: The body.
        self_contact: Whether the cloth collides with itself while it settles.

    Returns:
        Its vertices [m], float32.

    Warns:
        HemlineWarning: The proxy did not come to rest.
    """
    try:
        return settle_garment(coarse, body, self_contact=self_contact).astype(np.float32)
    except SimulationFailed as reason:
        what = f"the coarse copy of '{coarse.name}' did not come to rest"
        cure = "it begins as the garment lies on the body; look at its first second"
        warnings.warn(HemlineWarning(what, reason, cure), stacklevel=3)
        return coarse.vertices


def read_proxy(arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any], size: ProxySize) -> SettledProxy:
    """Reads a garment with its settled proxy from the contents of a model file.

    Raises:
        BadModel: A key is missing or of another type, or `rest` does not fit the garment and the size of its proxy.
    """
    garment, body = garment_of(arrays, metadata), entry(metadata, "body", dict)
    with damage_as_bad_model("the model's garment"):
        count = len(proxy_of(garment, size)[1])
    rest = array_of(arrays, "rest", "float32", (count, 3))
    return SettledProxy(garment, rest, entry(body, "name", str), entry(body, "hash", str))
