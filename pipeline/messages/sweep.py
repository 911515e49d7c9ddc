"""A sweep's networks and budget ↔ softgrip.v1.SweepNetwork and SweepBudget."""

from pathlib import Path
from typing import Any

from google.protobuf.json_format import MessageToDict

from pipeline.artifacts.reading import open_artifact
from pipeline.config import RunConfig
from pipeline.config.learning import NetworkConfig
from pipeline.messages.training import epoch_message
from pipeline.network.baselines import mean_predictor_mae
from pipeline.network.family import VARIANTS, Member, MemberFigures, choose_member
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
        best_epoch=trained.best_epoch,
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
    return {
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
