"""Training that begins from a trained network: what it gains on new samples, and what it forgets.

Forgetting is told on grasps of the released network that lie beside it: on some that it was trained
on, which is what it can forget, and on some of its test.
"""

import numpy as np
import torch
from jaxtyping import Bool, Float

from pipeline.config.learning import NetworkConfig, TrainConfig
from pipeline.errors import ArtifactError, ConfigError, ContentError
from pipeline.network.checkpoint import (
    network_of_this_program,
    tensors_from_bytes,
    tensors_to_bytes,
)
from pipeline.network.deepening import can_be_deepened, deepened
from pipeline.network.figures import mean_absolute_error
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.inference import predict
from pipeline.network.released_files import (
    RELEASED_FOLDER,
    TEST_GRASPS_FILE,
    TRAIN_GRASPS_FILE,
)
from pipeline.network.samples import GraspTensors
from pipeline.network.training_figures import FineTuning

_FORMAT = "softgrip.grasps"


def starting_network(
    data: bytes, named: str, wanted: NetworkConfig, seed: int | None = None
) -> GaCnn:
    """The network that a training begins with; made deeper where the run wants more layers.

    Parameters
    ----------
    data
        Its checkpoint.
    named
        What messages call it.
    wanted
        The run's [network].
    seed
        Seed of the weights of blocks that it does not have; None: it must have all.

    Returns
    -------
    The network, on the CPU.

    Raises
    ------
    ArtifactError
        The bytes are no network, or its input is an older program's.
    ConfigError
        It is no network as the run wants one, nor one to be made deeper.
    """
    remedy = "Begin with a network of this program, or without train.start"
    network = network_of_this_program(data, named, remedy)
    own = network.config
    if seed is not None and can_be_deepened(own, wanted):
        return deepened(network, wanted, seed)
    if own != wanted:
        layers = f"{own.layers}" if seed is None else f"{own.layers} or more"
        raise ConfigError(
            f"{named} has {own.layers} layers of channels {list(own.channels)}, and the run wants "
            f"{wanted.layers} of {list(wanted.channels)} of it",
            f"Set network.layers = {layers}, network.channels = {list(own.channels)} and "
            f"network.attention = '{own.attention}'",
        )
    return network


def measure_fine_tuning(
    start: GaCnn,
    trained: GaCnn,
    config: TrainConfig,
    own: GraspTensors,
    released: GraspTensors | None = None,
    learnt: GraspTensors | None = None,
) -> FineTuning:
    """Errors of both networks on new test grasps and on those of the released network.

    Parameters
    ----------
    start
        The network that training began with.
    trained
        The network that came of it.
    config
        Batch size and threads to predict with.
    own
        The run's test split.
    released
        Test grasps of the released network; None: those that lie beside it.
    learnt
        Grasps that the released network was trained on; None: those that lie beside it.

    Returns
    -------
    The figures.

    Raises
    ------
    ArtifactError
        A file beside the released network is damaged.
    """
    released = _beside_the_released(TEST_GRASPS_FILE) if released is None else released
    learnt = _beside_the_released(TRAIN_GRASPS_FILE) if learnt is None else learnt

    def error(network: GaCnn, grasps: GraspTensors) -> float:
        predicted = predict(
            *(network, grasps.cloud, grasps.mask),
            *(config.batch_size, config.threads),
            average_symmetries=False,
        )
        return mean_absolute_error(predicted, np.asarray(grasps.quality))

    return FineTuning(
        own_before=error(start, own),
        own_after=error(trained, own),
        released_before=error(start, released),
        released_after=error(trained, released),
        released_grasps=len(released),
        learnt_before=error(start, learnt),
        learnt_after=error(trained, learnt),
        learnt_grasps=len(learnt),
    )


def _beside_the_released(name: str) -> GraspTensors:
    path = RELEASED_FOLDER / name
    return grasps_from_bytes(path.read_bytes(), str(path))


def grasps_to_bytes(
    cloud: Float[np.ndarray, "n h w 3"],
    mask: Bool[np.ndarray, "n h w"],
    quality: Float[np.ndarray, " n"],
) -> bytes:
    """Labelled grasps as safetensors, clouds in half precision; equal ones give equal bytes."""
    tensors = {
        "cloud": torch.from_numpy(np.where(mask[..., None], cloud, 0).astype(np.float16)),
        "mask": torch.from_numpy(np.array(mask)),
        "quality": torch.from_numpy(np.array(quality, dtype=np.float32)),
    }
    return tensors_to_bytes(tensors, {"format": _FORMAT})


def grasps_from_bytes(data: bytes, named: str) -> GraspTensors:
    """Read back `grasps_to_bytes`.

    Parameters
    ----------
    data
        The file's bytes.
    named
        What messages call the file.

    Returns
    -------
    The grasps.

    Raises
    ------
    ArtifactError
        The file is damaged, or is none of labelled grasps.
    """
    try:
        tensors, metadata = tensors_from_bytes(data, named)
    except ContentError as error:
        raise ArtifactError(error.what, error.remedy) from error
    if metadata.get("format") != _FORMAT or tensors.keys() != {"cloud", "mask", "quality"}:
        raise ArtifactError(f"{named} holds no labelled grasps", "Make it again: make release")
    return GraspTensors(*(tensors[name].numpy() for name in ("cloud", "mask", "quality")))
