"""A sweep's networks → softgrip.v1.SweepNetwork."""

from dataclasses import dataclass
from pathlib import Path

from pipeline.artifacts.reading import open_artifact
from pipeline.messages.training import epoch_message
from pipeline.network.family import Member
from pipeline.network.training import TrainedNetwork
from schemas.softgrip.v1.training_pb2 import SweepNetwork


@dataclass(frozen=True)
class MemberFigures:
    """One member after its training; errors are mean |q-hat - q|.

    val_mae, val_mae_spread : of the best epoch, and the standard error of that mean.
    test_mae_single, test_mae_averaged : of one prediction a grasp, and of the mean over its
    symmetries; test_mae : averaged where the member was trained with symmetries, else single.
    by_class : class name → test error. parameters, multiply_adds : its size, its cost a grasp.
    """

    val_mae: float
    val_mae_spread: float
    test_mae: float
    test_mae_single: float
    test_mae_averaged: float
    by_class: dict[str, float]
    parameters: int
    multiply_adds: int


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
