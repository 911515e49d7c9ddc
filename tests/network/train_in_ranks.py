"""What torchrun starts in a test: a short training; each process writes what it saw.

``python -m tests.network.train_in_ranks FOLDER``
"""

import json
import os
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch
from torch import nn

from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.network.parallel import Ranks, SyncedBatchNorm, join_ranks
from pipeline.network.training import TrainedNetwork, train
from tests.network.planes import planes_with_holes

NETWORK = NetworkConfig(layers=18, channels=(16, 16, 32, 32))
CONFIG = TrainConfig(epochs=3, batch_size=32, threads=1, device="cpu")
SAMPLES, HELD_OUT = 101, 51  # odd: parts of batches are unequal


def trained_in(folder: Path, ranks: Ranks, loader_workers: int) -> TrainedNetwork:
    """Train on few samples, in as many processes as torchrun started."""
    return train(
        CONFIG,
        NETWORK,
        seed=1,
        train_set=planes_with_holes(SAMPLES, seed=0),
        val_set=planes_with_holes(HELD_OUT, seed=1),
        state_dir=folder,
        on_epoch=lambda metrics: None,
        ranks=ranks,
        loader_workers=loader_workers,
    )


def norm_difference(ranks: Ranks) -> float:
    """Largest difference of a synced norm on parts of a batch from a plain one on the whole."""
    generator = torch.Generator().manual_seed(0)
    whole = 5 + 3 * torch.randn(7, 4, 3, 3, generator=generator)
    weights = torch.randn(7, 4, 3, 3, generator=generator)
    mine = np.array_split(np.arange(7), ranks.count)[ranks.rank]
    found = []
    for norm, rows in ((nn.BatchNorm2d(4), np.arange(7)), (SyncedBatchNorm(4), mine)):
        inputs = whole[rows].clone().requires_grad_()
        outputs = norm(inputs)
        (outputs * weights[rows]).sum().backward()
        assert inputs.grad is not None
        in_mine = np.searchsorted(rows, mine)
        found.append((outputs[in_mine], inputs.grad[in_mine], norm.running_mean, norm.running_var))
    return max(float((ours - plain).abs().max()) for plain, ours in zip(*found, strict=True))


if __name__ == "__main__":
    with join_ranks() as together:
        trained = trained_in(Path(sys.argv[1]), together, loader_workers=1)
        seen = {
            "history": [asdict(metrics) for metrics in trained.history],
            "norm_difference": norm_difference(together),
        }
    path = Path(sys.argv[1]) / f"seen-{os.environ['RANK']}.json"
    path.write_text(json.dumps(seen))
