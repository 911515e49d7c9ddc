"""What torchrun starts in a test: a short training; each process writes the history it saw.

``python -m tests.network.train_in_ranks FOLDER``
"""

import json
import os
import sys
from dataclasses import asdict
from pathlib import Path

from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.network.parallel import joined_ranks
from pipeline.network.training import TrainedNetwork, train
from tests.network.planes import planes_with_holes

NETWORK = NetworkConfig(layers=18, channels=(16, 16, 32, 32))
CONFIG = TrainConfig(epochs=3, batch_size=32, threads=1, device="cpu")
SAMPLES, HELD_OUT = 101, 51  # odd: parts of batches are unequal


def trained_in(folder: Path, loader_workers: int) -> TrainedNetwork:
    """Train on few samples, in as many processes as torchrun started."""
    with joined_ranks() as ranks:
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


if __name__ == "__main__":
    trained = trained_in(Path(sys.argv[1]), loader_workers=1)
    path = Path(sys.argv[1]) / f"history-{os.environ['RANK']}.json"
    path.write_text(json.dumps([asdict(metrics) for metrics in trained.history]))
