"""Two processes under torchrun take the steps that one takes."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from pipeline.config.learning import NetworkConfig
from pipeline.network.ga_cnn import build_network
from pipeline.network.input_channels import CHANNELS
from pipeline.network.parallel import ALONE, SyncedBatchNorm, join_ranks, sync_batch_norms
from tests.network.train_in_ranks import SAMPLES, trained_in

ROOT = Path(__file__).resolve().parents[2]


def test_two_processes_and_their_loaders_give_the_curve_of_one(tmp_path: Path) -> None:
    together = tmp_path / "together"
    together.mkdir()
    done = subprocess.run(
        [
            *(sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node=2"),
            *("-m", "tests.network.train_in_ranks", str(together)),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    seen = [json.loads((together / f"seen-{rank}.json").read_text()) for rank in range(2)]
    assert seen[0]["history"] == seen[1]["history"]
    # The norm and its gradient, on the two parts of a batch, are those of the whole.
    assert max(each["norm_difference"] for each in seen) < 1e-5
    alone = trained_in(tmp_path / "alone", ALONE, loader_workers=0)
    for ours, theirs in zip(seen[0]["history"], alone.history, strict=True):
        assert ours["samples"] == theirs.samples == SAMPLES
        # Rounding alone separates them, and grows from step to step.
        assert ours["train_loss"] == pytest.approx(theirs.train_loss, rel=2e-3)
        assert ours["train_mae"] == pytest.approx(theirs.train_mae, rel=2e-3)
        assert ours["val_mae"] == pytest.approx(theirs.val_mae, rel=2e-2)


def test_without_torchrun_a_process_is_alone() -> None:
    with join_ranks() as ranks:
        assert ranks == ALONE
        values = torch.ones(3)
        assert ranks.summed(values) is values


def test_synced_norms_keep_names_and_weights_and_predict_alike() -> None:
    config = NetworkConfig(layers=18, channels=(16, 16, 32, 32))
    plain, synced = build_network(config, seed=0), build_network(config, seed=0)
    parameters = list(synced.parameters())
    sync_batch_norms(synced)
    assert all(a is b for a, b in zip(parameters, synced.parameters(), strict=True))
    assert list(synced.state_dict()) == list(plain.state_dict())
    norms = [m for m in synced.modules() if isinstance(m, torch.nn.BatchNorm2d)]
    assert norms
    assert all(isinstance(norm, SyncedBatchNorm) for norm in norms)
    inputs = torch.randn(4, len(CHANNELS), 24, 24, generator=torch.Generator().manual_seed(0))
    with torch.inference_mode():
        assert torch.equal(synced.eval()(inputs), plain.eval()(inputs))
