"""GA-CNN, the gripping attention network, and its family; Supplement IV.

Supplement IV fixes the outline: «a 2-layer CNN with a 3×3 kernel, and 4 CBAMs with 64, 128, 256
and 512 channels respectively, containing 3.23 M parameters», 52 layers, and a family of 18 to 102
layers made by changing the depth of the CBAM stages. It leaves the block open. Here:

========  =====================================================  =============  ==============
part      content                                                map (cells)    weighted layers
========  =====================================================  =============  ==============
stem      conv 3×3, then conv 3×3 of stride 2                    24×24 → 12×12  2
stage 1   n₁ blocks of c₁ channels                               12×12          2 n₁
stage 2   n₂ blocks of c₂ channels, the first of stride 2        6×6            2 n₂
stage 3   n₃ blocks of c₃ channels, the first of stride 2        3×3            2 n₃
stage 4   n₄ blocks of c₄ channels                               3×3            2 n₄
head      mean over the map, two fully connected layers          1              2
========  =====================================================  =============  ==============

**Block** (two weighted layers): a grouped 3×3 convolution mixes neighbours, a 1×1 convolution mixes
channels, attention weighs the result, and a shortcut adds the block's input::

    x ─ conv 3×3 grouped ─ norm ─ ReLU ─ conv 1×1 ─ norm ─ channel att. ─ spatial att. ─ + ─ ReLU
    └───────────────────────────────── shortcut ─────────────────────────────────────────┘

**Attention** sits at the end of the residual branch of *every* block, channel before spatial, as a
convolutional block attention module (CBAM) does.

**Counting layers**: convolutions and fully connected layers that data passes one after another from
input to output: stem 2 + 2 a block + head 2. Not counted, as is usual for residual networks: the
projections in shortcuts and the small layers inside the attention modules. So ``layers`` =
4 + 2 (n₁ + n₂ + n₃ + n₄), every even number from 18 to 102; 52 layers are 6 + 6 + 6 + 6 blocks.
"""

from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor, nn

from pipeline.config.learning import (
    CHANNELS_PER_GROUP,
    DEEPEST,
    LAYERS_PER_BLOCK,
    SHALLOWEST,
    NetworkConfig,
    is_family_depth,
)
from pipeline.errors import ConfigError
from pipeline.network.input_channels import CHANNELS, Channels

STEM_LAYERS = 2  # Supplement IV: a 2-layer CNN of 3x3 comes first
HEAD_LAYERS = 2  # fully connected layers after the last stage

# Blocks beyond an even share go to the stages of middle resolution first: the first stage is the
# costliest a block, the last the one with most parameters a block.
_REMAINDER_ORDER = (2, 1, 3)
_STAGE_STRIDES = (1, 2, 2, 1)

_ATTENTION_REDUCTION = 16  # CBAM and its forerunner SE both take 16
_HEAD_REDUCTION = 4  # of our own choice, as Supplement IV leaves the head open
# Maps are 12, 6 and 3 cells wide: the customary 7×7 would span most of them.
_SPATIAL_ATTENTION_KERNEL = 3


def blocks_per_stage(layers: int) -> tuple[int, int, int, int]:
    """Blocks of the four stages for a depth of ``layers`` weighted layers.

    Parameters
    ----------
    layers
        Weighted layers: an even number from 18 to 102.

    Returns
    -------
    n₁ to n₄.

    Raises
    ------
    ConfigError
        No member of the family has this depth; the message names those that exist.
    """
    if not is_family_depth(layers):
        raise ConfigError(
            f"network.layers = {layers} is not a depth of the GA-CNN family",
            f"Choose an even number from {SHALLOWEST} to {DEEPEST} "
            f"({SHALLOWEST}, {SHALLOWEST + 2}, ..., {DEEPEST - 2}, {DEEPEST}).",
        )
    blocks = (layers - STEM_LAYERS - HEAD_LAYERS) // LAYERS_PER_BLOCK
    share, remainder = divmod(blocks, 4)
    extra = [stage in _REMAINDER_ORDER[:remainder] for stage in range(4)]
    return (share + extra[0], share + extra[1], share + extra[2], share + extra[3])


class ChannelAttention(nn.Module):
    """Scale channels by weights computed from their mean and maximum over the map."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        hidden = max(channels // _ATTENTION_REDUCTION, 4)
        self.squeeze = nn.Linear(channels, hidden)
        self.excite = nn.Linear(hidden, channels)

    def forward(self, x: Float[Tensor, "b c h w"]) -> Float[Tensor, "b c h w"]:
        """Scale every channel by its weight in (0, 1)."""
        # The last layer is linear, so both descriptors may be summed before it.
        described = torch.relu(self.squeeze(x.mean(dim=(2, 3))))
        described = described + torch.relu(self.squeeze(x.amax(dim=(2, 3))))
        weights = torch.sigmoid(self.excite(described))
        return x * weights[:, :, None, None]


class SpatialAttention(nn.Module):
    """Scale cells by weights computed from the mean and maximum over their channels."""

    def __init__(self) -> None:
        super().__init__()
        kernel = _SPATIAL_ATTENTION_KERNEL
        self.convolution = nn.Conv2d(2, 1, kernel, padding=kernel // 2)

    def forward(self, x: Float[Tensor, "b c h w"]) -> Float[Tensor, "b c h w"]:
        """Scale every cell by its weight in (0, 1)."""
        described = torch.cat((x.mean(dim=1, keepdim=True), x.amax(dim=1, keepdim=True)), dim=1)
        return x * torch.sigmoid(self.convolution(described))


class AttentionBlock(nn.Module):
    """One residual block: two weighted layers and, for ``"cbam"``, both attentions."""

    def __init__(
        self, inputs: int, outputs: int, stride: int, attention: Literal["cbam", "none"]
    ) -> None:
        super().__init__()
        groups = max(inputs // CHANNELS_PER_GROUP, 1)
        self.neighbours = nn.Conv2d(
            inputs, inputs, 3, stride=stride, padding=1, groups=groups, bias=False
        )
        self.neighbours_norm = nn.BatchNorm2d(inputs)
        self.channels = nn.Conv2d(inputs, outputs, 1, bias=False)
        self.channels_norm = nn.BatchNorm2d(outputs)
        self.attention: nn.Module = nn.Identity()
        if attention == "cbam":
            self.attention = nn.Sequential(ChannelAttention(outputs), SpatialAttention())
        self.shortcut: nn.Module = nn.Identity()
        if inputs != outputs or stride != 1:
            # Averaging before the projection keeps the cells that a stride alone would skip.
            self.shortcut = nn.Sequential(
                nn.AvgPool2d(stride) if stride != 1 else nn.Identity(),
                nn.Conv2d(inputs, outputs, 1, bias=False),
                nn.BatchNorm2d(outputs),
            )
        # A branch that starts at nothing lets the deepest members train from the first step.
        nn.init.zeros_(self.channels_norm.weight)

    def forward(self, x: Float[Tensor, "b inputs h w"]) -> Float[Tensor, "b outputs h2 w2"]:
        """Shortcut plus attended branch."""
        branch = torch.relu(self.neighbours_norm(self.neighbours(x)))
        branch = self.attention(self.channels_norm(self.channels(branch)))
        return torch.relu(branch + self.shortcut(x))


class GaCnn(nn.Module):
    """A member of the family: canonical input to predicted quality.

    Attributes
    ----------
    config
        What the network was built from.
    channels
        Of its input, see ``canonical.network_input``.
    """

    def __init__(self, config: NetworkConfig, channels: Channels = CHANNELS) -> None:
        """Raise ConfigError where ``config`` names no member of the family."""
        super().__init__()
        self.config = config
        self.channels = channels
        first, last = config.channels[0], config.channels[-1]
        self.stem = nn.Sequential(
            nn.Conv2d(len(channels), first // 2, 3, padding=1, bias=False),
            nn.BatchNorm2d(first // 2),
            nn.ReLU(),
            nn.Conv2d(first // 2, first, 3, stride=2, padding=1, bias=False),
            nn.BatchNorm2d(first),
            nn.ReLU(),
        )
        stages = []
        inputs = first
        for blocks, outputs, stride in zip(
            blocks_per_stage(config.layers), config.channels, _STAGE_STRIDES, strict=True
        ):
            stage = [AttentionBlock(inputs, outputs, stride, config.attention)]
            stage += [
                AttentionBlock(outputs, outputs, 1, config.attention) for _ in range(blocks - 1)
            ]
            stages.append(nn.Sequential(*stage))
            inputs = outputs
        self.stages = nn.Sequential(*stages)
        self.head = nn.Sequential(
            nn.Linear(last, last // _HEAD_REDUCTION),
            nn.ReLU(),
            nn.Linear(last // _HEAD_REDUCTION, 1),
        )

    def forward(self, x: Float[Tensor, "b c h w"]) -> Float[Tensor, " b"]:
        """Predicted quality q̂ in [0, 1] of canonical inputs (see ``canonical``)."""
        features = self.stages(self.stem(x))
        logits: Tensor = self.head(features.mean(dim=(2, 3)))
        return torch.sigmoid(logits.float()).squeeze(1)


def build_network(config: NetworkConfig, seed: int, channels: Channels = CHANNELS) -> GaCnn:
    """Build a network with initial weights drawn from a seed; global generators are not changed.

    Parameters
    ----------
    config
        Depth, channels and attention.
    seed
        Seed of the weights.
    channels
        Channels of its input, one of ``input_channels.KNOWN_CHANNELS``.

    Returns
    -------
    The network, on the CPU.

    Raises
    ------
    ConfigError
        ``config`` names no member of the family.
    """
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return GaCnn(config, channels)


def parameter_count(network: nn.Module) -> int:
    """Trained numbers of the network: weights and biases, without running statistics."""
    return sum(parameter.numel() for parameter in network.parameters())


def weighted_layer_count(network: GaCnn) -> int:
    """Weighted layers by walking the built network, in the sense of the module's docstring."""
    beside_the_path = ("shortcut", "attention")
    return sum(
        isinstance(module, nn.Conv2d | nn.Linear)
        for name, module in network.named_modules()
        if not any(part in beside_the_path for part in name.split("."))
    )
