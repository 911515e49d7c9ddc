"""What a network needs of the machine that trains it is told where it is missing."""

from pathlib import Path

import pytest
import torch

from pipeline.config.learning import NetworkConfig, Precision, TrainConfig
from pipeline.errors import ConfigError, MachineError
from pipeline.network.devices import compile_network, mixed_precision
from pipeline.network.ga_cnn import build_network
from pipeline.network.parallel import ALONE, Ranks
from pipeline.network.training import train
from tests.network.planes import planes_with_holes

NETWORK = NetworkConfig(layers=18, channels=(16, 16, 32, 32))


def test_what_a_compiled_network_needs_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    network, cpu = build_network(NETWORK, 0), torch.device("cpu")
    with pytest.raises(ConfigError, match=r"train.compiled is for one process, and 2"):
        compile_network(network, cpu, Ranks(0, 2, 0))
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(MachineError, match="there is no no-such-compiler"):
        compile_network(network, cpu, ALONE)


@pytest.mark.parametrize(
    ("wanted", "expected"),
    [("auto", torch.float32), ("single", torch.float32), ("mixed", torch.bfloat16)],
)
def test_products_are_taken_in_the_precision_that_is_wanted(
    wanted: Precision, expected: torch.dtype
) -> None:
    ones = torch.ones(4, 4)
    with mixed_precision(torch.device("cpu"), wanted):
        assert (ones @ ones).dtype == expected


def test_mixed_precision_trains_like_single_precision(tmp_path: Path) -> None:
    few = planes_with_holes(96, seed=0)
    seen = []
    for precision in ("single", "mixed"):
        config = TrainConfig(epochs=2, batch_size=32, threads=1, device="cpu", precision=precision)
        seen.append(train(config, NETWORK, 0, few, few, tmp_path / precision, lambda _: None))
    single, mixed = seen
    assert mixed.history[-1].train_mae == pytest.approx(single.history[-1].train_mae, rel=0.05)
    assert mixed.history[-1].train_mae != single.history[-1].train_mae
    assert {tensor.dtype for tensor in mixed.network.parameters()} == {torch.float32}
