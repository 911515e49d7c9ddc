"""The sweep on a tiny run: every network once, one chosen, killed and gone on to the same bytes."""

import json
import shutil
import signal
from pathlib import Path

import pytest

from pipeline.artifacts import open_artifact
from pipeline.execution import RunFolder
from pipeline.messages.sweep import read_sweep
from schemas.softgrip.v1.training_pb2 import SweepBudget
from tests.stages.conftest import run_stage
from tests.stages.test_recordings import drawn_share, seen_or_skipped
from tests.stages.test_resuming import kill_when

SWEEP = """
[sweep]
depths = [18, 20]
channels = [[4, 4, 4, 4], [8, 8, 8, 8]]
seeds = 2
seeded_every = 2
ablation_seeds = 1
samples = 64
held_out_samples = 32
epochs = 1
"""


def folder_with_shards(run: RunFolder, path: Path) -> RunFolder:
    """What the sweep reads of a run, in a folder of its own."""
    folder = RunFolder(path / "tiny")
    shutil.copytree(run.shards("shards"), folder.shards("shards"))
    shutil.copy(run.artifact("shards"), folder.path)
    folder.config.write_text(run.config.read_text() + SWEEP)
    return folder


@pytest.fixture(scope="module")
def swept(run: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    folder = folder_with_shards(run, tmp_path_factory.mktemp("sweep"))
    done = run_stage("sweep", folder.path.parent, workers=1)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder


def test_every_network_of_family_and_ablation_is_there_once(swept: RunFolder) -> None:
    networks = read_sweep(swept.artifact("sweep"))
    family = [(tuple(n.channels), n.layers) for n in networks if n.group == "family"]
    assert family == [((c, c, c, c), layers) for c in (4, 8) for layers in (18, 20)]
    ablation = [n for n in networks if n.group == "ablation"]
    assert [n.variant for n in ablation] == ["ga-cnn", "no attention", "no augmentation"]
    assert all(n.of_run and n.layers == 18 for n in ablation)
    assert ablation[1].parameters < ablation[0].parameters == ablation[2].parameters
    assert sum(n.chosen for n in networks) == 1
    for network in networks:
        assert 0 < network.test_mae < 1
        expected = network.test_mae_averaged
        if network.variant == "no augmentation":
            expected = network.test_mae_single
        assert network.test_mae == expected
        assert [epoch.samples for epoch in network.curve] == [64]
    with open_artifact(swept.artifact("sweep")) as artifact:
        budget = artifact.one(SweepBudget)
    assert (budget.train_samples, budget.epochs) == (64, 1)
    assert not swept.state("sweep").exists()


def test_the_summary_has_the_artifacts_figures_and_a_time_each(swept: RunFolder) -> None:
    networks = read_sweep(swept.artifact("sweep"))
    summary = json.loads(swept.summary("sweep").read_text())
    assert len(summary["networks"]) == len(networks)
    for row, network in zip(summary["networks"], networks, strict=True):
        assert row["layers"] == network.layers
        assert row["test_mae"] == network.test_mae
        assert row["ms_a_grasp"] > 0
    assert summary["chosen"] in summary["networks"]
    told = summary["seeds"]
    repeats = [n for n in networks if n.group == "repeat"]
    assert [(n.layers, n.channels[0], n.seed) for n in repeats] == [(18, 4, 5), (20, 8, 5)]
    assert told["degrees"] == len(repeats)
    assert 0 < told["deviation"] < told["least_difference"]
    assert told["pairs"] == 6
    chosen = summary["chosen"]["test_mae"]
    worse = [n for n in networks if n.group == "family"]
    worse = [n for n in worse if n.test_mae - chosen > told["least_difference"]]
    assert len(told["worse_than_chosen"]) == len(worse)
    assert set(summary["ablation"]) == {"ga-cnn", "no attention", "no augmentation"}


def test_killed_after_its_first_network_it_ends_with_the_same_bytes(
    run: RunFolder, swept: RunFolder, tmp_path: Path
) -> None:
    folder = folder_with_shards(run, tmp_path)
    pieces = ".state/sweep/*.mcap"
    code = kill_when("sweep", folder, lambda _: any(folder.path.glob(pieces)))
    assert code == -signal.SIGKILL
    assert list(folder.path.glob(pieces))
    done = run_stage("sweep", tmp_path, workers=2)
    assert done.returncode == 0, done.stderr[-3000:]
    assert folder.artifact("sweep").read_bytes() == swept.artifact("sweep").read_bytes()


def test_the_viewer_shows_figure_and_tables(swept: RunFolder) -> None:
    sight = seen_or_skipped(swept.recording("sweep"))
    assert sight.problems == ()
    assert sight.timeline == "layers"
    assert all(drawn_share(png) > 0 for png in sight.view_png.values())
