"""The device on which networks are trained."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from hemline.errors import BadInput


def usable_device(name: str) -> torch.device:
    """Returns the torch device with the given name, after a check that it can be used.

    Args:
        name: Name of the device in torch, such as `cpu`, `cuda` or `cuda:1`.

    Raises:
        BadInput: torch does not know the device, or finds none on this machine.
    """
    what, cure = f"option 'device' must name a device of torch that is here, not '{name}'", "leave it out, or name cpu"
    try:
        device = torch.device(name)
    except RuntimeError as reason:
        raise BadInput(what, str(reason).partition(":")[0], cure) from reason
    count = {"cpu": 1, "cuda": torch.cuda.device_count()}.get(device.type, 0)
    if (device.index or 0) >= count:
        raise BadInput(what, f"{count} of its kind", cure)
    return device


ROOM = 0.7
"""Fraction of the free memory of a device that training frames may occupy."""


def frame_room(device: torch.device) -> int:
    """Returns the memory of a device that training frames may occupy [bytes]; 0 for the processor."""
    return int(ROOM * torch.cuda.mem_get_info(device)[0]) if device.type == "cuda" else 0


@contextmanager
def full_precision() -> Iterator[None]:
    """Context manager in which matrix products on a GPU have all bits of float32, whatever they have elsewhere.

    TF32 rounds to 10 bits: a position of a metre to half a millimetre.
    """
    before = torch.get_float32_matmul_precision()
    torch.set_float32_matmul_precision("highest")
    try:
        yield
    finally:
        torch.set_float32_matmul_precision(before)
