"""Training frames as tensors on the device of the training."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any

import torch
from torch import Tensor

from hemline.animators.coarse.features.columns import VECTOR
from hemline.animators.swingar.graph_inputs import VERTEX
from hemline.learning.mirror import opposite_joints
from hemline.motions.motion import JOINT_COUNT

from .frame_batch import FrameBatch

AXIS_ANGLE_SIGNS = (1.0, -1.0, -1.0)
"""Signs of a mirrored axis-angle."""
TURN_SIGNS = (1.0, 1.0, -1.0, -1.0)
"""Signs of a mirrored quaternion, wxyz."""


@dataclass(frozen=True, eq=False)
class FrameTensors:
    """The fields of `FrameBatch` as tensors on one device."""

    motion: Tensor
    """The last 65 poses (frames, poses, 75)."""
    transforms: Tensor
    """Skinning transforms of the joints (frames, joints, 3, 4) [m]."""
    joints: Tensor
    """Positions of the joints (frames, joints, 3) [m]."""
    body: Tensor
    """Betas and axis-angles of the present pose (frames, body)."""
    heading: Tensor
    """Rotations from the frame's own heading to one that all frames of a clip share (frames, 3, 3)."""
    truth: Tensor
    """Vertices of the ground truth (frames, verts, 3) [m]."""
    features: Tensor | None
    """Features of the vertices (frames, verts, features)."""
    turns: Tensor | None
    """Rotation of each vertex by skinning, wxyz (frames, verts, 4)."""

    @classmethod
    def of(cls, batch: FrameBatch, device: torch.device, *, halves: Iterable[str] = ()) -> "FrameTensors":
        """Copies frames to a device.

        Args:
            batch: The frames.
            device: The device.
            halves: Names of the fields that become float16.
        """
        arrays = {each.name: getattr(batch, each.name) for each in fields(cls)}
        found: dict[str, Any] = {
            name: None if each is None else torch.from_numpy(each) for name, each in arrays.items()
        }
        halved = {name: each.half() for name, each in found.items() if each is not None and name in set(halves)}
        return cls(**(found | halved)).to(device)

    def to(self, device: torch.device) -> "FrameTensors":
        """Copies the tensors to a device."""
        return self._changed(lambda each: each.to(device))

    @property
    def byte_count(self) -> int:
        """Memory that the tensors occupy [bytes]."""
        return sum(each.nbytes for each in vars(self).values() if each is not None)

    def select(self, rows: Tensor) -> "FrameTensors":
        """Returns some of the frames, float32."""
        return self._changed(lambda each: each[rows].float())

    def _changed(self, change: Callable[[Tensor], Tensor]) -> "FrameTensors":
        """Returns the frames with a function applied to each tensor."""
        changed: dict[str, Any] = {name: None if each is None else change(each) for name, each in vars(self).items()}
        return FrameTensors(**changed)

    def mirror(self) -> "FrameTensors":
        """Returns the mirror image of the frames. Betas do not change, since bodies are symmetric."""
        device, others = self.truth.device, opposite_joints()
        vector, axes, turn = (
            _constant(each, device) for each in (tuple(VECTOR.tolist()), AXIS_ANGLE_SIGNS, TURN_SIGNS)
        )

        def mirror_axes(values: Tensor) -> Tensor:
            return (values.unflatten(-1, (JOINT_COUNT, 3))[..., others, :] * axes).flatten(-2)

        split = 3 * JOINT_COUNT
        motion = torch.cat([mirror_axes(self.motion[..., :split]), self.motion[..., split:] * vector], dim=-1)
        body = torch.cat([self.body[:, :-split], mirror_axes(self.body[:, -split:])], dim=-1)
        order, signs = _mirrored_columns(device)
        features = None if self.features is None else self.features[..., order] * signs
        return FrameTensors(
            motion,
            self.transforms[:, others] * vector[:, None] * torch.cat([vector, vector.new_ones(1)]),
            self.joints[:, others] * vector,
            body,
            self.heading * vector * vector[:, None],
            self.truth * vector,
            features,
            None if self.turns is None else self.turns * turn,
        )

    def forget_beginning(self) -> "FrameTensors":
        """Returns the frames with the features cleared that say how the garment lay at the beginning."""
        if self.features is None:
            return self
        kept = torch.ones(VERTEX.count, device=self.truth.device)
        kept[VERTEX["beginning"]] = 0
        return replace(self, features=self.features * kept)


@cache
def _constant(values: tuple[float, ...], device: torch.device) -> Tensor:
    return torch.tensor(values, device=device)


@cache
def _mirrored_columns(device: torch.device) -> tuple[Tensor, Tensor]:
    """Returns order and signs of mirrored features, see `FeatureTable.mirror`."""
    order, signs = VERTEX.mirror()
    return torch.from_numpy(order).to(device), torch.from_numpy(signs).to(device)
