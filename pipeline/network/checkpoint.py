"""A trained network as bytes: safetensors with its configuration; loading runs no code."""

import hashlib
import json
from collections.abc import Mapping

import torch
from pydantic import ValidationError
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from pipeline.config.learning import NetworkConfig
from pipeline.errors import ArtifactError, ConfigError, ContentError
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.input_channels import CHANNELS, KNOWN_CHANNELS, Channels

FORMAT = "softgrip.ga-cnn"
# Rises whenever an older reader would misread the weights or the input's channels.
FORMAT_VERSION = 1

_HEADER_LENGTH_BYTES = 8  # safetensors: a little-endian u64 comes first
_DIGEST_KEY = "sha256"
_REMEDY = "Train the network again, or pass a checkpoint that this version wrote."


def save_checkpoint_bytes(network: GaCnn) -> bytes:
    """Weights and configuration; equal networks give equal bytes."""
    metadata = {
        "format": FORMAT,
        "version": str(FORMAT_VERSION),
        "channels": json.dumps(network.channels),
        "network": network.config.model_dump_json(),
    }
    return tensors_to_bytes(network.state_dict(), metadata)


def checkpoint_digest(network: GaCnn) -> str:
    """SHA-256 of a network's checkpoint, as hexadecimal digits."""
    return hashlib.sha256(save_checkpoint_bytes(network)).hexdigest()


def load_checkpoint_bytes(data: bytes) -> GaCnn:
    """Read the network of a checkpoint.

    Parameters
    ----------
    data
        Bytes that `save_checkpoint_bytes` made.

    Returns
    -------
    The network, on the CPU and ready to predict.

    Raises
    ------
    ContentError
        The bytes are no checkpoint, are damaged, or are of another version.
    """
    tensors, metadata = tensors_from_bytes(data, "network checkpoint")
    if metadata.get("format") != FORMAT:
        raise ContentError(
            f"network checkpoint is of format {metadata.get('format')!r}, not {FORMAT!r}", _REMEDY
        )
    if metadata.get("version") != str(FORMAT_VERSION):
        raise ContentError(
            f"network checkpoint is of version {metadata.get('version')}, "
            f"this program reads version {FORMAT_VERSION}",
            _REMEDY,
        )
    known = {json.dumps(channels): channels for channels in KNOWN_CHANNELS}
    channels = known.get(metadata.get("channels", ""))
    if channels is None:
        raise ContentError(
            f"network checkpoint expects the input channels {metadata.get('channels')}, "
            f"this program makes {json.dumps(CHANNELS)}",
            _REMEDY,
        )
    try:
        config = NetworkConfig.model_validate_json(metadata.get("network", ""))
        _check_shapes(config, channels, tensors)
        network = build_network(config, seed=0, channels=channels)
        network.load_state_dict(tensors)
    except (ValidationError, ConfigError, RuntimeError) as error:
        reason = str(error).splitlines()[0]
        raise ContentError(
            f"network checkpoint does not fit its own configuration: {reason}", _REMEDY
        ) from error
    if not all(bool(torch.isfinite(tensor).all()) for tensor in tensors.values()):
        raise ContentError("network checkpoint holds weights that are not finite", _REMEDY)
    return network.eval()


def network_of_this_program(data: bytes, named: str, remedy: str) -> GaCnn:
    """Read the network of a checkpoint that takes the input which training makes today.

    Parameters
    ----------
    data
        Bytes that `save_checkpoint_bytes` made.
    named
        What messages call it.
    remedy
        What to do where its input is an older program's.

    Returns
    -------
    The network, as `load_checkpoint_bytes` returns it.

    Raises
    ------
    ArtifactError
        The bytes are no network, or its input is an older program's.
    """
    try:
        network = load_checkpoint_bytes(data)
    except ContentError as error:
        raise ArtifactError(f"{named}: {error.what}", error.remedy) from error
    if network.channels != CHANNELS:
        raise ArtifactError(
            f"{named} takes the input channels {', '.join(network.channels)} of an older program",
            remedy,
        )
    return network


def _check_shapes(config: NetworkConfig, channels: Channels, tensors: Mapping[str, Tensor]) -> None:
    """Hold the weights against the configuration before a network of its size is allocated."""
    with torch.device("meta"):
        network = GaCnn(config, channels)
        expected = {name: tensor.shape for name, tensor in network.state_dict().items()}
    if {name: tensor.shape for name, tensor in tensors.items()} != expected:
        raise ContentError("network checkpoint does not fit its own configuration", _REMEDY)


def tensors_to_bytes(tensors: Mapping[str, Tensor], metadata: Mapping[str, str]) -> bytes:
    """Safetensors bytes with a digest of the payload; equal content gives equal bytes.

    The library writes metadata in the order of a hash map, which differs from run to run: the
    header is therefore written again with its keys in order.
    """
    plain = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    data = save(plain, dict(metadata))
    length = int.from_bytes(data[:_HEADER_LENGTH_BYTES], "little")
    end = _HEADER_LENGTH_BYTES + length
    entries = json.loads(data[_HEADER_LENGTH_BYTES:end])
    entries["__metadata__"] = dict(metadata)
    entries["__metadata__"] = {**metadata, _DIGEST_KEY: _digest(entries, data[end:])}
    header = json.dumps(entries, sort_keys=True, separators=(",", ":")).encode()
    header += b" " * (-len(header) % _HEADER_LENGTH_BYTES)
    return len(header).to_bytes(_HEADER_LENGTH_BYTES, "little") + header + data[end:]


def tensors_from_bytes(data: bytes, what: str) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Read tensors and metadata from safetensors bytes.

    Parameters
    ----------
    data
        Bytes that `tensors_to_bytes` made.
    what
        What error messages call the bytes.

    Returns
    -------
    Name → tensor, and the metadata without the digest.

    Raises
    ------
    ContentError
        The bytes are no safetensors, or do not match their digest.
    """
    try:
        tensors = load(data)
        length = int.from_bytes(data[:_HEADER_LENGTH_BYTES], "little")
        end = _HEADER_LENGTH_BYTES + length
        entries = json.loads(data[_HEADER_LENGTH_BYTES:end])
    except (SafetensorError, ValueError, KeyError, RuntimeError) as error:
        # Torch refuses by RuntimeError: sides whose product no integer holds.
        reason = str(error).splitlines()[0]
        raise ContentError(
            f"{what} is damaged or no safetensors data: {reason}", _REMEDY
        ) from error
    metadata = entries.get("__metadata__", {})
    if metadata.pop(_DIGEST_KEY, None) != _digest(entries, data[end:]):
        raise ContentError(f"{what} is damaged: its SHA-256 does not match its content", _REMEDY)
    return tensors, metadata


def _digest(entries: Mapping[str, object], payload: bytes) -> str:
    """SHA-256 over everything but itself: the header's entries in order, then the payload."""
    digest = hashlib.sha256(json.dumps(entries, sort_keys=True).encode())
    digest.update(payload)
    return digest.hexdigest()
