"""Processes that train one network together, one per core or GPU: started by torchrun, each is a rank.

Each rank makes its part of every batch. Losses, gradients and the statistics of batch normalisation are those of the
whole batch. A process that torchrun did not start is the only one.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import torch
from torch import distributed as dist
from torch import nn


def env_int(name: str, alone: int = 0) -> int:
    """Read a number that torchrun puts into each process's environment, such as RANK; `alone` without torchrun."""
    return int(os.environ[name]) if dist.is_torchelastic_launched() else alone


def is_main() -> bool:
    """Whether this process writes files and prints: one does."""
    return env_int("RANK") == 0


@contextmanager
def process_group(device: torch.device) -> Iterator[None]:
    """Meet the other ranks, and part from them at the end: over gloo, on GPUs also over NCCL."""
    if not dist.is_torchelastic_launched():
        yield
        return
    dist.init_process_group("gloo" if device.type == "cpu" else "cpu:gloo,cuda:nccl")
    try:
        yield
    finally:
        dist.destroy_process_group()


def rank_and_count() -> tuple[int, int]:
    """This process's rank, and how many there are."""
    return (dist.get_rank(), dist.get_world_size()) if dist.is_initialized() else (0, 1)


def sum_over_ranks(x: torch.Tensor) -> torch.Tensor:
    """Sum a tensor over all ranks, for each of them, without gradient. Ranks wait for each other here."""
    x = x.detach().clone()
    if dist.is_initialized():
        dist.all_reduce(x)
    return x


def share_of_batch(count: int) -> range:
    """Which of `count` images of a batch this rank makes; none, if there are fewer than ranks.

    >>> share_of_batch(8)
    range(0, 8)
    """
    rank, ranks = rank_and_count()
    return range(count * rank // ranks, count * (rank + 1) // ranks)


def wrap_ddp(model: nn.Module) -> nn.Module:
    """What to call in place of the model, so that its gradients are the means over ranks; its parts stay its own."""
    if rank_and_count()[1] == 1:
        return model
    for layer in model.modules():
        if type(layer) is nn.BatchNorm2d and layer.affine and layer.track_running_stats:
            layer.__class__ = BatchNormOfAllRanks  # it keeps its weights, and its place in the model
    return nn.parallel.DistributedDataParallel(model, forward_sync_buffers=False)


class BatchNormOfAllRanks(nn.BatchNorm2d):
    """Normalise by mean and variance over the whole batch, of which a rank has a part, or none.

    nn.SyncBatchNorm does so on GPUs alone.
    """

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Map (N, C, H, W) to the same shape, as nn.BatchNorm2d does."""
        if not (self.training and dist.is_initialized()):
            return super().forward(x)
        from torch.distributed.nn.functional import all_reduce  # the one that has a gradient

        shift = self.running_mean.clone()  # near the mean, so that squares lose no digits
        d = x.float() - shift[:, None, None]
        own = torch.cat([d.sum((0, 2, 3)), d.square().sum((0, 2, 3)), d.new_tensor([d[:, 0].numel()])])
        *sums, n = all_reduce(own.double()).split([self.num_features, self.num_features, 1])
        mean, var = sums[0] / n, sums[1] / n - (sums[0] / n) ** 2
        with torch.no_grad():
            self.running_mean.lerp_((shift + mean).float(), self.momentum)
            self.running_var.lerp_((var * n / (n - 1)).float(), self.momentum)
            self.num_batches_tracked += 1
        scale = self.weight * (var + self.eps).rsqrt().float()
        d = (d - mean.float()[:, None, None]) * scale[:, None, None] + self.bias[:, None, None]
        return d.to(x.dtype, memory_format=torch.channels_last)
