"""A short training with a plain and with a compiled network; prints what each saw.

A process of its own, without the checks of array shapes that the tests put around every function:
PyTorch's compiler cannot see through them. ``python -m tests.network.train_compiled FOLDER``
"""

import json
import sys
from dataclasses import asdict
from pathlib import Path

from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.network.training import train
from tests.network.planes import planes_with_holes

NETWORK = NetworkConfig(layers=18, channels=(8, 8, 8, 8))


def seen(folder: Path, compiled: bool) -> dict[str, object]:
    """Figures of the last epoch, and the names of the weights."""
    config = TrainConfig(epochs=2, batch_size=32, threads=1, device="cpu", compiled=compiled)
    few = planes_with_holes(96, seed=0)
    trained = train(config, NETWORK, 0, few, few, folder / str(compiled), lambda metrics: None)
    return asdict(trained.history[-1]) | {"weights": sorted(trained.network.state_dict())}


if __name__ == "__main__":
    sys.stdout.write(json.dumps([seen(Path(sys.argv[1]), compiled) for compiled in (False, True)]))
