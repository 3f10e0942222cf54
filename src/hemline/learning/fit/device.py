"""The device on which networks are trained."""

import torch

from hemline.errors import BadInput


def usable_device(name: str) -> torch.device:
    """Returns the device of a name.

    Args:
        name: A name of torch: `cpu`, `cuda`, `cuda:1`.

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
