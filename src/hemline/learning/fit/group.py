"""The processes that train one network together, as `torchrun` starts them; alone, a group of one."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import torch
import torch.distributed as dist

from hemline.errors import BadCluster


@dataclass(frozen=True)
class Group:
    """This process among those that train together."""

    rank: int = 0
    """Its number; the first one writes and prints."""
    count: int = 1
    """Processes in all."""

    @classmethod
    def now(cls) -> "Group":
        """That of torch's process group, whoever made it; without one, this process alone."""
        if dist.is_available() and dist.is_initialized():
            return cls(dist.get_rank(), dist.get_world_size())
        return cls()

    @property
    def first(self) -> bool:
        """Whether this is the process that writes and prints."""
        return self.rank == 0

    def share(self, count: int) -> slice:
        """Which samples of a batch of so many are this process's: as even as they can be, in order."""
        return slice(self.rank * count // self.count, (self.rank + 1) * count // self.count)

    def summed(self, tensors: Sequence[torch.Tensor]) -> None:
        """Replace tensors by their sums over all processes, in one message; the same bits in each process."""
        if self.count == 1:
            return
        flat = torch.cat([each.reshape(-1) for each in tensors])
        dist.all_reduce(flat)
        for each, summed in zip(tensors, flat.split([each.numel() for each in tensors]), strict=True):
            each.copy_(summed.view_as(each))

    def from_first(self, content: bytes) -> bytes:
        """What the first process has; what the others have is not looked at."""
        if self.count == 1:
            return content
        length = torch.tensor([len(content)])
        dist.broadcast(length, 0)
        sent = torch.zeros(int(length), dtype=torch.uint8)
        if self.first:
            sent.copy_(torch.from_numpy(np.frombuffer(content, np.uint8).copy()))
        dist.broadcast(sent, 0)
        return sent.numpy().tobytes()


@contextmanager
def joined() -> Iterator[Group]:
    """The group that `torchrun` started this process in, by gloo, until the end of the block; else a group of one.

    Raises:
        BadCluster: The other processes do not answer.
    """
    if int(os.environ.get("WORLD_SIZE", "1")) == 1:
        yield Group.now()
        return
    # its functions keep, as a default argument, the group that there is when it is first imported, which Adam does; the
    # threads of a group that is kept outlive the interpreter and abort the process at its end
    import torch.distributed.nn  # noqa: F401

    try:
        dist.init_process_group("gloo")
    except (RuntimeError, ValueError) as reason:
        what, cure = "the other processes of the training do not answer", "start all of them with 'torchrun'"
        raise BadCluster(what, str(reason).splitlines()[0], cure) from reason
    try:
        yield Group.now()
        # who leaves while another still talks takes it down
        dist.barrier()
    finally:
        dist.destroy_process_group()
