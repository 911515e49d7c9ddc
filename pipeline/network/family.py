"""The family compared: members on one budget, their cost, and which one to take; Fig. 1.

Supplement IV varies depth and channels jointly and takes a network that «keeps satisfying
performance in the aspects of both the average error and computational complexity». Here that is
the one-standard-error rule: of the members whose validation error is no further above the lowest
than the standard error of that lowest, the one of fewest multiply-adds.

What a training arrives at depends on its seed too. Some of the family are trained with several
seeds; the pooled standard deviation within them says by how much two networks must differ for it to
be more than chance.

The ablation takes one member and leaves out one part at a time: attention (what remains is a
residual network of the same depth and width), and the symmetries (neither turned and mirrored in
training nor averaged over in prediction).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.stats import t as student_t
from torch.utils.flop_counter import FlopCounterMode

from pipeline.config.learning import NetworkConfig, SweepConfig, TrainConfig
from pipeline.network.figures import error_by_group, mean_absolute_error
from pipeline.network.ga_cnn import GaCnn, build_network, parameter_count
from pipeline.network.inference import predict
from pipeline.network.samples import Samples
from pipeline.network.timing import milliseconds_a_grasp
from pipeline.network.training import TrainedNetwork
from pipeline.network.training_figures import CLASSES

CONFIDENCE = 0.95  # that a difference is not of the seeds, as for all intervals here

Variant = Literal["ga-cnn", "no attention", "no augmentation"]
VARIANTS: tuple[Variant, ...] = ("ga-cnn", "no attention", "no augmentation")


@dataclass(frozen=True)
class Member:
    """One network to train.

    Attributes
    ----------
    group
        "family" of Fig. 1; "repeat", one of the family with another seed; or "ablation".
    variant
        Which part is left out; "ga-cnn": none.
    network
        Depth, channels and attention.
    seed
        Seed of its weights and of its order of samples.
    """

    group: Literal["family", "repeat", "ablation"]
    variant: Variant
    network: NetworkConfig
    seed: int

    @property
    def augment(self) -> bool:
        """Whether it trains on turned and mirrored clouds, and predictions average over them."""
        return self.variant != "no augmentation"

    @property
    def name(self) -> str:
        """A name for files that no other member has."""
        channels = "-".join(map(str, self.network.channels))
        variant = self.variant.replace(" ", "-")
        return f"{self.group}-{variant}-{self.network.layers}-{channels}-{self.seed}"


@dataclass(frozen=True)
class MemberFigures:
    """One member after its training; errors are mean |q̂ − q|.

    Attributes
    ----------
    val_mae
        Validation error of the kept epoch.
    val_mae_spread
        Standard error of that mean.
    test_mae
        ``test_mae_averaged`` where the member was trained with symmetries, else
        ``test_mae_single``.
    test_mae_single
        Test error of one prediction a grasp.
    test_mae_averaged
        Test error of the mean over a grasp's symmetries.
    by_class
        Name of a shape class → test error.
    parameters
        Trained numbers of the network.
    multiply_adds
        Multiplications with addition for one grasp.
    """

    val_mae: float
    val_mae_spread: float
    test_mae: float
    test_mae_single: float
    test_mae_averaged: float
    by_class: dict[str, float]
    parameters: int
    multiply_adds: int


def list_members(sweep: SweepConfig, of_run: NetworkConfig, seed: int) -> list[Member]:
    """The members to train: the family by channel set and depth, its repeats, the ablation.

    Those repeated are spread over depths and channel sets: every ``sweep.seeded_every``-th along a
    channel set, one depth further in each.

    Parameters
    ----------
    sweep
        Depths and channel sets of the family, seeds of its repeats and of the ablation.
    of_run
        The network that parts are left out of.
    seed
        Seed of the family, and the ablation's first.

    Returns
    -------
    The members in the order to train them.

    Raises
    ------
    ConfigError
        A depth or a channel set is no member's.
    """
    family = [
        Member("family", "ga-cnn", NetworkConfig(layers=layers, channels=channels), seed)
        for channels in sweep.channels
        for layers in sweep.depths
    ]
    repeats = [
        Member("repeat", "ga-cnn", NetworkConfig(layers=layers, channels=channels), seed + repeat)
        for repeat in range(1, sweep.seeds)
        for row, channels in enumerate(sweep.channels)
        for column, layers in enumerate(sweep.depths)
        if (row + column) % sweep.seeded_every == 0
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
    members = [*family, *repeats, *ablation]
    for member in members:
        build_network(member.network, seed=0)  # said before the first training, not after hours
    return members


def member_training(config: TrainConfig, sweep: SweepConfig, member: Member) -> TrainConfig:
    """The run's training cut to the budget, on one thread: members train side by side."""
    cut = {"epochs": sweep.epochs, "patience_epochs": sweep.epochs, "batch_size": sweep.batch_size}
    own = {"threads": 1, "augment": member.augment}
    return config.model_copy(update={**cut, **own})


def measure_member(
    member: Member, trained: TrainedNetwork, config: TrainConfig, val: Samples, test: Samples
) -> MemberFigures:
    """Error and cost of a trained member.

    Parameters
    ----------
    member
        What was to be trained.
    trained
        The result of the training.
    config
        Batch size and threads to predict with.
    val
        Held-out samples of which the spread of the validation error is taken.
    test
        Held-out samples of which the test errors are taken.

    Returns
    -------
    Its figures.
    """

    def predicted(samples: Samples, averaged: bool) -> Float[np.ndarray, " n"]:
        size, threads = config.batch_size, config.threads
        cloud, mask = samples.cloud, samples.cloud_mask
        return predict(trained.network, cloud, mask, size, threads, averaged)

    single, averaged = predicted(test, averaged=False), predicted(test, averaged=True)
    usual = averaged if member.augment else single
    return MemberFigures(
        val_mae=trained.val_mae,
        val_mae_spread=standard_error(np.abs(predicted(val, averaged=False) - val.quality)),
        test_mae=mean_absolute_error(usual, test.quality),
        test_mae_single=mean_absolute_error(single, test.quality),
        test_mae_averaged=mean_absolute_error(averaged, test.quality),
        by_class=error_by_group(usual, test.quality, CLASSES[test.shape_class]),
        parameters=parameter_count(trained.network),
        multiply_adds=multiply_adds(trained.network, test.cloud_mask.shape[1]),
    )


def time_network_ms(config: NetworkConfig, test: Samples, batch: int, threads: int) -> float:
    """Milliseconds a grasp of a network of this configuration on the CPU, in batches of ``batch``.

    Its weights are drawn at random, as they do not change the time.
    """
    network = build_network(config, seed=0)

    def ask(
        cloud: Float[np.ndarray, "n h w 3"], mask: Bool[np.ndarray, "n h w"]
    ) -> Float[np.ndarray, " n"]:
        return predict(network, cloud, mask, len(cloud), threads, average_symmetries=False)

    (time,) = milliseconds_a_grasp(
        ask, test.cloud[:batch], test.cloud_mask[:batch], (batch,)
    ).values()
    return time


def multiply_adds(network: GaCnn, cells: int) -> int:
    """Multiplications with addition for one grasp of cells by cells, by the layers' sizes."""
    example = torch.zeros(1, len(network.channels), cells, cells)
    with FlopCounterMode(display=False) as counter, torch.inference_mode():
        network.eval()(example)
    return int(counter.get_total_flops()) // 2


def standard_error(errors: Float[np.ndarray, " n"]) -> float:
    """Standard error of the errors' mean."""
    return float(errors.std(dtype=np.float64) / np.sqrt(len(errors)))


@dataclass(frozen=True)
class SeedSpread:
    """What the seed alone changes in an error.

    Attributes
    ----------
    deviation
        Standard deviation of one training's error, pooled over the networks trained repeatedly.
    degrees
        Degrees of freedom of that estimate.
    least_difference
        Two networks, each trained once, whose errors differ by more than this differ by more than
        chance (two-sided, ``CONFIDENCE``): t · √2 · deviation.
    """

    deviation: float
    degrees: int
    least_difference: float


def seed_spread(repeated: Sequence[Sequence[float]]) -> SeedSpread | None:
    """Pool the spread of errors within networks that were trained with several seeds.

    Parameters
    ----------
    repeated
        For each network the errors of its trainings; one error says nothing.

    Returns
    -------
    The spread; None where no network was trained twice.
    """
    groups = [np.asarray(errors, dtype=np.float64) for errors in repeated]
    degrees = sum(len(errors) - 1 for errors in groups)
    if degrees < 1:
        return None
    squares = sum(float(((errors - errors.mean()) ** 2).sum()) for errors in groups)
    deviation = float(np.sqrt(squares / degrees))
    quantile = float(student_t.ppf((1 + CONFIDENCE) / 2, degrees))
    return SeedSpread(deviation, degrees, quantile * float(np.sqrt(2)) * deviation)


def choose_member(
    val_mae: Sequence[float], val_mae_spread: Sequence[float], cost: Sequence[int]
) -> int:
    """Index of the cheapest whose validation error is within one standard error of the lowest."""
    best = int(np.argmin(val_mae))
    bound = val_mae[best] + val_mae_spread[best]
    within = [index for index, error in enumerate(val_mae) if error <= bound]
    return min(within, key=lambda index: (cost[index], val_mae[index]))
