"""A sweep's networks and budget ↔ softgrip.v1.SweepNetwork and SweepBudget."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from itertools import combinations
from pathlib import Path
from typing import Any

from google.protobuf.json_format import MessageToDict

from pipeline.artifacts.reading import open_artifact
from pipeline.config import RunConfig
from pipeline.config.learning import NetworkConfig
from pipeline.messages.training import epoch_message
from pipeline.network.baselines import mean_predictor_mae
from pipeline.network.family import (
    VARIANTS,
    Member,
    MemberFigures,
    SeedSpread,
    choose_member,
    seed_spread,
)
from pipeline.network.samples import Samples
from pipeline.network.training import TrainedNetwork
from schemas.softgrip.v1.training_pb2 import SweepBudget, SweepNetwork


def sweep_message(member: Member, trained: TrainedNetwork, figures: MemberFigures) -> SweepNetwork:
    """The message of one trained member."""
    return SweepNetwork(
        group=member.group,
        variant=member.variant,
        layers=member.network.layers,
        channels=member.network.channels,
        seed=member.seed,
        parameters=figures.parameters,
        multiply_adds=figures.multiply_adds,
        val_mae=figures.val_mae,
        val_mae_spread=figures.val_mae_spread,
        test_mae=figures.test_mae,
        test_mae_single=figures.test_mae_single,
        test_mae_averaged=figures.test_mae_averaged,
        test_mae_by_class=figures.by_class,
        best_epoch=trained.kept_epoch,
        curve=[epoch_message(epoch) for epoch in trained.history],
    )


def read_sweep(path: Path) -> list[SweepNetwork]:
    """Every network of a sweep's artifact, in its order."""
    with open_artifact(path) as artifact:
        return [message for _, message in artifact.messages(SweepNetwork)]


def mark_networks(networks: list[SweepNetwork], of_run: NetworkConfig) -> None:
    """Set ``of_run`` where the size is the run's, and ``chosen`` on one of the family."""
    for network in networks:
        size = (network.layers, tuple(network.channels))
        network.of_run = size == (of_run.layers, of_run.channels)
    family = [network for network in networks if network.group == "family"]
    chosen = choose_member(
        [network.val_mae for network in family],
        [network.val_mae_spread for network in family],
        [network.multiply_adds for network in family],
    )
    family[chosen].chosen = True


def spread_of_seeds(networks: Sequence[SweepNetwork]) -> SeedSpread | None:
    """What the seed alone changes in ``test_mae``; None where nothing was trained twice."""
    errors = defaultdict(list)
    for network in networks:
        if network.group in ("family", "repeat"):
            errors[network.layers, tuple(network.channels)].append(network.test_mae)
    return seed_spread([*errors.values()])


def told_differences(networks: Sequence[SweepNetwork], spread: SeedSpread) -> dict[str, Any]:
    """Which networks of the family differ in test error by more than the seeds explain.

    Parameters
    ----------
    networks
        Of one sweep, one of them chosen.
    spread
        What the seed alone changes.

    Returns
    -------
    The spread's values; how many pairs of the family there are and how many differ; and the names
    (channels and layers) of those that are better and worse than the chosen one.
    """
    family = [network for network in networks if network.group == "family"]
    (chosen,) = (network for network in family if network.chosen)
    least = spread.least_difference
    pairs = [abs(one.test_mae - other.test_mae) for one, other in combinations(family, 2)]
    return {
        **asdict(spread),
        "pairs": len(pairs),
        "pairs_that_differ": sum(difference > least for difference in pairs),
        "better_than_chosen": [
            member_name(one) for one in family if chosen.test_mae - one.test_mae > least
        ],
        "worse_than_chosen": [
            member_name(one) for one in family if one.test_mae - chosen.test_mae > least
        ],
    }


def channels_name(network: SweepNetwork) -> str:
    """Name of a channel set, such as ``64-128-256-512``."""
    return "-".join(map(str, network.channels))


def member_name(network: SweepNetwork) -> str:
    """Channels and layers, such as ``64-128-256-512, 52``."""
    return f"{channels_name(network)}, {network.layers}"


def network_config_of(network: SweepNetwork) -> NetworkConfig:
    """Configuration of a network of the sweep."""
    attention = "none" if network.variant == "no attention" else "cbam"
    channels = tuple(network.channels)
    return NetworkConfig.model_validate(
        {"layers": network.layers, "channels": channels, "attention": attention}
    )


def budget_message(config: RunConfig, given: dict[str, Samples]) -> SweepBudget:
    """What every network was given: samples by split, epochs, batch size; and the error to beat."""
    return SweepBudget(
        train_samples=len(given["train"]),
        val_samples=len(given["val"]),
        test_samples=len(given["test"]),
        epochs=config.sweep.epochs,
        batch_size=config.sweep.batch_size,
        mean_predictor_mae=mean_predictor_mae(given["train"].quality, given["test"].quality),
    )


def sweep_summary(
    networks: list[SweepNetwork], times_ms: list[float], budget: SweepBudget
) -> dict[str, Any]:
    """The study's headline figures; ``times_ms`` is each network's time a grasp."""
    rows = [
        {**plain_values(network), "ms_a_grasp": time_ms}
        for network, time_ms in zip(networks, times_ms, strict=True)
    ]
    ablation = {
        variant: {
            name: [
                getattr(n, name) for n in networks if (n.group, n.variant) == ("ablation", variant)
            ]
            for name in ("test_mae_single", "test_mae_averaged")
        }
        for variant in VARIANTS
    }
    spread = spread_of_seeds(networks)
    return {
        "seeds": told_differences(networks, spread) if spread else {},
        "chosen": next(row for row in rows if row["chosen"]),
        "ablation": ablation,
        "budget": plain_values(budget),
        "networks": rows,
    }


def plain_values(message: SweepNetwork | SweepBudget) -> dict[str, Any]:
    """Values of a message by field name, default values included; curves are left out."""
    fields = MessageToDict(
        message, preserving_proto_field_name=True, always_print_fields_with_no_presence=True
    )
    return {
        name: getattr(message, name) if isinstance(value, str | float | int) else value
        for name, value in fields.items()
        if name != "curve"
    }
