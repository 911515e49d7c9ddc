"""The family compared: members on one budget, their cost, and which one to take; Fig. 1.

Supplement IV varies depth and channels jointly and takes a network that «keeps satisfying
performance in the aspects of both the average error and computational complexity». Here that is
the one-standard-error rule: of the members whose validation error is no further above the lowest
than the standard error of that lowest, the one of fewest multiply-adds.

The ablation takes one member and leaves out one part at a time: attention (what remains is a
residual network of the same depth and width), and the symmetries (neither turned and mirrored in
training nor averaged over in prediction).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from jaxtyping import Float
from torch.utils.flop_counter import FlopCounterMode

from pipeline.config.learning import NetworkConfig, SweepConfig
from pipeline.network.ga_cnn import GaCnn, build_network

Variant = Literal["ga-cnn", "no attention", "no augmentation"]
VARIANTS: tuple[Variant, ...] = ("ga-cnn", "no attention", "no augmentation")

_CELLS = 24


@dataclass(frozen=True)
class Member:
    """One network to train.

    group : "family" of Fig. 1, or "ablation". seed : of its weights and its order of samples.
    """

    group: Literal["family", "ablation"]
    variant: Variant
    network: NetworkConfig
    seed: int

    @property
    def augment(self) -> bool:
        """Whether it is shown turned and mirrored clouds, and averaged over them."""
        return self.variant != "no augmentation"

    @property
    def name(self) -> str:
        """Unlike any other member's; fit for a file."""
        channels = "-".join(map(str, self.network.channels))
        variant = self.variant.replace(" ", "-")
        return f"{self.group}-{variant}-{self.network.layers}-{channels}-{self.seed}"


def members(sweep: SweepConfig, of_run: NetworkConfig, seed: int) -> list[Member]:
    """The family, depth by depth within each channel set, then the ablation of ``of_run``.

    Raises
    ------
    ConfigError : a depth or a channel set is no member's.
    """
    family = [
        Member("family", "ga-cnn", NetworkConfig(layers=layers, channels=channels), seed)
        for channels in sweep.channels
        for layers in sweep.depths
    ]
    ablation = [
        Member(
            "ablation",
            variant,
            of_run.model_copy(
                update={"attention": "none" if variant == "no attention" else "cbam"}
            ),
            seed + repeat,
        )
        for repeat in range(sweep.ablation_seeds)
        for variant in VARIANTS
    ]
    for member in (*family, *ablation):
        build_network(member.network, seed=0)  # said before the first training, not after hours
    return [*family, *ablation]


def multiply_adds(network: GaCnn) -> int:
    """Multiplications with addition that one grasp costs, as the convolutions' sizes say."""
    example = torch.zeros(1, len(network.channels), _CELLS, _CELLS)
    with FlopCounterMode(display=False) as counter, torch.inference_mode():
        network.eval()(example)
    return int(counter.get_total_flops()) // 2


def standard_error(errors: Float[np.ndarray, " n"]) -> float:
    """Standard error of the errors' mean."""
    return float(errors.std(dtype=np.float64) / np.sqrt(len(errors)))


def chosen_member(
    val_mae: Sequence[float], val_mae_spread: Sequence[float], cost: Sequence[int]
) -> int:
    """Index of the cheapest whose validation error is within one standard error of the lowest."""
    best = int(np.argmin(val_mae))
    bound = val_mae[best] + val_mae_spread[best]
    within = [index for index, error in enumerate(val_mae) if error <= bound]
    return min(within, key=lambda index: (cost[index], val_mae[index]))
