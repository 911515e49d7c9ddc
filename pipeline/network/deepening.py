"""A trained network made deeper, which predicts the same until it is trained on.

The new blocks stand at the end of each stage. A block's branch begins at nothing (``ga_cnn``), and
what comes in has passed a ReLU, so a new block hands on what it gets, to the bit. Networks are made
deeper so in Net2Net (Chen, Goodfellow and Shlens, 2016).
"""

from pipeline.config.learning import NetworkConfig
from pipeline.network.ga_cnn import GaCnn, build_network


def can_be_deepened(own: NetworkConfig, wanted: NetworkConfig) -> bool:
    """Whether ``wanted`` is ``own`` with more layers: then no stage of it has fewer blocks."""
    return own.model_copy(update={"layers": wanted.layers}) == wanted and own.layers < wanted.layers


def deepened(network: GaCnn, wanted: NetworkConfig, seed: int) -> GaCnn:
    """The network with more blocks, which predicts what ``network`` does.

    Parameters
    ----------
    network
        A trained network; it is left as it is.
    wanted
        The same with more layers, as `can_be_deepened` tells.
    seed
        Seed of the new blocks' weights.

    Returns
    -------
    The deeper network, on the CPU and ready to predict.
    """
    deeper = build_network(wanted, seed, network.channels)
    deeper.load_state_dict(deeper.state_dict() | network.state_dict())
    return deeper.eval()
