"""The processes that train one network together, as `torchrun` starts them; a single process is a group of one."""

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
    """This process among the processes that train together."""

    rank: int = 0
    """Number of this process; process 0 writes and prints."""
    count: int = 1
    """Number of processes."""

    @classmethod
    def current(cls) -> "Group":
        """Returns torch's process group if there is one, else a group of this process alone."""
        if dist.is_available() and dist.is_initialized():
            return cls(dist.get_rank(), dist.get_world_size())
        return cls()

    @property
    def first(self) -> bool:
        """Whether this is the process that writes and prints."""
        return self.rank == 0

    def own_slice(self, count: int) -> slice:
        """Returns the part of `count` samples that belongs to this process; parts are as even as possible."""
        return slice(self.rank * count // self.count, (self.rank + 1) * count // self.count)

    def sum_in_place(self, tensors: Sequence[torch.Tensor]) -> None:
        """Replaces tensors by their sums over all processes, in one message; all processes get the same bits."""
        if self.count == 1:
            return
        flat = torch.cat([each.reshape(-1) for each in tensors])
        dist.all_reduce(flat)
        for each, total in zip(tensors, flat.split([each.numel() for each in tensors]), strict=True):
            each.copy_(total.view_as(each))

    def broadcast_from_first(self, content: bytes) -> bytes:
        """Returns the content of the first process in every process."""
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
def join_group() -> Iterator[Group]:
    """Joins the group in which `torchrun` started this process, by gloo, for the block; else a group of one.

    Yields:
        The group.

    Raises:
        BadCluster: The other processes do not answer.
    """
    if int(os.environ.get("WORLD_SIZE", "1")) == 1:
        yield Group.current()
        return
    # functions of this module keep the group that exists at its first import as a default argument, and Adam imports
    # it; the threads of a group that is kept outlive the interpreter and abort the process at its end
    import torch.distributed.nn  # noqa: F401

    try:
        dist.init_process_group("gloo")
    except (RuntimeError, ValueError) as reason:
        what, cure = "the other processes of the training do not answer", "start all of them with 'torchrun'"
        raise BadCluster(what, str(reason).splitlines()[0], cure) from reason
    try:
        yield Group.current()
        # a process that leaves while another still communicates would abort it
        dist.barrier()
    finally:
        dist.destroy_process_group()
