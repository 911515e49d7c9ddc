"""What a network needs of the machine that trains it is told where it is missing."""

import pytest
import torch

from pipeline.config.learning import NetworkConfig
from pipeline.errors import ConfigError, MachineError
from pipeline.network.devices import compile_network
from pipeline.network.ga_cnn import build_network
from pipeline.network.parallel import ALONE, Ranks

NETWORK = NetworkConfig(layers=18, channels=(16, 16, 32, 32))


def test_what_a_compiled_network_needs_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    network, cpu = build_network(NETWORK, 0), torch.device("cpu")
    with pytest.raises(ConfigError, match=r"train.compiled is for one process, and 2"):
        compile_network(network, cpu, Ranks(0, 2, 0))
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(MachineError, match="there is no no-such-compiler"):
        compile_network(network, cpu, ALONE)
