"""Training one network in several processes: their numbers, and sums over them.

``torchrun --nproc-per-node=N -m -- stages.train --run NAME`` starts N equal processes. Each
computes the gradients of its part of a batch; ``DistributedDataParallel`` averages them, so all
take the same step. Batch normalisation takes its mean and variance over the whole batch too, so
that N processes compute what one computes, up to the order of summation.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor, distributed, nn


@dataclass(frozen=True)
class Ranks:
    """This process's place among those that train together.

    Attributes
    ----------
    rank
        Its number, 0 for the one that saves and reports.
    count
        Number of processes.
    local
        Its number on this machine, which is that of the GPU it uses.
    """

    rank: int = 0
    count: int = 1
    local: int = 0

    @property
    def first(self) -> bool:
        """Whether this is the process that saves and reports."""
        return self.rank == 0

    def summed(self, values: Tensor) -> Tensor:
        """The sum over all processes, the same bits in each."""
        if self.count > 1:
            distributed.all_reduce(values)
        return values


ALONE = Ranks()


@contextmanager
def join_ranks() -> Iterator[Ranks]:
    """Join the processes that torchrun started with this one; `ALONE` without torchrun."""
    count = int(os.environ.get("WORLD_SIZE", "1"))
    if count == 1:
        yield ALONE
        return
    local = int(os.environ["LOCAL_RANK"])
    if torch.cuda.is_available():
        torch.cuda.set_device(local)
    distributed.init_process_group("nccl" if torch.cuda.is_available() else "gloo")
    try:
        yield Ranks(distributed.get_rank(), count, local)
    finally:
        distributed.destroy_process_group()


class _SumOverRanks(torch.autograd.Function):
    """Sum over all processes; gradients are summed in the same way."""

    @staticmethod
    def forward(context: object, values: Tensor) -> Tensor:
        total = values.clone()
        distributed.all_reduce(total)
        return total

    @staticmethod
    def backward(context: object, *gradients: Tensor) -> Tensor:
        (total,) = (gradient.clone() for gradient in gradients)
        distributed.all_reduce(total)
        return total


class SyncedBatchNorm(nn.BatchNorm2d):
    """Batch normalisation over the batch of all processes.

    A class of our own, because ``torch.nn.SyncBatchNorm`` refuses tensors on a CPU.
    """

    def forward(self, input: Float[Tensor, "b c h w"]) -> Float[Tensor, "b c h w"]:  # noqa: A002
        """Normalise; in training by the moments of the whole batch."""
        if not self.training:
            return super().forward(input)
        variance, mean = torch.var_mean(input, dim=(0, 2, 3), unbiased=False)
        variance, mean = variance.double(), mean.double()
        cells = input.new_full((1,), input.numel() / input.shape[1], dtype=torch.float64)
        # Count, first and second moment: what adds up over processes.
        moments = torch.cat((cells, cells * mean, cells * (variance + mean * mean)))
        sums: Tensor = _SumOverRanks.apply(moments)  # type: ignore[no-untyped-call]
        total = sums[0].detach()
        mean, square = (sums[1:] / total).chunk(2)
        variance = square - mean * mean
        with torch.no_grad():
            momentum = 0.1 if self.momentum is None else self.momentum
            unbiased = variance * (total / (total - 1))
            self.running_mean.lerp_(mean.to(self.running_mean), momentum)  # type: ignore[union-attr]
            self.running_var.lerp_(unbiased.to(self.running_var), momentum)  # type: ignore[union-attr]
            self.num_batches_tracked.add_(1)  # type: ignore[union-attr]
        scale = self.weight * torch.rsqrt(variance + self.eps).to(self.weight)
        shift = self.bias - mean.to(self.weight) * scale
        normalised: Tensor = input * scale[:, None, None] + shift[:, None, None]
        return normalised


def sync_batch_norms(module: nn.Module) -> None:
    """Replace every batch normalisation of a network by `SyncedBatchNorm`, weights kept."""
    for name, child in module.named_children():
        if isinstance(child, nn.BatchNorm2d):
            synced = SyncedBatchNorm(child.num_features, child.eps, child.momentum)
            synced.weight, synced.bias = child.weight, child.bias
            synced.load_state_dict(child.state_dict())
            setattr(module, name, synced)
        else:
            sync_batch_norms(child)
